"""Exact smallest and largest height of straight lines above the cells below them.

Rectangles that a line passes are walked row by row, other cells are found in the pyramid; over one cell
the line's height is linear, so its extremes lie at the ends of the interval. Cells are closed: a line that
runs along a border, or touches a corner, is judged against every cell it touches, which can only lower the
smallest height.

Coordinates: the lattice's frame, z up.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64
from planning.certificate.nearest import STACK
from planning.certificate.pyramid import LEAF_PX, MaxPyramid, below, block_box, edge_distance, leaf_end
from planning.certificate.quads import part_inside
from planning.terrain.cells.lattice import block_around, is_rectangular, quad_of


def height_range(pyramid: MaxPyramid, start_m: F64, end_m: F64) -> tuple[F64, F64]:
    """Smallest and largest height above the cells below each segment, (N,) each.

    ``start_m`` and ``end_m`` are (N, 3). The smallest is -inf where the segment passes an unknown cell
    or leaves the model; the largest regards known cells only (-inf where there is none).
    """
    lowest_m, highest_m = np.empty(len(start_m)), np.empty(len(start_m))
    start, end = (np.ascontiguousarray(points, dtype=np.float64) for points in (start_m, end_m))
    cells, lattice = pyramid.elevation_m, pyramid.lattice
    if is_rectangular(lattice):
        _ranges(cells, lattice.width_m, lattice.height_m, start, end, lowest_m, highest_m)
    else:
        _ranges_over_quads(cells, pyramid.layout, lattice, pyramid.boxes_m, start, end, lowest_m, highest_m)
    return lowest_m, highest_m


@njit(cache=True, nogil=True)
def _inside(a, d, low, high, t0, t1):
    """The part of [t0, t1] in which a + t d lies in [low, high]; empty when the first exceeds the second."""
    if d == 0.0:
        return (t0, t1) if low <= a <= high else (1.0, 0.0)
    enter, leave = (low - a) / d, (high - a) / d
    if enter > leave:
        enter, leave = leave, enter
    return max(t0, enter), min(t1, leave)


@njit(cache=True, nogil=True)
def _touched(low_m, high_m, res):
    """First and last index of the cells whose closed interval meets [low_m, high_m]."""
    return int(np.ceil(low_m / res)) - 1, int(np.floor(high_m / res))


@njit(cache=True, nogil=True)
def _over_cell(ground_m, z0, z1, lowest, highest):
    """The range, widened by the heights above one cell that is entered at z0 and left at z1."""
    ground = np.float64(ground_m)
    if not np.isfinite(ground):
        return -np.inf, highest
    return min(lowest, min(z0, z1) - ground), max(highest, max(z0, z1) - ground)


@njit(cache=True, nogil=True)
def _range_in_row(elevation_m, wide, row, ax, az, dx, dz, t0, t1, lowest, highest):
    xa, xb = ax + t0 * dx, ax + t1 * dx
    first, last = _touched(min(xa, xb), max(xa, xb), wide)
    for col in range(first, last + 1):
        u0, u1 = _inside(ax, dx, col * wide, (col + 1) * wide, t0, t1)
        if u0 > u1:
            continue
        if not (0 <= row < elevation_m.shape[0] and 0 <= col < elevation_m.shape[1]):
            return -np.inf, highest
        lowest, highest = _over_cell(elevation_m[row, col], az + u0 * dz, az + u1 * dz, lowest, highest)
    return lowest, highest


@njit(cache=True, nogil=True)
def _ranges(elevation_m, wide, high, start_m, end_m, lowest_m, highest_m):
    for k in range(start_m.shape[0]):
        ax, ay, az = start_m[k, 0], start_m[k, 1], start_m[k, 2]
        dx, dy, dz = end_m[k, 0] - ax, end_m[k, 1] - ay, end_m[k, 2] - az
        first, last = _touched(min(ay, ay + dy), max(ay, ay + dy), high)
        outside = first < 0 or last >= elevation_m.shape[0]
        lowest, highest = (-np.inf if outside else np.inf), -np.inf
        for row in range(max(first, 0), min(last, elevation_m.shape[0] - 1) + 1):
            t0, t1 = _inside(ay, dy, row * high, (row + 1) * high, 0.0, 1.0)
            if t0 <= t1:
                lowest, highest = _range_in_row(elevation_m, wide, row, ax, az, dx, dz, t0, t1, lowest, highest)
        lowest_m[k] = lowest
        highest_m[k] = highest


@njit(cache=True, nogil=True)
def _meets(box, ax, ay, dx, dy):
    """Whether the line, in plan, meets the rectangle."""
    t0, t1 = _inside(ax, dx, box[0], box[2], 0.0, 1.0)
    t0, t1 = _inside(ay, dy, box[1], box[3], t0, t1)
    return t0 <= t1


@njit(cache=True, nogil=True)
def _range_in_leaf(elevation_m, row0, col0, lattice, ax, ay, az, dx, dy, dz, lowest, highest):
    stop_row, stop_column, bend = leaf_end(elevation_m, lattice, row0, col0)
    for r in range(row0, stop_row):
        for c in range(col0, stop_column):
            if not _meets(block_around(lattice, bend, r, c, r + 1, c + 1), ax, ay, dx, dy):
                continue
            t0, t1 = part_inside(quad_of(lattice, r, c), ax, ay, dx, dy)
            if t0 <= t1:
                lowest, highest = _over_cell(elevation_m[r, c], az + t0 * dz, az + t1 * dz, lowest, highest)
    return lowest, highest


@njit(cache=True, nogil=True)
def _ranges_over_quads(elevation_m, layout, lattice, boxes_m, start_m, end_m, lowest_m, highest_m):
    node = np.empty((STACK, 3), np.int64)
    height_px, width_px = elevation_m.shape
    for k in range(start_m.shape[0]):
        ax, ay, az = start_m[k, 0], start_m[k, 1], start_m[k, 2]
        dx, dy, dz = end_m[k, 0] - ax, end_m[k, 1] - ay, end_m[k, 2] - az
        # The ring of unknown cells is passed by every line that leaves the model and was inside.
        outside = min(
            edge_distance(lattice, height_px, width_px, ax, ay),
            edge_distance(lattice, height_px, width_px, ax + dx, ay + dy),
        )
        lowest, highest = (np.inf if outside > 0.0 else -np.inf), -np.inf
        node[0, 0], node[0, 1], node[0, 2] = layout.shape[0] - 1, 0, 0
        size = 1
        while size > 0:
            size -= 1
            level, i, j = node[size, 0], node[size, 1], node[size, 2]
            offset, cols = layout[level, 0], layout[level, 2]
            if not _meets(block_box(lattice, boxes_m, offset, cols, level, i, j), ax, ay, dx, dy):
                continue
            if level == 0:
                lowest, highest = _range_in_leaf(
                    elevation_m, i * LEAF_PX, j * LEAF_PX, lattice, ax, ay, az, dx, dy, dz, lowest, highest
                )
                continue
            _, _, child_rows, child_cols = below(layout, level, i, j)
            for ci in child_rows:
                for cj in child_cols:
                    node[size, 0], node[size, 1], node[size, 2] = level - 1, ci, cj
                    size += 1
        lowest_m[k] = lowest
        highest_m[k] = highest
