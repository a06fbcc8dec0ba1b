"""Surface models on disk: ``terrains/<id>/{manifest.json, *.npy}``; workers read and write them by folder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from affine import Affine
from pydantic import BaseModel, ConfigDict
from pyproj import CRS

from planning.errors import NoElevationError
from planning.terrain.dsm import Dsm
from planning.terrain.spikes import Spike
from server.library.shelf import read_manifest, utc_now, write_manifest
from server.library.stored_arrays import CellsManifest, read_array, read_cells, write_array, write_cells
from server.library.whole_files import new_directory, new_id
from server.schemas import CloudDoc, PlaceDoc, SpikeDoc, TerrainDoc
from telemetry.topics.obstacles import GroundNotice

FOLDER = "terrains"
_ELEVATION, _LOWEST, _SEAM = "elevation.npy", "lowest.npy", "seam.npy"
_MAX_SPIKES = 100


@dataclass(frozen=True, slots=True)
class Origin:
    """What the page that sent a file knows of it, to tell two of the same name apart."""

    folder: str = ""
    file_utc: str | None = None


UNKNOWN_ORIGIN = Origin()


class TerrainManifest(BaseModel):
    model_config = ConfigDict(frozen=True)

    format: int = 1
    doc: TerrainDoc
    transform: tuple[float, float, float, float, float, float]
    """Coefficients a..f: pixel corner (column, row) -> projected metres."""
    crs_wkt: str
    source: CellsManifest | None = None
    """Of the file's own cells, where they are no squares of the grid."""
    of_several: bool = False
    """Whether lowest heights and seams lie beside the heights."""
    rms_m: float | None = None
    place_m: float = 0.0


def store_terrain(
    root: Path,
    dsm: Dsm,
    *,
    name: str,
    origin: Origin = UNKNOWN_ORIGIN,
    spikes: Sequence[SpikeDoc] = (),
    warnings: Sequence[str] = (),
    cloud: CloudDoc | None = None,
    in_doubt: bool = False,
    fill: Callable[[Path], None] = lambda folder: None,
) -> TerrainDoc:
    """Adds a model to the data directory ``root``, from any process; raises ``StorageFullError``.

    ``fill`` writes what lies beside it before it counts as stored.
    """
    terrain_id = new_id()
    t = dsm.transform
    doc = _describe(dsm, terrain_id, name=name, origin=origin, spikes=spikes, warnings=warnings)
    doc = doc.model_copy(update={"cloud": cloud, "in_doubt": in_doubt})
    with new_directory(root / FOLDER / terrain_id) as folder:
        write_array(folder / _ELEVATION, dsm.elevation_m)
        for file, beside in ((_LOWEST, dsm.lowest_m), (_SEAM, dsm.seam)):
            if beside is not None:
                write_array(folder / file, beside)
        fill(folder)
        source = write_cells(folder, dsm.source) if dsm.source else None
        transform = (t.a, t.b, t.c, t.d, t.e, t.f)
        manifest = TerrainManifest(doc=doc, transform=transform, crs_wkt=dsm.crs.to_wkt(), source=source)
        told = {"of_several": dsm.lowest_m is not None, "rms_m": dsm.rms_m, "place_m": dsm.place_m}
        write_manifest(folder, manifest.model_copy(update=told))
    return doc


def load_terrain(directory: Path) -> Dsm:
    """The model in this folder, its heights memory-mapped; raises ``StorageError`` when it is damaged."""
    manifest = read_manifest(directory, TerrainManifest)
    shape = (manifest.doc.height_px, manifest.doc.width_px)
    return Dsm(
        elevation_m=read_array(directory / _ELEVATION, shape=shape, dtype=np.float32),
        transform=Affine(*manifest.transform),
        crs=CRS.from_wkt(manifest.crs_wkt),
        vertical_datum=manifest.doc.vertical_datum,
        sha256=manifest.doc.sha256,
        source=read_cells(directory, manifest.source) if manifest.source else None,
        name=manifest.doc.name,
        lowest_m=read_array(directory / _LOWEST, shape=shape, dtype=np.float32) if manifest.of_several else None,
        seam=read_array(directory / _SEAM, shape=shape, dtype=np.bool_) if manifest.of_several else None,
        rms_m=manifest.rms_m,
        place_m=manifest.place_m,
    )


def ground_notice(directory: Path) -> GroundNotice:
    """Tells other processes where the heights lie; raises ``StorageError`` when the manifest is damaged."""
    manifest = read_manifest(directory, TerrainManifest)
    transform = Affine(*manifest.transform)
    return GroundNotice(
        terrain_id=manifest.doc.id,
        name=manifest.doc.name,
        elevation_npy=str((directory / _ELEVATION).absolute()),
        crs_wkt=manifest.crs_wkt,
        west_m=transform.c,
        north_m=transform.f,
        resolution_m=transform.a,
        sha256=manifest.doc.sha256,
    )


def _describe(
    dsm: Dsm, terrain_id: str, *, name: str, origin: Origin, spikes: Sequence[SpikeDoc], warnings: Sequence[str]
) -> TerrainDoc:
    known = int(np.count_nonzero(np.isfinite(dsm.elevation_m)))
    if known == 0:
        raise NoElevationError(
            "Every cell of the surface model is unknown.", where=name, advice="Use a raster with heights."
        )
    return TerrainDoc(
        id=terrain_id,
        name=name,
        width_px=dsm.width_px,
        height_px=dsm.height_px,
        resolution_m=dsm.resolution_m,
        crs=dsm.crs.name,
        vertical_datum=dsm.vertical_datum,
        unknown_share=1 - known / dsm.elevation_m.size,
        min_m=float(np.nanmin(dsm.elevation_m)),
        max_m=float(np.nanmax(dsm.elevation_m)),
        sha256=dsm.sha256,
        spikes=list(spikes),
        warnings=list(warnings),
        corner_lat_lon_deg=_corners(dsm),
        added_utc=utc_now(),
        folder=origin.folder,
        file_utc=origin.file_utc,
    )


def _corners(dsm: Dsm) -> list[PlaceDoc]:
    west, south, east, north = dsm.bounds_m
    corners_xy_m = np.array([(west, north), (east, north), (east, south), (west, south)])
    return [PlaceDoc(lat_deg=lat, lon_deg=lon) for lat, lon in dsm.lat_lon_from_xy(corners_xy_m).tolist()]


def spike_docs(spikes: Sequence[Spike]) -> list[SpikeDoc]:
    """The tallest ones, enough for a list that somebody reads."""
    tallest = sorted(spikes, key=lambda spike: -spike.height_m)[:_MAX_SPIKES]
    return [
        SpikeDoc(
            lat_deg=spike.lat_deg,
            lon_deg=spike.lon_deg,
            size_m=spike.size_m,
            height_m=spike.height_m if spike.kind == "spike" else -spike.height_m,
        )
        for spike in tallest
    ]
