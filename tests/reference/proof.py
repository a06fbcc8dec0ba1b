"""The clearance of a mission file over a raster file, slowly: with rasterio, pyproj and every cell near the line.

Shares no code with the product: it reads both files itself, places every cell's four corners with PROJ, fills
small holes with its own labels, and finds each distance to a column by ternary search (it is convex along a leg).
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rasterio
from numba import njit, prange
from pyproj import CRS, Geod, Transformer
from scipy import ndimage

from mapping.geometry.arrays import F64

TAKEOFF, WAYPOINT = 22, 16
SMALL_HOLE_M2 = 4.0


@dataclass(frozen=True)
class Ground:
    """A raster's cells in metres: tops (H, W), +inf where unknown, and corners (H + 1, W + 1, 2)."""

    top_m: F64
    corners_m: F64
    to_metres: Transformer
    metres_wkt: str
    unit_m: float
    to_pixel: rasterio.Affine
    to_source: Transformer
    turns: bool


def read_ground(path: Path, *, crs: str | None = None, height_scale: float = 1.0) -> Ground:
    """The file with its small holes filled and two rings of unknown cells around it."""
    with rasterio.open(path) as file:
        band = file.read(1, masked=True)
        affine, source = file.transform, CRS.from_user_input(crs or file.crs)
    height_m = np.where(np.ma.getmaskarray(band), np.nan, band.data.astype(np.float32)).astype(np.float32)
    height_m = (height_m * np.float32(height_scale)).astype(np.float64)
    horizontal = source.sub_crs_list[0] if source.is_compound else source.to_2d()
    rows, columns = height_m.shape
    metres, map_unit_m = _metres(horizontal, affine @ (columns / 2, rows / 2))
    there = Transformer.from_crs(horizontal, metres, always_xy=True)
    unit_m = _true_length(metres, there.transform(*affine @ (columns / 2, rows / 2)), map_unit_m)
    c, r = np.meshgrid(np.arange(-2.0, columns + 3), np.arange(-2.0, rows + 3))
    x, y = affine.a * c + affine.b * r + affine.c, affine.d * c + affine.e * r + affine.f
    if metres != horizontal:
        x, y = there.transform(x, y)
    on_map = np.stack([x, y], axis=2) * map_unit_m
    corners, cell_m2 = on_map * (unit_m / map_unit_m), _cell_area(on_map)  # holes are measured on the map
    top = np.full((rows + 4, columns + 4), np.inf)
    top[2:-2, 2:-2] = _filled(height_m, cell_m2)
    to_metres = Transformer.from_crs(CRS.from_epsg(4326), metres, always_xy=True)
    to_source = Transformer.from_crs(CRS.from_epsg(4326), horizontal, always_xy=True)
    return Ground(top, corners, to_metres, metres.to_wkt(), unit_m, ~affine, to_source, horizontal.is_geographic)


def mission_line(text: str, ground: Ground) -> F64:
    """(K, 3) the line of a QGC WPL 110 file from the top of the take-off on, metres and the raster's heights."""
    rows = [line.split("\t") for line in text.splitlines()[1:] if line and not line.startswith("#")]
    home = rows[0]
    home_alt = float(ground.top_m[_cell_of(ground, float(home[8]), float(home[9]))])
    points: list[tuple[float, float, float]] = []
    for row in rows[1:]:
        command, frame = int(row[3]), int(row[2])
        if command not in (TAKEOFF, WAYPOINT):
            continue
        if frame != 3:
            raise ValueError(f"A proof is for heights above home, not for frame {frame}.")
        lat, lon = (float(home[8]), float(home[9])) if command == TAKEOFF else (float(row[8]), float(row[9]))
        x, y = ground.to_metres.transform(lon, lat)
        # ArduPilot keeps whole centimetres: its float times 100, cut off.
        above_m = int(np.float32(row[10]) * np.float32(100)) / 100
        points.append((x * ground.unit_m, y * ground.unit_m, home_alt + above_m))
    return np.array(points)


def clearance(ground: Ground, line_m: F64, reach_m: float = 30.0) -> float:
    """Smallest distance of the line to any column within ``reach_m`` of it; unknown cells reach up forever."""
    least = np.inf
    for start, end in itertools.pairwise(line_m):
        low, high = np.minimum(start, end)[:2] - reach_m, np.maximum(start, end)[:2] + reach_m
        near = ((ground.corners_m >= low) & (ground.corners_m <= high)).all(axis=2)
        row, column = np.nonzero(near)
        if row.size == 0:
            return 0.0
        r0, r1 = max(0, row.min() - 1), min(ground.top_m.shape[0], row.max() + 1)
        c0, c1 = max(0, column.min() - 1), min(ground.top_m.shape[1], column.max() + 1)
        tops, corners = ground.top_m[r0:r1, c0:c1], ground.corners_m[r0 : r1 + 1, c0 : c1 + 1]
        least = min(least, _leg_distance(np.ascontiguousarray(tops), np.ascontiguousarray(corners), start, end, least))
    return float(least)


