"""Exact distance from straight lines to a column over a convex quadrilateral.

The column is the closed set of all points over the quadrilateral up to its elevation. It is convex, so the
squared distance of the moving point a + t d is convex in t and once differentiable; its derivative is
2 d . (p - q), q the column's point nearest to p. It is quadratic as long as q stays in the inside, on the
same edge or at the same corner: between the t where the point crosses an edge's line, one of the two lines
across the edge's ends, or the elevation. Its minimum over a segment has a closed form therefore.

A quadrilateral is the tuple (x0, y0, ... x3, y3) of its corners, inside to the same side of all its edges.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def away(quad, x, y):
    """(x, y) from the quadrilateral's nearest point; (0, 0) inside."""
    best, best_x, best_y, inside = np.inf, 0.0, 0.0, True
    for k in range(4):
        x0, y0 = quad[2 * k], quad[2 * k + 1]
        ex, ey = quad[(2 * k + 2) % 8] - x0, quad[(2 * k + 3) % 8] - y0
        px, py = x - x0, y - y0
        inside = inside and ex * py - ey * px >= 0.0
        share = min(1.0, max(0.0, (ex * px + ey * py) / (ex * ex + ey * ey)))
        ox, oy = px - share * ex, py - share * ey
        sq = ox * ox + oy * oy
        if sq < best:
            best, best_x, best_y = sq, ox, oy
    if inside:
        return 0.0, 0.0
    return best_x, best_y


@njit(cache=True, nogil=True)
def _half_slope(t, ax, ay, az, dx, dy, dz, quad, top):
    """Half the derivative of the squared distance by t."""
    ox, oy = away(quad, ax + t * dx, ay + t * dy)
    above = az + t * dz - top
    slope = dx * ox + dy * oy
    return slope + dz * above if above > 0.0 else slope


@njit(cache=True, nogil=True)
def _narrowed(low, high, distance, speed, ax, ay, az, dx, dy, dz, quad, top):
    """The part of [low, high] on the minimum's side of the t at which ``distance + t speed`` is 0."""
    if speed == 0.0:
        return low, high
    t = -distance / speed
    if low < t < high:
        if _half_slope(t, ax, ay, az, dx, dy, dz, quad, top) > 0.0:
            return low, t
        return t, high
    return low, high


@njit(cache=True, inline="always")
def zero_between(low, high, at_low, at_high):
    """Where in [low, high] a slope passes zero that is a straight line between the two; the nearer end if nowhere."""
    if at_low >= 0.0:
        return low
    if at_high <= 0.0:
        return high
    return low - at_low * (high - low) / (at_high - at_low)


@njit(cache=True, nogil=True)
def quad_distance_sq(ax, ay, az, dx, dy, dz, quad, top):
    """(smallest squared distance, t) of a + t d, t in [0, 1], to one column; ``top`` may be +inf."""
    low, high = 0.0, 1.0
    for k in range(4):
        x0, y0, x1, y1 = quad[2 * k], quad[2 * k + 1], quad[(2 * k + 2) % 8], quad[(2 * k + 3) % 8]
        ex, ey = x1 - x0, y1 - y0
        along, across = ex * dx + ey * dy, ex * dy - ey * dx
        side = ex * (ay - y0) - ey * (ax - x0)
        low, high = _narrowed(low, high, side, across, ax, ay, az, dx, dy, dz, quad, top)
        before, after = ex * (ax - x0) + ey * (ay - y0), ex * (ax - x1) + ey * (ay - y1)
        low, high = _narrowed(low, high, before, along, ax, ay, az, dx, dy, dz, quad, top)
        low, high = _narrowed(low, high, after, along, ax, ay, az, dx, dy, dz, quad, top)
    if top < np.inf:
        low, high = _narrowed(low, high, az - top, dz, ax, ay, az, dx, dy, dz, quad, top)
    at_low = _half_slope(low, ax, ay, az, dx, dy, dz, quad, top)
    at_high = _half_slope(high, ax, ay, az, dx, dy, dz, quad, top)
    t = zero_between(low, high, at_low, at_high)
    ox, oy = away(quad, ax + t * dx, ay + t * dy)
    above = max(0.0, az + t * dz - top)
    return ox * ox + oy * oy + above * above, t


@njit(cache=True, nogil=True)
def part_inside(quad, ax, ay, dx, dy):
    """First and last t in [0, 1] at which a + t d is in the quadrilateral; empty when the first exceeds the second."""
    first, last = 0.0, 1.0
    for k in range(4):
        x0, y0 = quad[2 * k], quad[2 * k + 1]
        ex, ey = quad[(2 * k + 2) % 8] - x0, quad[(2 * k + 3) % 8] - y0
        side, across = ex * (ay - y0) - ey * (ax - x0), ex * dy - ey * dx
        if across == 0.0:
            if side < 0.0:
                return 1.0, 0.0
        elif across > 0.0:
            first = max(first, -side / across)
        else:
            last = min(last, -side / across)
    return first, last
