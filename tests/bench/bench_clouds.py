"""How fast points become a surface model, beside SciPy's binned maximum over what laspy reads whole, in the same run.

Processor time, so that a busy machine favours neither; a cloud of 5 million points, of which every tenth is a crown's.
"""

from __future__ import annotations

import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from numpy.typing import NDArray
from pyproj import CRS
from scipy.stats import binned_statistic_2d

from mapping.geometry.arrays import F32
from planning.terrain.clouds.read import CloudParams, read_cloud

POINTS, PER_M2, CELL_M = 5_000_000, 16.0, 0.5
CORNER = np.array([500_000.0, 4_170_000.0, 1700.0])

Case = tuple[str, float, float, float, str]
"""name, our seconds, the alternative's seconds, alternative / ours, note"""


def cases() -> list[Case]:
    """The figures of `make bench` for point clouds."""
    with tempfile.TemporaryDirectory() as folder:
        path = _cloud(Path(folder) / "survey.laz")
        ours_s, made = _processor_s(lambda: read_cloud(path, CloudParams(CELL_M)).dsm.elevation_m)
        theirs_s, held = _processor_s(lambda: _by_scipy(path))
    same = _agree(made, held)
    peak_mb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    note = f"{POINTS / ours_s / 1e6:.1f} million points a second, {peak_mb:,.0f} MB, the same cells: {same}"
    name = f"LAZ of {POINTS:,} points to cells of {CELL_M} m, against laspy and SciPy's binned maximum"
    return [(name, ours_s, theirs_s, theirs_s / ours_s, note)]


def main() -> None:
    for name, ours_s, alternative_s, ratio, note in cases():
        print(f"{name}: {ours_s:.2f} s against {alternative_s:.2f} s, {ratio:.1f} times as fast; {note}")


def _cloud(path: Path) -> Path:
    rng = np.random.default_rng(1)
    side_m = (POINTS / PER_M2) ** 0.5
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), CORNER
    header.add_crs(CRS.from_user_input("EPSG:32633+5773"))
    points = laspy.ScaleAwarePointRecord.zeros(POINTS, header=header)
    xy = rng.uniform(0.0, side_m, (POINTS, 2))
    crown = np.sin(xy[:, 0] / 3) * np.sin(xy[:, 1] / 3) > 0.75
    height_m = 5 * np.sin(xy[:, 0] / 40) + np.where(crown, 9.0, 0.0) + rng.normal(0, 0.03, POINTS)
    points.x, points.y, points.z = CORNER[0] + xy[:, 0], CORNER[1] + xy[:, 1], CORNER[2] + height_m
    points.classification = np.where(crown, 5, 2).astype(np.uint8)
    points.gps_time, points.intensity = np.arange(POINTS) * 1e-6, rng.integers(0, 2000, POINTS)
    with laspy.open(path, mode="w", header=header) as file:
        file.write_points(points)
    return path


def _by_scipy(path: Path) -> NDArray[np.float64]:
    cloud = laspy.read(path)
    x, y, z = (np.asarray(axis) for axis in (cloud.x, cloud.y, cloud.z))
    west, north = np.floor(x.min() / CELL_M) * CELL_M, np.ceil(y.max() / CELL_M) * CELL_M
    columns = int((x.max() - west) / CELL_M) + 1
    rows = int((north - y.min()) / CELL_M) + 1
    edges: Any = [np.arange(count + 1) * CELL_M for count in (rows, columns)]
    top, *_ = binned_statistic_2d(north - y, x - west, z, statistic="max", bins=edges)
    return top


def _agree(made: F32, held: NDArray[np.float64]) -> str:
    """Cells of points on a shared edge may differ in rounding."""
    if made.shape != held.shape:
        return "NO"
    both = np.isfinite(made) & np.isfinite(held)
    return "yes" if np.mean(np.abs(made[both] - held[both]) < 1e-3) > 0.999 else "NO"


def _processor_s(run: Callable[[], Any]) -> tuple[float, Any]:
    """Of this process and the child that it started."""
    before_s = _used_s()
    result = run()
    return _used_s() - before_s, result


def _used_s() -> float:
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + children.ru_utime + children.ru_stime


if __name__ == "__main__":
    main()
