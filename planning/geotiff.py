"""Reads surface models and orthomosaics from GeoTIFF or ESRI ASCII files, and writes surface models.

Decoding happens in a confined child process (``planning.rasters``); what comes back are numbers.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np
from pyproj import CRS
from pyproj.crs import CompoundCRS
from pyproj.exceptions import CRSError

from planning.dsm import Dsm
from planning.errors import ParameterError, RasterError
from planning.orthophoto import Orthophoto, OrthophotoPlan, drape, plan_orthophoto
from planning.rasters import georef, sandbox
from planning.rasters.assemble import ReadReport, assemble
from planning.rasters.header import RasterHeader, check_georeference, check_size
from planning.rasters.heights import HeightStats
from planning.rasters.limits import RasterLimits
from planning.rasters.magic import driver_of
from planning.rasters.surface_plan import SurfacePlan, plan_surface
from planning.spikes import find_spikes
from planning.spikes import remove_spikes as without_spikes

__all__ = [
    "RasterLimits",
    "ReadReport",
    "read_dsm",
    "read_dsm_reported",
    "read_orthophoto",
    "write_dsm",
]

Progress = Callable[[str, float], None]
"""Called with a stage ("decode", "resample", "spikes") and the share of it that is done."""


def read_dsm(
    path: str | os.PathLike[str],
    *,
    crs: str | None = None,
    z_scale: float | None = None,
    vertical_datum: str | None = None,
    limits: RasterLimits | None = None,
    remove_spikes: bool = False,
    progress: Progress | None = None,
) -> Dsm:
    """A surface model in metres from a GeoTIFF or ESRI ASCII grid; see ``read_dsm_reported``."""
    dsm, _ = _read(path, crs, z_scale, vertical_datum, limits or RasterLimits(), progress)
    return without_spikes(dsm, find_spikes(dsm)) if remove_spikes else dsm


def read_dsm_reported(
    path: str | os.PathLike[str],
    *,
    crs: str | None = None,
    z_scale: float | None = None,
    vertical_datum: str | None = None,
    limits: RasterLimits | None = None,
    remove_spikes: bool = False,
    progress: Progress | None = None,
) -> tuple[Dsm, ReadReport]:
    """A surface model in metres, and what was found and done.

    ``crs`` and ``vertical_datum`` declare or override what the file says; ``z_scale`` is metres per
    stored unit (0.01 for centimetres). Projected metres stay as they are, feet become metres in their
    places. Degrees and grids whose metres are not true go to the local UTM zone, rotated or oblong cells become
    squares, no height is lost on the way (``planning.cells.squares``); the file's own cells stay with the model
    for whatever must be exact (``Dsm.cells``). ``progress`` may raise to cancel.
    Raises a RasterError that says what to do.
    """
    dsm, report = _read(path, crs, z_scale, vertical_datum, limits or RasterLimits(), progress)
    spikes = find_spikes(dsm, progress=(lambda share: progress("spikes", share)) if progress else None)
    if remove_spikes:
        dsm = without_spikes(dsm, spikes)
    return dsm, replace(report, spikes=spikes, spikes_removed=remove_spikes and bool(spikes))


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
        check_size(header, limits, where=source.name)
        check_georeference(header, where=source.name)
        reference = georef.interpret(header, crs=declared_crs, vertical_datum=None, where=source.name)
        plans.append(plan_orthophoto(header, reference.horizontal, bounds_m, crs, max_px=max_px, where=source.name))
        return plans[0].order()

    with sandbox.private_directory() as directory:
        job = _job("read_picture", source, directory)
        sandbox.run_job(job, directory=directory, limits=limits, where=source.name, on_header=order, progress=progress)
        rgba = np.fromfile(job["target"], dtype=np.uint8).reshape(*plans[0].out_shape, 4)
    return drape(rgba, plans[0])


def write_dsm(path: str | os.PathLike[str], dsm: Dsm) -> None:
    """A tiled, compressed GeoTIFF from which ``read_dsm`` gets grid, reference system and datum back."""
    target = Path(path)
    with sandbox.private_directory() as directory:
        heights, written = directory / token_hex(8), target.parent / f".{token_hex(8)}.tif"
        job = {
            "job": "write_grid",
            "source": str(heights),
            "target": str(written.absolute()),
            "shape": dsm.elevation_m.shape,
            "transform": tuple(dsm.transform)[:6],
            "crs_wkt": _compound(dsm.crs, dsm.vertical_datum).to_wkt(),
            "vertical_datum": dsm.vertical_datum,
        }
        try:
            np.ascontiguousarray(dsm.elevation_m).tofile(heights)
            sandbox.run_job(job, directory=directory, limits=_write_limits(dsm), where=target.name)
            written.replace(target)
        except OSError as error:
            raise RasterError(f"The surface model cannot be written: {error.strerror}.", where=str(target)) from error
        finally:
            written.unlink(missing_ok=True)


def _read(
    path: str | os.PathLike[str],
    crs: str | None,
    z_scale: float | None,
    vertical_datum: str | None,
    limits: RasterLimits,
    progress: Progress | None,
) -> tuple[Dsm, ReadReport]:
    if z_scale is not None and not (np.isfinite(z_scale) and z_scale > 0):
        raise ParameterError(f"The height scale must be greater than 0, got {z_scale}.", where="z_scale")
    source = Path(path)
    plans: list[SurfacePlan] = []

    def order(fields: dict[str, Any]) -> dict[str, Any]:
        header = RasterHeader.from_json(fields)
        declared = {"crs": crs, "z_scale": z_scale, "vertical_datum": vertical_datum}
        plans.append(plan_surface(header, **declared, limits=limits, where=source.name))
        return {}

    with sandbox.private_directory() as directory:
        job = _job("read_grid", source, directory)
        answer = sandbox.run_job(
            job, directory=directory, limits=limits, where=source.name, on_header=order, progress=progress
        )
        shape = (plans[0].header.height_px, plans[0].header.width_px)
        stored = np.memmap(job["target"], dtype=np.float32, mode="r+", shape=shape)
    # The file's name is gone with the directory; its pages live on while they are mapped.
    stats = HeightStats.from_json(answer["stats"])
    return assemble(np.asarray(stored), plans[0], stats, sha256=answer["sha256"], where=source.name, progress=progress)


def _job(name: str, source: Path, directory: Path) -> dict[str, Any]:
    driver = driver_of(source)
    link = directory / token_hex(8)
    link.symlink_to(source.resolve())
    return {"job": name, "driver": driver, "source": str(link), "target": str(directory / token_hex(8))}


def _compound(crs: CRS, vertical_datum: str | None) -> CRS:
    """The horizontal system with the datum's own system on top, where PROJ knows one of that name."""
    if vertical_datum is None:
        return crs
    try:
        vertical = CRS.from_user_input(vertical_datum)
    except CRSError:
        return crs
    return CompoundCRS(f"{crs.name} + {vertical.name}", [crs, vertical]) if vertical.is_vertical else crs


def _write_limits(dsm: Dsm) -> RasterLimits:
    # The writer maps the heights into its address space.
    default = RasterLimits()
    return replace(
        default, max_memory_bytes=default.max_memory_bytes + dsm.elevation_m.nbytes, header_s=default.decode_s
    )
