"""Reads surface models and orthomosaics from GeoTIFF or ESRI ASCII files, and writes surface models.

Decoding happens in a confined child process (``planning.terrain.rasters``); what comes back are numbers.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from pyproj import CRS

from planning.errors import ParameterError
from planning.terrain.catalogue.joined_models import Catalogue, open_catalogue
from planning.terrain.dsm import Dsm
from planning.terrain.grid_file import GridPlace, rows_written
from planning.terrain.orthophoto import Orthophoto, OrthophotoPlan, drape, plan_orthophoto
from planning.terrain.rasters import georef, sandbox
from planning.terrain.rasters.assemble import ReadReport, assemble
from planning.terrain.rasters.dsm_file import DsmFile
from planning.terrain.rasters.header import RasterHeader, RasterLimits, check_georeference, check_size
from planning.terrain.rasters.http_ranges import RemoteFile
from planning.terrain.rasters.memory_at_hand import watched
from planning.terrain.rasters.reading import Declared, Progress, all_of, raster_job, read_surface
from planning.terrain.spikes import find_spikes
from planning.terrain.spikes import remove_spikes as without_spikes


class ReadOptions(TypedDict, total=False):
    """How a surface model's file is to be understood, what it may ask for, and who wants to hear of it."""

    crs: str | None
    """Declares or overrides what the file says, as does ``vertical_datum``."""
    z_scale: float | None
    """Metres per stored unit: 0.01 for centimetres."""
    vertical_datum: str | None
    limits: RasterLimits | None
    virtual: bool
    """Whether it may be a virtual raster (VRT): a list of tiles in its own folder."""
    progress: Progress | None
    """May raise to cancel."""


def read_dsm(path: str | os.PathLike[str], *, remove_spikes: bool = False, **how: Unpack[ReadOptions]) -> Dsm:
    """A surface model in metres from a GeoTIFF or ESRI ASCII grid: (H, W) heights in the file's own vertical datum.

    Projected metres stay as they are, feet become metres in their places. Degrees and grids whose metres are not true
    go to the local UTM zone, rotated or oblong cells become squares, no height is lost on the way
    (``planning.terrain.cells.squares``); the file's own cells stay with the model for whatever must be exact
    (``Dsm.cells``). Raises a RasterError that says what to do.
    """
    dsm, _ = _read(path, how)
    return without_spikes(dsm, find_spikes(dsm)) if remove_spikes else dsm


def read_dsm_reported(
    path: str | os.PathLike[str], *, remove_spikes: bool = False, **how: Unpack[ReadOptions]
) -> tuple[Dsm, ReadReport]:
    """As ``read_dsm``, and what was found and done."""
    dsm, report = _read(path, how)
    progress = watched(how.get("progress"), where=Path(path).name)
    spikes = find_spikes(dsm, progress=lambda share: progress("spikes", share))
    if remove_spikes:
        dsm = without_spikes(dsm, spikes)
    return dsm, replace(report, spikes=spikes, spikes_removed=remove_spikes and bool(spikes))


def open_dsm(path: str | os.PathLike[str] | RemoteFile, **how: Unpack[ReadOptions]) -> DsmFile:
    """The surface model of ``read_dsm``, of a large file only the parts that are asked for; isolated spikes stay."""
    return DsmFile(path if isinstance(path, RemoteFile) else Path(path), _declared(how), how.get("progress"))


def open_models_of(path: str | os.PathLike[str], **how: Unpack[ReadOptions]) -> Catalogue:
    """Several surface models as one (``planning.terrain.catalogue``): a folder of GeoTIFFs, or a STAC document."""
    return open_catalogue(Path(path), _declared(how), how.get("progress"))


def read_orthophoto(
    path: str | os.PathLike[str],
    *,
    bounds_m: tuple[float, float, float, float],
    crs: CRS,
    declared_crs: str | None = None,
    max_px: int = 2048,
    limits: RasterLimits | None = None,
    progress: Progress | None = None,
) -> Orthophoto:
    """The part of an orthomosaic inside (west, south, east, north) of a surface model in ``crs``.

    At most ``max_px`` wide and high. ``declared_crs`` is for files that do not name theirs.
    """
    source, limits = Path(path), limits or RasterLimits()
    plans: list[OrthophotoPlan] = []

    def order(fields: dict[str, Any]) -> dict[str, Any]:
        header = RasterHeader.from_json(fields)
        check_size(header, limits.max_px, limits, where=source.name)
        check_georeference(header, where=source.name)
        reference = georef.interpret(header, crs=declared_crs, vertical_datum=None, where=source.name)
        plans.append(plan_orthophoto(header, reference.horizontal, bounds_m, crs, max_px=max_px, where=source.name))
        return plans[0].order()

    with sandbox.private_directory() as directory:
        job = raster_job("read_picture", source, directory)
        sandbox.run_job(job, directory=directory, limits=limits, where=source.name, on_header=order, progress=progress)
        rgba = np.fromfile(job["target"], dtype=np.uint8).reshape(*plans[0].out_shape, 4)
    return drape(rgba, plans[0])


def write_dsm(path: str | os.PathLike[str], dsm: Dsm) -> None:
    """A tiled, compressed GeoTIFF from which ``read_dsm`` gets grid, reference system and datum back."""
    with rows_written(path, GridPlace(dsm.transform, dsm.crs, dsm.vertical_datum, dsm.elevation_m.shape)) as put:
        put(dsm.elevation_m)


def _declared(how: ReadOptions) -> Declared:
    z_scale = how.get("z_scale")
    if z_scale is not None and not (np.isfinite(z_scale) and z_scale > 0):
        raise ParameterError(f"The height scale must be greater than 0, got {z_scale}.", where="z_scale")
    return Declared(
        how.get("crs"),
        z_scale,
        how.get("vertical_datum"),
        how.get("limits") or RasterLimits(),
        how.get("virtual", False),
    )


def _read(path: str | os.PathLike[str], how: ReadOptions) -> tuple[Dsm, ReadReport]:
    source = Path(path)
    progress = watched(how.get("progress"), where=source.name)
    read = read_surface(source, _declared(how), all_of, first=None, progress=progress)
    assert read.stored is not None
    return assemble(read.stored, read.plan, read.stats, sha256=read.sha256, where=source.name, progress=progress)
