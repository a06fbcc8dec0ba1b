"""How fast a flown line is certified: beside a k-d tree, over a file's own cells, and home's ground by itself.

Over a file's own cells it is held against what is less exact: the certificate of the grid of squares that paths are
laid over. Both in processor time, for a busy machine's clock says little; a user waits for that grid in both cases.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
from affine import Affine
from pyproj import CRS
from scipy.spatial import KDTree

from planning.basics.plan_model import FlownLine
from planning.certificate.certificate_model import ClearanceParams
from planning.certificate.clearance import certify
from planning.certificate.home_ground import home_ground
from planning.certificate.ways_home import places_along
from planning.terrain.cells.squares import squares
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm
from tests.planning.geotiff_samples import write_raster

PARAMS = ClearanceParams(3.35, vehicle_radius_m=0.35, position_error_m=2.5, rtl_height_m=60.0)
CROP_M = 15.0
CELL_M = 0.5
GRIDS = {
    "degrees": ("EPSG:4326", Affine(CELL_M / 88_000, 0, 14.99, 0, -CELL_M / 111_000, 37.73)),
    "turned": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(27) @ Affine.scale(CELL_M, -CELL_M)),
    "sheared": ("EPSG:32633", Affine(-CELL_M, 0.2 * CELL_M, 5e5, 0.1 * CELL_M, -1.1 * CELL_M, 4.17e6)),
}
MOST_RATIO = 1.2

Case = tuple[str, float, float, float, str]
"""name, our seconds, the alternative's seconds, alternative / ours, note"""
Result = TypeVar("Result")


def cases() -> list[Case]:
    """The figures of `make bench` for the certificate."""
    return [
        _against_tree("290 x 252 cells of 0.5 m, 100 m in 400 legs", _model(252, 290, 0.5), 100.0, 400),
        _against_tree("1,000 x 1,000 cells of 0.5 m, 400 m in 160 legs", _model(1000, 1000, 0.5), 400.0, 160),
        _against_tree(
            "11,500 x 11,500 cells of 1.26 cm, 500 m in 200 legs", _model(11_500, 11_500, 0.0126), 500.0, 200
        ),
    ]


def main() -> None:
    for cells_across in (1000, 3000):
        for kind, (crs, affine) in GRIDS.items():
            _over_own_cells(kind, cells_across, crs, affine)
    _home_ground()
    for name, ours_s, alternative_s, ratio, note in cases():
        print(f"{name}: {ours_s:.4f} s against {alternative_s:.4f} s, {ratio:.1f} times as fast; {note}")


def _over_own_cells(kind: str, cells_across: int, crs: str, affine: Affine) -> None:
    with tempfile.TemporaryDirectory() as folder:
        heights = _model(cells_across, cells_across, CELL_M).elevation_m
        dsm = read_dsm(write_raster(Path(folder) / "x.tif", heights, crs=crs, transform=affine))
    source, line = dsm.cells, _zigzag(dsm, 400.0, 160)
    grid_s = _least_processor_s(3, lambda: squares(source, dsm.transform, dsm.elevation_m.shape))
    ours_s = _least_processor_s(5, lambda: certify(dsm, line, PARAMS))
    theirs_s = _least_processor_s(5, lambda: certify(dsm.as_grid(), line, PARAMS))
    ratio = (grid_s + ours_s) / (grid_s + theirs_s)
    print(
        f"certify, {kind}, {cells_across:,} x {cells_across:,} own cells: {1000 * ours_s:.0f} ms against"
        f" {1000 * theirs_s:.0f} ms over the grid, which takes {1000 * grid_s:.0f} ms to make; with it"
        f" {ratio:.2f} times the grid's (at most {MOST_RATIO}: {'yes' if ratio <= MOST_RATIO else 'NO'})"
    )


def _home_ground() -> None:
    """A home's ground within 2.85 m, in very fine cells."""
    dsm = _model(1200, 1200, 0.01)
    west, south, east, north = dsm.bounds_m
    middle = (west + east) / 2, (south + north) / 2
    seconds = _least_processor_s(5, lambda: home_ground(dsm, middle, centre_m=2.5, radius_m=0.35))
    print(f"home's ground, 570 x 570 cells of 1 cm: {1000 * seconds:.1f} ms")


