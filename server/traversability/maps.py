"""The maps of one surface model on disk: as one worker leaves them for the next, and as they are kept in its folder."""

from __future__ import annotations

import os
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from affine import Affine
from pyproj import CRS
from pyproj.exceptions import CRSError

from mapping.traversability import Traversability
from mapping.uwb.clearing import Cleared
from planning.ground.traversable import TraversableGround
from planning.terrain.dsm import Dsm
from server.errors import StorageError
from server.library.whole_files import storage_errors, sync_directory, write_durably

_KEPT = "traversability.npz"


@dataclass(frozen=True, slots=True)
class Radar:
    """What a radar log has made of the map."""

    maps: Cleared
    log: str
    """Its name."""
    scans: int
    rule: str = ""
    """How it was fused."""
    left_out: str = ""
    """Which scans of the log count for nothing, and why."""


@dataclass(frozen=True, slots=True)
class Maps:
    ground: TraversableGround
    radar: Radar | None = None


def kept_in(terrain_directory: Path) -> Path:
    """Where the last maps of a surface model are, if there are any."""
    return terrain_directory / _KEPT


def keep(made: Path, terrain_directory: Path) -> Path:
    """Moves maps to their place, instead of those that were there: at once, so that no wish comes between.

    Raises ``StorageError``. ``settle`` makes it outlive a power cut.
    """
    place = kept_in(terrain_directory)
    with storage_errors(place):
        os.replace(made, place)
    return place


def settle(terrain_directory: Path) -> None:
    """Waits for the disk. Raises ``StorageError``."""
    with storage_errors(terrain_directory):
        sync_directory(terrain_directory)


def write_maps(path: Path, maps: Maps) -> None:
    """On the disk when this returns. Raises ``StorageFullError``."""
    dsm, ground, radar = maps.ground.dsm, maps.ground.map, maps.radar
    arrays = {
        "elevation_m": dsm.elevation_m,
        "transform": np.array(tuple(dsm.transform)[:6]),
        "crs_wkt": np.array(dsm.crs.to_wkt()),
        "vertical_datum": np.array(dsm.vertical_datum or ""),
        "sha256": np.array(dsm.sha256),
        "slope_rad": ground.slope_rad,
        "roughness_m": ground.roughness_m,
        "index": ground.index,
        "limit": np.array(ground.untraversable_index),
    }
    if radar is not None:
        arrays |= {
            "probability": radar.maps.probability,
            "time_in_view_s": radar.maps.time_in_view_s,
            "cleared": radar.maps.cleared,
            "seen": radar.maps.seen,
            "log": np.array(radar.log),
            "scans": np.array(radar.scans),
            "rule": np.array(radar.rule),
            "left_out": np.array(radar.left_out),
        }
    with storage_errors(path):
        write_durably(path, lambda file: np.savez(file, **arrays))  # pyright: ignore[reportArgumentType]


def read_maps(path: Path) -> Maps:
    """Raises ``StorageError``, also when the file is damaged."""
    try:
        with storage_errors(path), path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return Maps(_ground(arrays), _radar(arrays) if "probability" in arrays.files else None)
    except (EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile, zlib.error, CRSError) as error:
        raise StorageError(
            f"The file with the traversability of this surface model is damaged: {error}.",
            where=str(path),
            advice="Work it out again: the surface model itself is whole.",
        ) from error


def _ground(arrays: np.lib.npyio.NpzFile) -> TraversableGround:
    dsm = Dsm(
        elevation_m=arrays["elevation_m"],
        transform=Affine(*arrays["transform"].tolist()),
        crs=CRS.from_wkt(str(arrays["crs_wkt"])),
        vertical_datum=str(arrays["vertical_datum"]) or None,
        sha256=str(arrays["sha256"]),
    )
    ground = Traversability(
        slope_rad=arrays["slope_rad"],
        roughness_m=arrays["roughness_m"],
        index=arrays["index"],
        elevation_m=dsm.elevation_m,
        resolution_m=dsm.resolution_m,
        untraversable_index=float(arrays["limit"]),
    )
    return TraversableGround(dsm, ground)


def _radar(arrays: np.lib.npyio.NpzFile) -> Radar:
    cleared = Cleared(arrays["probability"], arrays["time_in_view_s"], arrays["cleared"], arrays["seen"])
    # Maps that were kept before they were told have neither.
    rule, left_out = (str(arrays[name]) if name in arrays.files else "" for name in ("rule", "left_out"))
    return Radar(cleared, str(arrays["log"]), int(arrays["scans"]), rule, left_out)
