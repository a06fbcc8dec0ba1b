"""How high a straight flight home must be, from EVERY place of the line.

Return to launch climbs to the larger of the set height and the vehicle's own, then flies straight home
on the level. It keeps a distance c to a column of elevation e at horizontal distance d < c when it is
at least e + sqrt(c^2 - d^2) high; climbing never brings it nearer to any column. The ways home from all
places of a straight piece of the line sweep a triangle, so d is the distance of the column to that
triangle: no mast, however thin, stands between two ways home. A block of cells asks for at most what the
column over its outline with its largest elevation asks for, so branch and bound over the pyramid of
maxima finds the exact height at full resolution.

Near home autopilots climb less than to the set return height: ArduCopter to at most RTL_CONE_SLOPE (3) times the
distance from home; PX4, within RTL_MIN_DIST (10 m), to where its cone RTL_CONE_ANG (45 degrees) is. Both keep
their own height where that is larger. The lower of the two counts, so that a certificate holds for either.

Coordinates: the lattice's frame, z up.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from mapping.geometry.arrays import F64
from planning.certificate.nearest import STACK, column_distance_sq
from planning.certificate.pyramid import LEAF_PX, MaxPyramid, below, block_box, column_top, edge_distance, leaf_end
from planning.certificate.quads import quad_distance_sq
from planning.terrain.cells.lattice import block_around, is_rectangular, quad_of

_THIN = 1e-9
"""A triangle flatter than this share of its length is judged by its sides alone: it has no inside to speak of."""
CHUNKS = 32
"""Parts of the line searched independently; inside one, what was found raises the bar for the next place."""
SLOPE, NEAR_SLOPE, NEAR_M = 3.0, 1.0, 10.0
"""Of the cones around home; the flatter one holds within NEAR_M."""


def return_altitudes(places_m: F64, home_xy_m: F64, home_alt_m: float, *, rtl_height_m: float, step_m: float) -> F64:
    """(N,) altitude at which a return from each of the (N, 3) places flies home.

    It is the lowest for all places within half of ``step_m``, the spacing of the places.
    """
    away_m = np.maximum(0.0, np.hypot(*(places_m[:, :2] - home_xy_m).T) - step_m / 2)
    cone_m = np.where(away_m <= NEAR_M, NEAR_SLOPE, SLOPE) * away_m
    return np.maximum(places_m[:, 2], home_alt_m + np.minimum(rtl_height_m, cone_m))


def return_altitude(pyramid: MaxPyramid, places_m: F64, home_xy_m: F64, clearance_m: float) -> tuple[float, int]:
    """Smallest altitude from which every way home keeps ``clearance_m``, and the place that asks for it.

    ``places_m`` (N, 3) are places one after the other along the line; a return may start from them and
    from anywhere between neighbours, whose lower altitude counts for the piece between them. A piece that
    is high enough itself asks for nothing. Returns (-inf, -1) when no piece asks for anything, else the
    altitude and the place at which the asking piece begins; inf where unknown cells or the model's edge
    lie within ``clearance_m`` of a way home.
    """
    if len(places_m) == 1:
        places_m = np.repeat(places_m, 2, axis=0)
    needed_m = np.empty(CHUNKS)
    place = np.empty(CHUNKS, dtype=np.int64)
    _search(
        pyramid.elevation_m,
        pyramid.maxima_m,
        pyramid.layout,
        pyramid.lattice,
        pyramid.boxes_m,
        np.ascontiguousarray(places_m, dtype=np.float64),
        float(home_xy_m[0]),
        float(home_xy_m[1]),
        float(clearance_m),
        needed_m,
        place,
    )
    worst = int(np.argmax(needed_m))
    return float(needed_m[worst]), int(place[worst])


@njit(cache=True, nogil=True)
def _holds(ax, ay, bx, by, cx, cy, x, y):
    """Whether the triangle a b c has (x, y) inside."""
    twice_area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    longest_sq = max(
        max((bx - ax) ** 2 + (by - ay) ** 2, (cx - ax) ** 2 + (cy - ay) ** 2), (cx - bx) ** 2 + (cy - by) ** 2
    )
    if abs(twice_area) <= _THIN * longest_sq:
        return False
    side = 1.0 if twice_area > 0.0 else -1.0
    return (
        side * ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) >= 0.0
        and side * ((cx - bx) * (y - by) - (cy - by) * (x - bx)) >= 0.0
        and side * ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) >= 0.0
    )


@njit(cache=True, nogil=True)
def _flat_distance_sq(ax, ay, bx, by, x0, y0, x1, y1):
    """Squared horizontal distance of the segment a b to a rectangle."""
    sq, _ = column_distance_sq(ax, ay, 0.0, bx - ax, by - ay, 0.0, x0, y0, x1, y1, np.inf)
    return sq


@njit(cache=True, nogil=True)
def _asked(ax, ay, bx, by, hx, hy, x0, y0, x1, y1, top, clearance_m):
    """Altitude that one column asks of level flights from the segment a b to h; -inf when it is out of reach."""
    sq = _flat_distance_sq(ax, ay, hx, hy, x0, y0, x1, y1)
    if sq > 0.0 and (ax != bx or ay != by):
        sq = min(sq, _flat_distance_sq(bx, by, hx, hy, x0, y0, x1, y1))
        sq = min(sq, _flat_distance_sq(ax, ay, bx, by, x0, y0, x1, y1))
        if sq > 0.0 and _holds(ax, ay, bx, by, hx, hy, x0, y0):
            sq = 0.0
    return _altitude_over(sq, top, clearance_m)


@njit(cache=True, nogil=True)
def _altitude_over(flat_sq, top, clearance_m):
    """Altitude that keeps the clearance at a horizontal distance from a column."""
    if flat_sq >= clearance_m * clearance_m:
        return -np.inf
    return top + np.sqrt(clearance_m * clearance_m - flat_sq)


@njit(cache=True, nogil=True)
def _quad_sq(ax, ay, bx, by, quad):
    """Squared horizontal distance of the segment a b to a quadrilateral."""
    sq, _ = quad_distance_sq(ax, ay, 0.0, bx - ax, by - ay, 0.0, quad, np.inf)
    return sq


@njit(cache=True, nogil=True)
def _asked_by_quad(ax, ay, bx, by, hx, hy, quad, top, clearance_m):
    """As `_asked`, of the column over a quadrilateral."""
    sq = _quad_sq(ax, ay, hx, hy, quad)
    if sq > 0.0 and (ax != bx or ay != by):
        sq = min(sq, _quad_sq(bx, by, hx, hy, quad))
        sq = min(sq, _quad_sq(ax, ay, bx, by, quad))
        if sq > 0.0 and _holds(ax, ay, bx, by, hx, hy, quad[0], quad[1]):
            sq = 0.0
    return _altitude_over(sq, top, clearance_m)


@njit(cache=True, nogil=True)
def _leaf_altitude(elevation_m, row0, col0, lattice, ax, ay, bx, by, hx, hy, clearance_m, needed):
    rectangular = is_rectangular(lattice)
    stop_row, stop_column, bend = leaf_end(elevation_m, lattice, row0, col0)
    for r in range(row0, stop_row):
        for c in range(col0, stop_column):
            top = column_top(elevation_m, r, c)
            if top + clearance_m <= needed:
                continue
            x0, y0, x1, y1 = block_around(lattice, bend, r, c, r + 1, c + 1)
            asked = _asked(ax, ay, bx, by, hx, hy, x0, y0, x1, y1, top, clearance_m)
            if asked > needed and not rectangular:
                asked = _asked_by_quad(ax, ay, bx, by, hx, hy, quad_of(lattice, r, c), top, clearance_m)
            needed = max(needed, asked)
    return needed


@njit(cache=True, nogil=True)
def _needed_altitude(elevation_m, maxima_m, layout, lattice, boxes_m, ax, ay, bx, by, hx, hy, clearance_m, bar):
    """The larger of ``bar`` and the altitude that the level flights from the segment a b to h need."""
    height_px, width_px = elevation_m.shape
    to_edge = min(
        edge_distance(lattice, height_px, width_px, ax, ay), edge_distance(lattice, height_px, width_px, bx, by)
    )
    if min(to_edge, edge_distance(lattice, height_px, width_px, hx, hy)) < clearance_m:
        return np.inf
    needed = bar
    bound = np.empty(STACK)
    node = np.empty((STACK, 3), np.int64)
    bound[0], node[0, 0], node[0, 1], node[0, 2] = np.inf, layout.shape[0] - 1, 0, 0
    size = 1
    while size > 0 and needed < np.inf:
        size -= 1
        if bound[size] <= needed:
            continue
        level, i, j = node[size, 0], node[size, 1], node[size, 2]
        if level == 0:
            needed = _leaf_altitude(
                elevation_m, i * LEAF_PX, j * LEAF_PX, lattice, ax, ay, bx, by, hx, hy, clearance_m, needed
            )
            continue
        offset, cols, child_rows, child_cols = below(layout, level, i, j)
        first = size
        for ci in child_rows:
            for cj in child_cols:
                top = np.float64(maxima_m[offset + ci * cols + cj])
                if top + clearance_m <= needed:
                    continue
                x0, y0, x1, y1 = block_box(lattice, boxes_m, offset, cols, level - 1, ci, cj)
                asked = _asked(ax, ay, bx, by, hx, hy, x0, y0, x1, y1, top, clearance_m)
                if asked <= needed:
                    continue
                k = size
                while k > first and bound[k - 1] > asked:
                    bound[k] = bound[k - 1]
                    node[k] = node[k - 1]
                    k -= 1
                bound[k], node[k, 0], node[k, 1], node[k, 2] = asked, level - 1, ci, cj
                size += 1
    return needed


@njit(cache=True, parallel=True, nogil=True)
def _search(elevation_m, maxima_m, layout, lattice, boxes_m, places_m, home_x, home_y, clearance_m, needed_m, place):
    n = places_m.shape[0] - 1
    for chunk in prange(CHUNKS):
        best, best_place = -np.inf, -1
        for k in range(n * chunk // CHUNKS, n * (chunk + 1) // CHUNKS):
            a, b = places_m[k], places_m[k + 1]
            bar = max(best, min(a[2], b[2]))
            found = _needed_altitude(
                elevation_m,
                maxima_m,
                layout,
                lattice,
                boxes_m,
                a[0],
                a[1],
                b[0],
                b[1],
                home_x,
                home_y,
                clearance_m,
                bar,
            )
            if found > bar:
                best, best_place = found, k
        needed_m[chunk] = best
        place[chunk] = best_place
