"""What the child process does with a point cloud: its header, its bounds, and the highest point of each cell."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from mapping.geometry.arrays import F32
from planning.errors import NoElevationError, RasterError, RasterFormatError
from planning.terrain.clouds.cloud import Box, Chunk, Cloud
from planning.terrain.clouds.cloud_header import CloudHeader
from planning.terrain.clouds.cloud_tables import pcd_table, ply_table
from planning.terrain.clouds.grid import CloudGrid, Sorter, cell_for, grid_for
from planning.terrain.clouds.thin import Thinner

Json = dict[str, Any]
Send = Callable[..., None]
Ask = Callable[[Json], Json]
_MOST_THINNED = 50_000_000
"""Points among which those that are shown are chosen: choosing costs 0.6 s for each million, reading less."""


def read_cloud(job: Json, send: Send, ask: Ask) -> None:
    """Heights as raw float32 rows in ``job["target"]`` and, of ground points alone, in ``job["ground"]``; NaN unknown.

    Thinned points as raw float64 rows in ``job["points"]``, their colours as bytes in ``job["colors"]``. What is asked
    for: "cell_m" or null, metres of the file's units "xy_m" and "z_m", "max_px", "keep_noise", and "most_points" of
    the thinned cloud, 0 for none.
    """
    try:
        cloud = _opened(Path(job["source"]), job["format"])
        order = ask(_header(cloud).as_json())
        if cloud.rows == 0:
            raise NoElevationError("It has no points.", advice="Export it again.")
        sorter, thinner = _sorted(cloud, job, order, send)
    except RasterError as error:
        send("error", kind=_kind(error), what=error.what, advice=error.advice)
        return
    grid = sorter.grid
    send(
        "done", west_m=grid.west_m, north_m=grid.north_m, cell_m=grid.cell_m, shape=grid.shape, taken=sorter.taken,
        ground=sorter.ground, noise=sorter.noise, not_numbers=sorter.not_numbers, step_m=_step_m(cloud, grid),
        classes=sorter.classes.tolist(), every=_every(cloud), **_thinned(thinner, job, send),
    )  # fmt: skip


JOBS: dict[str, Callable[[Json, Send, Ask], None]] = {"read_cloud": read_cloud}


def _opened(path: Path, kind: str) -> Cloud:
    # Each format's library is loaded for its own files alone.
    if kind == "las":
        from planning.terrain.clouds.las import open_las

        return open_las(path)
    if kind == "e57":
        from planning.terrain.clouds.e57 import open_e57

        return open_e57(path)
    return ply_table(path) if kind == "ply" else pcd_table(path)


def _header(cloud: Cloud) -> CloudHeader:
    return CloudHeader(cloud.rows, cloud.crs_wkt, cloud.unit, None, classified=cloud.classified, notes=cloud.notes)


def _sorted(cloud: Cloud, job: Json, order: Json, send: Send) -> tuple[Sorter, Thinner | None]:
    bounds = _bounds(cloud, order, send)
    grid = grid_for(bounds, order["cell_m"] or cell_for(bounds, cloud.rows), max_px=order["max_px"])
    heights = _empty(job["target"], grid)
    sorter = Sorter(grid, heights, _empty(job["ground"], grid) if cloud.classified else None, order["keep_noise"])
    every, done = _every(cloud), 0
    most = order["most_points"]
    thinner = Thinner.over(bounds, cloud.rows // every, most=most) if most else None
    for xyz_m, classes, rgb in _in_metres(cloud, order, colors=thinner is not None):
        taken = sorter.add(xyz_m, classes)
        if thinner is not None:
            thinner.add(xyz_m[taken][::every], None if rgb is None else rgb[taken][::every])
        done += len(xyz_m)
        send("progress", stage="sort", share=done / cloud.rows)
    if sorter.outside:
        raise RasterFormatError(
            f"{sorter.outside:,} of its points lie outside of the bounds that its header gives.",
            advice="Have the header put right (lasinfo -repair, pdal translate), or export it again.",
        )
    if sorter.taken == 0:
        raise NoElevationError("It has no point with a place and a height.", advice="Export it again.")
    for grown in (sorter.highest_m, sorter.ground_m):
        if grown is not None:
            grown[np.isneginf(grown)] = np.nan
            grown.flush()  # pyright: ignore[reportAttributeAccessIssue]
    return sorter, thinner


def _every(cloud: Cloud) -> int:
    """Which of the points are looked at for those that are shown: each, or each second ..."""
    return -(-cloud.rows // _MOST_THINNED) or 1


def _thinned(thinner: Thinner | None, job: Json, send: Send) -> Json:
    if thinner is None:
        return {"shown": 0, "colored": False, "voxel_m": 0.0}
    send("progress", stage="thin", share=0.0)
    found = thinner.thinned()
    found.xyz_m.tofile(job["points"])
    if found.rgb is not None:
        found.rgb.tofile(job["colors"])
    return {"shown": len(found.xyz_m), "colored": found.rgb is not None, "voxel_m": found.voxel_m}


def _bounds(cloud: Cloud, order: Json, send: Send) -> Box:
    """In metres, as the header gives them; of files that give none, looked for."""
    if cloud.bounds is not None:
        west, south, east, north = (value * order["xy_m"] for value in cloud.bounds)
        return west, south, east, north
    least, most, done = np.full(2, np.inf), np.full(2, -np.inf), 0
    for xyz_m, _, _ in _in_metres(cloud, order, colors=False):
        xy_m = xyz_m[np.isfinite(xyz_m).all(axis=1), :2]
        if len(xy_m):
            least, most = np.minimum(least, xy_m.min(axis=0)), np.maximum(most, xy_m.max(axis=0))
        done += len(xyz_m)
        send("progress", stage="bounds", share=done / cloud.rows)
    if not np.isfinite(least).all():
        raise NoElevationError("It has no point with a place and a height.", advice="Export it again.")
    return float(least[0]), float(least[1]), float(most[0]), float(most[1])


def _in_metres(cloud: Cloud, order: Json, *, colors: bool) -> Iterator[Chunk]:
    factors = np.array([order["xy_m"], order["xy_m"], order["z_m"]])
    for xyz, classes, rgb in cloud.chunks(colors=colors):
        yield xyz * factors, classes, rgb


def _empty(path: str, grid: CloudGrid) -> F32:
    cells = np.memmap(path, dtype=np.float32, mode="w+", shape=grid.shape)
    cells[:] = -np.inf
    return cells


def _step_m(cloud: Cloud, grid: CloudGrid) -> float:
    """How far apart neighbouring coordinates lie where 32 bits keep them; 0 where they are kept finely."""
    if not cloud.coarse:
        return 0.0
    return float(np.spacing(np.float32(max(abs(grid.west_m), abs(grid.north_m)))))


def _kind(error: RasterError) -> str:
    return {"raster_too_large": "too_large", "raster_no_elevation": "no_elevation"}.get(error.code, "format")