def _metres(horizontal: CRS, centre: tuple[float, float]) -> tuple[CRS, float]:
    """The system that distances are measured in, and metres in its unit."""
    to_degrees = Transformer.from_crs(horizontal, CRS.from_epsg(4326), always_xy=True)
    lon, lat = to_degrees.transform(*centre)
    if horizontal.is_projected:
        unit_m = float(horizontal.axis_info[0].unit_conversion_factor)
        beside = to_degrees.transform(centre[0] + 10.0 / unit_m, centre[1])
        if abs(Geod(ellps="WGS84").inv(lon, lat, *beside)[2] / 10.0 - 1.0) < 0.02:
            return horizontal, unit_m
    zone = int((lon + 180) // 6) % 60 + 1
    return CRS.from_epsg((32600 if lat >= 0 else 32700) + zone), 1.0


def _true_length(metres: CRS, centre: tuple[float, float], unit_m: float) -> float:
    """Of its unit on the ground, by the geodesic between two places: no map projection is true everywhere."""
    to_degrees = Transformer.from_crs(metres, CRS.from_epsg(4326), always_xy=True)
    half = 50.0 / unit_m
    ends = [to_degrees.transform(centre[0] + side, centre[1]) for side in (-half, half)]
    return float(Geod(ellps="WGS84").inv(*ends[0], *ends[1])[2]) / (2 * half)


def _cell_area(corners: F64) -> float:
    middle = corners[corners.shape[0] // 2, corners.shape[1] // 2]
    right = corners[corners.shape[0] // 2, corners.shape[1] // 2 + 1] - middle
    down = corners[corners.shape[0] // 2 + 1, corners.shape[1] // 2] - middle
    return float(abs(right[0] * down[1] - right[1] * down[0]))


def _filled(height_m: F64, cell_m2: float) -> F64:
    unknown = ~np.isfinite(height_m)
    labels, _ = ndimage.label(unknown, structure=np.ones((3, 3)))  # pyright: ignore[reportGeneralTypeIssues]
    out = np.where(unknown, np.inf, height_m)
    for number, window in enumerate(ndimage.find_objects(labels), start=1):
        rows, columns = window
        whole = labels[rows, columns] == number
        touches = rows.start == 0 or columns.start == 0
        touches = touches or rows.stop == height_m.shape[0] or columns.stop == height_m.shape[1]
        if touches or not whole.sum() * cell_m2 < SMALL_HOLE_M2:
            continue
        grown = (slice(rows.start - 1, rows.stop + 1), slice(columns.start - 1, columns.stop + 1))
        hole = labels[grown] == number
        rim = ndimage.binary_dilation(hole, structure=np.ones((3, 3))) & ~unknown[grown]
        out[grown][hole] = height_m[grown][rim].max()
    return out


def _cell_of(ground: Ground, lat: float, lon: float) -> tuple[int, int]:
    x, y = ground.to_source.transform(lon, lat)
    if ground.turns:  # a grid across the date line counts on beyond 180
        x += 360.0 * round(((~ground.to_pixel).c - x) / 360.0)
    column, row = ground.to_pixel @ (x, y)
    return math.floor(row) + 2, math.floor(column) + 2


@njit(cache=True, nogil=True)
def _column_sq(px, py, pz, quad, top):
    """Squared distance of a point to the column over a convex quadrilateral (4, 2)."""
    least, left, right = np.inf, 0, 0
    for k in range(4):
        ax, ay = quad[k, 0], quad[k, 1]
        ex, ey = quad[(k + 1) % 4, 0] - ax, quad[(k + 1) % 4, 1] - ay
        cross = ex * (py - ay) - ey * (px - ax)
        left += cross >= 0.0
        right += cross <= 0.0
        share = ((px - ax) * ex + (py - ay) * ey) / (ex * ex + ey * ey)
        share = min(max(share, 0.0), 1.0)
        least = min(least, (px - ax - share * ex) ** 2 + (py - ay - share * ey) ** 2)
    if left == 4 or right == 4:
        least = 0.0
    above = max(0.0, pz - top)
    return least + above * above


@njit(cache=True, nogil=True)
def least_sq(start, end, quad, top):
    """Ternary search: the squared distance to a convex set is convex along a line."""
    low, high = 0.0, 1.0
    for _ in range(70):
        t, u = low + (high - low) / 3.0, high - (high - low) / 3.0
        p, q = start + t * (end - start), start + u * (end - start)
        if _column_sq(p[0], p[1], p[2], quad, top) < _column_sq(q[0], q[1], q[2], quad, top):
            high = u
        else:
            low = t
    p = start + 0.5 * (low + high) * (end - start)
    return _column_sq(p[0], p[1], p[2], quad, top)


@njit(cache=True, nogil=True, parallel=True)
def _leg_distance(tops, corners, start, end, known_least):
    rows, columns = tops.shape
    least = np.full(rows, known_least)
    lowest = min(start[2], end[2])
    d = end - start
    length_sq = max(d[0] * d[0] + d[1] * d[1], 1e-30)
    for r in prange(rows):
        quad = np.empty((4, 2))
        for c in range(columns):
            top = tops[r, c]
            if lowest - top >= least[r]:
                continue  # nowhere over it is the leg nearer than that
            quad[0], quad[1], quad[2], quad[3] = (
                corners[r, c],
                corners[r, c + 1],
                corners[r + 1, c + 1],
                corners[r + 1, c],
            )
            x, y = quad[:, 0].mean(), quad[:, 1].mean()
            wide = max((quad[0, 0] - x) ** 2 + (quad[0, 1] - y) ** 2, (quad[1, 0] - x) ** 2 + (quad[1, 1] - y) ** 2)
            share = min(max(((x - start[0]) * d[0] + (y - start[1]) * d[1]) / length_sq, 0.0), 1.0)
            away = math.hypot(x - start[0] - share * d[0], y - start[1] - share * d[1]) - 1.5 * math.sqrt(wide)
            if away >= least[r]:
                continue  # its middle is farther than that, and more than its own size
            least[r] = min(least[r], math.sqrt(least_sq(start, end, quad, top)))
    return least.min()
