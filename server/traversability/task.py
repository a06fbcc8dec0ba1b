"""What the workers do about traversability: work it out, clear foliage with a radar log, read it, write a layer."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F32, U8
from mapping.uwb.uwb_params import UwbParams, in_words
from planning.ground.traversable import cleared_ground, traversable_ground
from planning.terrain.geotiff import write_dsm
from server.errors import NotReadyError
from server.library.terrains import load_terrain
from server.scene.geometry.payload import OverlayScene
from server.schemas import LayerName
from server.traversability.legend import chance_classes, classes, legend_of, painted, time_classes
from server.traversability.maps import Maps, Radar, read_maps, write_maps
from server.work.jobs import Progress
from telemetry.perception.uwb_drive import read_scans

DRAWN_CELLS = 1024
"""Per side at most, of what the 3D view lays over the model."""


@dataclass(frozen=True, slots=True, eq=False)
class Worked:
    """What the server keeps of a map that lies on disk."""

    text: str
    resolution_m: float
    cells: int
    untraversable: int
    cleared: int
    seen: int
    uwb_log: str
    scans: int
    codes: Mapping[LayerName, U8]
    """Classes of each layer, coarse enough to be drawn."""
    west_m: float
    north_m: float
    cell_m: float
    uwb_rule: str = ""
    uwb_left_out: str = ""

    def overlay(self, terrain_id: str, layer: LayerName) -> OverlayScene:
        """A layer of the radar's is the map before clearing as long as there is no log."""
        shades = legend_of(layer, with_radar=bool(self.uwb_log))
        codes = self.codes[layer if self.uwb_log else "before"]
        return OverlayScene(terrain_id, painted(codes, shades), self.west_m, self.north_m, self.cell_m)


def work_out(directory: Path, target: Path, resolution_m: float | None, *, report: Progress) -> Worked:
    """The map of a surface model, kept at ``target``. Raises MappingError, PlanningError."""
    report("Working out slope and roughness", None)
    maps = Maps(traversable_ground(load_terrain(directory), resolution_m))
    report("Storing", None)
    write_maps(target, maps)
    return _worked(maps)


def clear_foliage(
    directory: Path,
    source: Path | None,
    target: Path,
    log: Path,
    name: str,
    params: UwbParams | None = None,
    *,
    report: Progress,
) -> Worked:
    """The map at ``source``, or a new one, cleared with a radar log and kept at ``target``.

    Raises MappingError, PlanningError.
    """
    report("Reading the radar log", None)
    scans = read_scans(log, name)
    if source is None:
        report("Working out slope and roughness", None)
        maps = Maps(traversable_ground(load_terrain(directory)))
    else:
        maps = read_maps(source)
    report("Clearing foliage", None)
    params = params or UwbParams()
    radar = Radar(cleared_ground(maps.ground, scans, params), name, len(scans.t_s), in_words(params), scans.left_out)
    cleared = replace(maps, radar=radar)
    report("Storing", None)
    write_maps(target, cleared)
    return _worked(cleared)


def read_again(source: Path, *, report: Progress) -> Worked:
    """Maps that were kept. Raises StorageError."""
    report("Reading", None)
    return _worked(read_maps(source))


def layer_file(source: Path, layer: LayerName, *, report: Progress) -> bytes:
    """A GeoTIFF on the map's grid: share of the limit (0 to 1), probability, or seconds; NaN unknown."""
    report("Writing the layer", None)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"{layer}.tif"
        write_layer(target, read_maps(source), layer)
        return target.read_bytes()


def write_layer(path: Path, maps: Maps, layer: LayerName) -> None:
    """A GeoTIFF on the map's grid. Raises NotReadyError for a layer of the radar's before there is a log."""
    write_dsm(path, replace(maps.ground.dsm, elevation_m=_values(maps, layer), vertical_datum=None))


def _values(maps: Maps, layer: LayerName) -> F32:
    """(rows, cols) of a layer; the cleared map is the share of the limit with 0 where foliage was cleared."""
    value, radar = maps.ground.map.value, maps.radar
    if layer == "before" or (layer == "cleared" and radar is None):
        return value
    if radar is None:
        raise NotReadyError("No radar log has been taken in yet.", advice="Drop a UWB radar log first.")
    if layer == "cleared":
        return np.where(radar.maps.cleared, np.float32(0.0), value).astype(np.float32)
    values = radar.maps.probability if layer == "probability" else radar.maps.time_in_view_s
    return np.where(maps.ground.map.known, values, np.nan).astype(np.float32)


def _worked(maps: Maps) -> Worked:
    ground, radar, dsm = maps.ground.map, maps.radar, maps.ground.dsm
    cells, blocked = int(ground.known.sum()), int(ground.untraversable.sum())
    cleared = 0 if radar is None else int(radar.maps.cleared.sum())
    factor = max(1, math.ceil(max(ground.index.shape) / DRAWN_CELLS))
    return Worked(
        text=_words(cells, blocked, None if radar is None else cleared),
        resolution_m=dsm.resolution_m,
        cells=cells,
        untraversable=blocked,
        cleared=cleared,
        seen=0 if radar is None else int(radar.maps.seen.sum()),
        uwb_log="" if radar is None else radar.log,
        scans=0 if radar is None else radar.scans,
        codes={layer: _largest(codes, factor) for layer, codes in _codes(maps).items()},
        west_m=dsm.transform.c,
        north_m=dsm.transform.f,
        cell_m=factor * dsm.resolution_m,
        uwb_rule="" if radar is None else radar.rule,
        uwb_left_out="" if radar is None else radar.left_out,
    )


def _codes(maps: Maps) -> dict[LayerName, U8]:
    ground, radar = maps.ground.map, maps.radar
    value = ground.value
    codes: dict[LayerName, U8] = {"before": classes("before", value, np.zeros(value.shape, np.bool_))}
    if radar is not None:
        told = ground.untraversable & (radar.maps.time_in_view_s > 0)
        codes["cleared"] = classes("cleared", value, radar.maps.cleared)
        codes["probability"] = chance_classes(radar.maps.probability, told)
        codes["time_in_view"] = time_classes(radar.maps.time_in_view_s)
    return codes


def _largest(codes: U8, factor: int) -> U8:
    """The highest class of each block: one untraversable cell is not lost among others."""
    rows, cols = codes.shape
    over = np.pad(codes, ((0, -rows % factor), (0, -cols % factor)))
    return over.reshape(over.shape[0] // factor, factor, over.shape[1] // factor, factor).max(axis=(1, 3))


def _words(cells: int, blocked: int, cleared: int | None) -> str:
    if cells == 0:
        return "The surface model is too sparse: no cell has enough known neighbours."
    share = f"{blocked:,} of {cells:,} cells ({100 * (blocked / cells):.1f} %) are untraversable"
    if cleared is None:
        return f"{share}."
    return f"{share}; the radar shows {cleared:,} of those to be soft vegetation."
