"""Exact 3-D distance from straight lines to a surface model whose cells are solid columns.

Where cells are rectangles the columns are closed boxes [x0, x1] x [y0, y1] x (-inf, elevation]. The squared
distance of the moving point a + t d to one of them is convex in t, once differentiable and quadratic between
the values of t where a coordinate passes a face, so its minimum over a segment has a closed form; other
quadrilaterals: ``planning.certificate.quads``. A block of cells lies inside the column over the box around
it with the largest of its elevations, whose distance therefore bounds theirs from below: branch and bound
over a pyramid of maxima skips blocks and loses nothing.

Coordinates: the lattice's frame (of squares: metres from the model's north-west corner, x to the east, y to
the SOUTH), z up.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numba import get_num_threads, njit, prange, set_num_threads

from mapping.geometry.arrays import F64
from planning.certificate.pyramid import LEAF_PX, MaxPyramid, below, block_box, column_top, edge_distance, leaf_end
from planning.certificate.quads import quad_distance_sq, zero_between
from planning.terrain.cells.lattice import block_around, is_rectangular, quad_of

STACK = 256
"""Four children for each of up to 60 levels: more than any model needs."""


def nearest_distances(pyramid: MaxPyramid, start_m: F64, end_m: F64) -> tuple[F64, F64]:
    """Smallest distance of each segment to the model and where it occurs.

    ``start_m`` and ``end_m`` are (N, 3); equal ends ask for the distance of a point. Unknown cells and
    everything outside the model are columns of infinite height. Returns (N,) metres, 0 inside a column,
    and (N,) the place as a share of the segment.
    """
    distance_m, share = np.empty(len(start_m)), np.empty(len(start_m))
    _nearest_all(
        pyramid.elevation_m,
        pyramid.maxima_m,
        pyramid.layout,
        pyramid.lattice,
        pyramid.boxes_m,
        np.ascontiguousarray(start_m, dtype=np.float64),
        np.ascontiguousarray(end_m, dtype=np.float64),
        distance_m,
        share,
    )
    return distance_m, share


SMALL_MODEL_PX = 500_000
"""On a busy machine, waking and awaiting a second thread costs more than it brings for fewer cells."""


@contextmanager
def threads_for(cells: int) -> Iterator[None]:
    """Run the parallel kernels on one thread when the model has few cells; only this thread's setting changes."""
    before = get_num_threads()
    set_num_threads(1 if cells < SMALL_MODEL_PX else before)
    try:
        yield
    finally:
        set_num_threads(before)


@njit(cache=True, inline="always")
def _beyond(value, low, high):
    """How far ``value`` lies outside [low, high], with sign."""
    if value < low:
        return value - low
    if value > high:
        return value - high
    return 0.0


@njit(cache=True, nogil=True)
def _half_slope(t, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top):
    """Half the derivative of the squared distance by t."""
    slope = dx * _beyond(ax + t * dx, x0, x1) + dy * _beyond(ay + t * dy, y0, y1)
    above = az + t * dz - top
    return slope + dz * above if above > 0.0 else slope


@njit(cache=True, nogil=True)
def _narrowed(low, high, face, a, d, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top):
    """The part of [low, high] on the minimum's side of the t at which a coordinate passes a face."""
    if d == 0.0:
        return low, high
    t = (face - a) / d
    if low < t < high:
        if _half_slope(t, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top) > 0.0:
            return low, t
        return t, high
    return low, high


