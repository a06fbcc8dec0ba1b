"""``hedgehop cloud``: a point cloud becomes a surface model to plan on."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from typer import Argument, Option

from planning.errors import RasterFormatError
from planning.terrain.clouds.read import CloudModel, CloudParams, read_cloud
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import write_dsm
from planning.terrain.spikes import find_spikes, remove_spikes
from server.cli.shared import options as o
from server.cli.shared.command import Without, command
from server.cli.shared.files_in_out import check_directory
from server.cli.shared.output import answer, end_progress, progress, say_notes

_STEPS = {"bounds": "Looking for the bounds", "sort": "Sorting the points"}


@command
def cloud(
    file: Annotated[Path, Argument(metavar="CLOUD", help="Point cloud: LAS, LAZ, COPC, PLY, PCD or E57.")],
    *,
    out: Annotated[Path, Option(metavar="FILE", help="The surface model: .tif. The ground goes to -ground.tif.")],
    cell_m: Annotated[
        float | None, Option("--cell-m", "--cell", metavar="M", help="Edge of a cell; default: of the density.")
    ] = None,
    keep_noise: Annotated[bool, Option("--keep-noise", help="Points that the file calls noise count as well.")] = False,
    how: Annotated[o.ModelOptions, Without("max_hole_m2")],
    as_json: o.AsJson = False,
) -> None:
    """Make a surface model of a point cloud: the highest point of each cell, vegetation and all.

    Cells without a point stay unknown. Where points are classified, the ground alone goes to a second file.
    """
    if out.suffix.lower() not in (".tif", ".tiff"):
        raise RasterFormatError("Surface models are GeoTIFFs.", where=out.name, advice="Give --out a name with .tif.")
    check_directory(out.parent)
    began_s = time.monotonic()
    params = CloudParams(cell_m, how.crs, how.vertical_datum, how.z_scale, keep_noise)
    made = read_cloud(file, params, progress=lambda stage, share: progress(_STEPS.get(stage, stage), share))
    progress("Looking for spikes", None)
    dsm, spikes = made.dsm, find_spikes(made.dsm)
    if how.remove_spikes:
        dsm = remove_spikes(dsm, spikes)
    files = _written(out, dsm, made.ground)
    end_progress()
    fate = "removed" if how.remove_spikes else "kept, unless you --remove-spikes"
    say_notes(*made.notes, f"{len(spikes)} isolated spikes and pits were {fate}." if spikes else None)
    summary = {
        "files": [str(path) for path in files],
        **_summary(made, dsm),
        "spikes": len(spikes),
        "spikes_removed": how.remove_spikes,
        "seconds": round(time.monotonic() - began_s, 3),
    }
    answer(summary, _lines(files, summary), as_json=as_json)


def _written(out: Path, dsm: Dsm, ground: Dsm | None) -> list[Path]:
    write_dsm(out, dsm)
    if ground is None:
        return [out]
    beside = out.with_stem(f"{out.stem}-ground")
    write_dsm(beside, ground)
    return [out, beside]


def _summary(made: CloudModel, dsm: Dsm) -> dict[str, Any]:
    unknown = int(np.isnan(dsm.elevation_m).sum())
    return {
        "points": made.points,
        "taken": made.taken,
        "ground_points": made.ground_points,
        "noise": made.noise,
        "not_numbers": made.not_numbers,
        "cell_m": dsm.resolution_m,
        "rows": dsm.height_px,
        "columns": dsm.width_px,
        "unknown_share": unknown / dsm.elevation_m.size,
        "crs": dsm.crs.name,
        "vertical_datum": dsm.vertical_datum,
    }


def _lines(files: list[Path], summary: dict[str, Any]) -> list[str]:
    names = [path.name for path in files]
    return [
        f"{names[0]}: {summary['columns']} x {summary['rows']} cells of {summary['cell_m']:g} m, "
        f"{summary['unknown_share']:.1%} unknown",
        f"  of {summary['taken']:,} of {summary['points']:,} points; {summary['crs']}; "
        f"vertical datum: {summary['vertical_datum'] or 'nobody said'}",
        *(f"{name}: the ground alone, of {summary['ground_points']:,} points" for name in names[1:]),
    ]
