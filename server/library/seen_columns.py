"""What was seen and taken into a plan: columns on its surface model, kept beside the model as ``seen-<id>.npz``."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F64
from planning.errors import PoiError
from planning.evading.seen import Columns, burn
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from server.errors import NotReadyError, StorageError
from server.library.terrains import load_terrain
from server.library.whole_files import check_id, new_id, write_atomically

_SAME_M = 0.001


@dataclass(frozen=True, slots=True)
class SeenColumns:
    """Of one sensor's map each: their columns are of different widths."""

    columns: tuple[Columns, ...]

    @property
    def count(self) -> int:
        return sum(len(each.top_alt_dsm_m) for each in self.columns)


def store_seen(terrain_directory: Path, seen: SeenColumns) -> str:
    """Returns the id; raises ``StorageFullError``."""
    seen_id = new_id()
    arrays: dict[str, F64] = {}
    for number, each in enumerate(seen.columns):
        arrays[f"xy_m_{number}"], arrays[f"top_alt_dsm_m_{number}"] = each.xy_m, each.top_alt_dsm_m
        arrays[f"edge_m_{number}"] = np.array(each.edge_m)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # pyright: ignore[reportArgumentType]
    write_atomically(_file(terrain_directory, seen_id), buffer.getvalue())
    return seen_id


def load_seen(terrain_directory: Path, seen_id: str) -> SeenColumns:
    """Raises NotReadyError when the file is gone, ``StorageError`` when it is damaged."""
    path = _file(terrain_directory, seen_id)
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as arrays:
            count = sum(name.startswith("edge_m_") for name in arrays.files)
            return SeenColumns(tuple(_columns(arrays, number) for number in range(count)))
    except FileNotFoundError:
        raise NotReadyError(
            "What was seen and taken into this plan has been deleted.",
            advice="Take it out of the plan, then plan again.",
        ) from None
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise StorageError(
            f"The file is damaged: {error}.", where=str(path), advice="Take what was seen out of the plan."
        ) from error


def load_planned_terrain(terrain_directory: Path, seen_id: str | None) -> Dsm:
    """The surface model that a plan is made, certified and checked over: as read, or raised by what was seen.

    Small holes are filled first: a column may stand on one of them.
    """
    dsm = load_terrain(terrain_directory)
    if seen_id is None:
        return dsm
    dsm, _ = fill_holes(dsm)
    for columns in load_seen(terrain_directory, seen_id).columns:
        dsm = burn(dsm, columns)
    return dsm


def check_home_stands_on_ground(
    terrain_directory: Path, raised: Dsm, home_lat_lon_deg: tuple[float | None, float | None]
) -> None:
    """Raises PoiError where the model's height at home is not the ground's: all heights are counted from there.

    On a column of what was seen the whole flight would be lower than planned by as much as the column is high.
    """
    lat_deg, lon_deg = home_lat_lon_deg
    if lat_deg is None or lon_deg is None or not (abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
        return
    xy_m = raised.xy_from_lat_lon(np.array([[lat_deg, lon_deg]]))
    over_m = float(raised.elevation_at(xy_m)[0] - load_terrain(terrain_directory).elevation_at(xy_m)[0])
    if np.isfinite(raised.elevation_at(xy_m)[0]) and not over_m <= _SAME_M:
        raise PoiError(
            "Something that was seen stands where home is: heights would be counted from its top.",
            where="home",
            advice="Move home, or plan without what was seen.",
        )


def _columns(arrays: np.lib.npyio.NpzFile, number: int) -> Columns:
    return Columns(
        xy_m=arrays[f"xy_m_{number}"],
        top_alt_dsm_m=arrays[f"top_alt_dsm_m_{number}"],
        edge_m=float(arrays[f"edge_m_{number}"]),
    )


def _file(terrain_directory: Path, seen_id: str) -> Path:
    return terrain_directory / f"seen-{check_id(seen_id, kind='seen map')}.npz"