@njit(cache=True, nogil=True)
def column_distance_sq(ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top):
    """(smallest squared distance, t) of a + t d, t in [0, 1], to one column; ``top`` may be +inf."""
    low, high = 0.0, 1.0
    low, high = _narrowed(low, high, x0, ax, dx, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    low, high = _narrowed(low, high, x1, ax, dx, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    low, high = _narrowed(low, high, y0, ay, dy, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    low, high = _narrowed(low, high, y1, ay, dy, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    low, high = _narrowed(low, high, top, az, dz, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    at_low = _half_slope(low, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    at_high = _half_slope(high, ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
    t = zero_between(low, high, at_low, at_high)
    bx, by = _beyond(ax + t * dx, x0, x1), _beyond(ay + t * dy, y0, y1)
    above = max(0.0, az + t * dz - top)
    return bx * bx + by * by + above * above, t


@njit(cache=True, nogil=True)
def _nearest_in_leaf(elevation_m, row0, col0, lattice, ax, ay, az, dx, dy, dz, best_sq, best_t):
    lowest = min(az, az + dz)
    rectangular = is_rectangular(lattice)
    stop_row, stop_column, bend = leaf_end(elevation_m, lattice, row0, col0)
    for r in range(row0, stop_row):
        for c in range(col0, stop_column):
            top = column_top(elevation_m, r, c)
            above = lowest - top
            if above > 0.0 and above * above >= best_sq:
                continue
            x0, y0, x1, y1 = block_around(lattice, bend, r, c, r + 1, c + 1)
            sq, t = column_distance_sq(ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
            if sq < best_sq and not rectangular:
                sq, t = quad_distance_sq(ax, ay, az, dx, dy, dz, quad_of(lattice, r, c), top)
            if sq < best_sq:
                best_sq, best_t = sq, t
    return best_sq, best_t


@njit(cache=True, nogil=True)
def segment_nearest(elevation_m, maxima_m, layout, lattice, boxes_m, ax, ay, az, dx, dy, dz):
    """(squared distance, t) of one segment a + t d: depth first, nearer child first."""
    at_start = edge_distance(lattice, elevation_m.shape[0], elevation_m.shape[1], ax, ay)
    at_end = edge_distance(lattice, elevation_m.shape[0], elevation_m.shape[1], ax + dx, ay + dy)
    best_t = 0.0 if at_start <= at_end else 1.0  # the distance to the outside is concave along a line
    best_sq = min(at_start, at_end) ** 2
    bound = np.empty(STACK)
    node = np.empty((STACK, 3), np.int64)
    bound[0], node[0, 0], node[0, 1], node[0, 2] = 0.0, layout.shape[0] - 1, 0, 0
    size = 1
    while size > 0:
        size -= 1
        if bound[size] >= best_sq:
            continue
        level, i, j = node[size, 0], node[size, 1], node[size, 2]
        if level == 0:
            best_sq, best_t = _nearest_in_leaf(
                elevation_m, i * LEAF_PX, j * LEAF_PX, lattice, ax, ay, az, dx, dy, dz, best_sq, best_t
            )
            continue
        offset, cols, child_rows, child_cols = below(layout, level, i, j)
        first = size
        for ci in child_rows:
            for cj in child_cols:
                top = np.float64(maxima_m[offset + ci * cols + cj])
                x0, y0, x1, y1 = block_box(lattice, boxes_m, offset, cols, level - 1, ci, cj)
                sq, _ = column_distance_sq(ax, ay, az, dx, dy, dz, x0, y0, x1, y1, top)
                if sq >= best_sq:
                    continue
                k = size
                while k > first and bound[k - 1] < sq:
                    bound[k] = bound[k - 1]
                    node[k] = node[k - 1]
                    k -= 1
                bound[k], node[k, 0], node[k, 1], node[k, 2] = sq, level - 1, ci, cj
                size += 1
    return best_sq, best_t


@njit(cache=True, parallel=True, nogil=True)
def _nearest_all(elevation_m, maxima_m, layout, lattice, boxes_m, start_m, end_m, distance_m, share):
    for k in prange(start_m.shape[0]):
        d = end_m[k] - start_m[k]
        a = start_m[k]
        sq, t = segment_nearest(elevation_m, maxima_m, layout, lattice, boxes_m, a[0], a[1], a[2], d[0], d[1], d[2])
        distance_m[k] = np.sqrt(sq)
        share[k] = t