def _against_tree(size: str, dsm: Dsm, length_m: float, legs: int) -> Case:
    line = _zigzag(dsm, length_m, legs)
    ours_s, certificate = _best_of(5, lambda: certify(dsm, line, PARAMS))
    stride = max(1, round(0.1 / dsm.resolution_m))  # a tree of 132 million centres does not fit
    theirs_s, theirs_m = _best_of(1, lambda: _tree_distance(dsm, line, stride))
    off_m = theirs_m - certificate.min_distance_m
    note = (
        "ours is the whole certificate (distance, heights, trend, returns), exact; the tree gives the distance only,"
        f" to the centre of every {stride}. cell: {off_m:+.3f} m off"
    )
    return f"certify, {size}, against scipy KDTree", ours_s, theirs_s, theirs_s / ours_s, note


def _tree_distance(dsm: Dsm, line: FlownLine, stride: int) -> float:
    """Smallest distance of places every 0.1 m to the centres of the cells' tops near the line."""
    west, south, east, north = (*line.points_m[:, :2].min(axis=0), *line.points_m[:, :2].max(axis=0))
    (row0, row1), (col0, col1) = dsm.fractional_cell(
        np.array([[west - CROP_M, north + CROP_M], [east + CROP_M, south - CROP_M]])
    )
    rows = np.arange(max(0, int(row0)), min(dsm.height_px, int(row1) + 1), stride)
    cols = np.arange(max(0, int(col0)), min(dsm.width_px, int(col1) + 1), stride)
    x = dsm.transform.c + (cols + 0.5) * dsm.resolution_m
    y = dsm.transform.f - (rows + 0.5) * dsm.resolution_m
    tops = dsm.elevation_m[np.ix_(rows, cols)]
    grid = np.broadcast_arrays(x[None, :], y[:, None], tops)
    tree = KDTree(np.column_stack([part.ravel() for part in grid]))
    distance_m, _ = tree.query(places_along(line.points_m, 0.1)[0])
    return float(np.min(distance_m))


def _model(height_px: int, width_px: int, res_m: float) -> Dsm:
    """Hills with half a metre of roughness."""
    rng = np.random.default_rng(20)
    north_m = np.arange(height_px, dtype=np.float32) * np.float32(res_m)
    east_m = np.arange(width_px, dtype=np.float32) * np.float32(res_m)
    cells = rng.random((height_px, width_px), dtype=np.float32)
    cells *= np.float32(0.5)
    cells += np.float32(5.0) * np.sin(north_m / np.float32(17.0))[:, None]
    cells += np.float32(4.0) * np.cos(east_m / np.float32(23.0))[None, :]
    transform = Affine(res_m, 0.0, 500_000.0, 0.0, -res_m, 4_180_000.0)
    return Dsm(cells, transform, CRS.from_epsg(32633), None, "0" * 64)


def _zigzag(dsm: Dsm, length_m: float, legs: int) -> FlownLine:
    """Back and forth over the model's middle, 6 m above the cells under the waypoints."""
    west, _, east, north = dsm.bounds_m
    span_m = 0.6 * (east - west)
    s_m = np.linspace(0.0, length_m, legs + 1)
    along_m = span_m - np.abs(s_m % (2 * span_m) - span_m)
    x = west + 0.2 * (east - west) + along_m
    y = north - 0.3 * (east - west) - 0.1 * s_m
    xy = np.column_stack([x, y])
    ground_m = dsm.elevation_at(xy)
    points_m = np.column_stack([xy, ground_m + 6.0])
    return FlownLine(points_m, np.arange(legs), (x[0], y[0]), float(ground_m[0]), float(points_m[0, 2]), True)


def _least_processor_s(runs: int, run: Callable[[], object]) -> float:
    run()
    spent_s = []
    for _ in range(runs):
        start_s = time.process_time()
        run()
        spent_s.append(time.process_time() - start_s)
    return min(spent_s)


def _best_of(runs: int, run: Callable[[], Result]) -> tuple[float, Result]:
    """Shortest time of ``runs``, after one run that compiles when there is more than one."""
    result = run()
    best_s = float("inf")
    for _ in range(runs):
        start_s = time.perf_counter()
        result = run()
        best_s = min(best_s, time.perf_counter() - start_s)
    return best_s, result


if __name__ == "__main__":
    main()
