"""Fewest waypoints whose straight lines follow the sampled path without ever running below it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I64
from planning.basics.plan_model import SampledPath
from planning.errors import CapacityError, ParameterError
from planning.missions.band import HEIGHT_UNIT_M, SLACK, Bends, Corridor, bends, corridor

WAYPOINT_COST = 1 << 16
"""One waypoint outweighs any sum of height levels, which only break ties downwards."""
LADDER_STEP = 1.15


@dataclass(frozen=True, slots=True)
class Decimated:
    """The waypoints that remain, as samples of the path with their heights."""

    sample: I64
    """(K,) ascending; every vertex is among them."""
    alt_dsm_m: F64
    """(K,) whole centimetres above ``grid_origin_m``."""
    excess_height_m: float
    """The excess that was allowed."""


def decimate(
    path: SampledPath, *, excess_height_m: float, climb: float, descent: float, grid_origin_m: float = 0.0
) -> Decimated:
    """The fewest waypoints within ``excess_height_m`` above the path, every vertex kept.

    Straight lines between them are nowhere below the path, even after latitude and longitude are
    rounded to 1e-7 degrees and heights cut to centimetres; they rise at most ``excess_height_m``
    above it (or to the next centimetre where that is less), and their slopes are within
    ``climb`` and ``descent`` but for a centimetre per leg. Within a segment the path is straight
    seen from above, so only heights matter. Optimal over the bends and height levels of
    ``corridor.bends``: dynamic programming, a cone of free slopes carried from each bend.
    """
    if not (math.isfinite(excess_height_m) and excess_height_m >= 0):
        raise ParameterError(
            f"The excess height is {excess_height_m} m.", advice="Give zero or more metres; 1 m as a rule."
        )
    band = corridor(
        path.s_m,
        path.alt_dsm_m,
        path.vertex,
        excess_m=excess_height_m,
        climb=climb,
        descent=descent,
        grid_origin_m=grid_origin_m,
    )
    sample, alt_m = fewest_bends(band, bends(band))
    return Decimated(sample, alt_m, excess_height_m)


def decimate_to_fit(
    path: SampledPath, max_waypoints: int, *, excess_height_m: float, climb: float, descent: float, grid_origin_m: float
) -> Decimated:
    """As ``decimate``, with the smallest excess of a ladder (15 % steps) that needs at most ``max_waypoints``.

    Raises ``CapacityError`` when the vertices alone are more than that.
    """
    if len(path.vertex) > max_waypoints:
        raise CapacityError(
            f"The mission needs at least {len(path.vertex)} waypoints, and {max_waypoints} fit on the vehicle.",
            advice="Delete points, split the mission into several, or take a vehicle with a higher limit.",
        )

    def attempt(excess_m: float) -> Decimated:
        return decimate(path, excess_height_m=excess_m, climb=climb, descent=descent, grid_origin_m=grid_origin_m)

    best = attempt(excess_height_m)
    if len(best.sample) <= max_waypoints:
        return best
    ladder = _ladder(excess_height_m, float(np.ptp(path.alt_dsm_m)))
    low, high = 0, len(ladder) - 1
    while low < high:
        middle = (low + high) // 2
        if len(attempt(ladder[middle]).sample) <= max_waypoints:
            high = middle
        else:
            low = middle + 1
    best = attempt(ladder[low])
    if len(best.sample) > max_waypoints:
        raise CapacityError(
            f"Even {best.excess_height_m:.1f} m above the path the mission needs {len(best.sample)} waypoints,"
            f" and {max_waypoints} fit on the vehicle.",
            advice="Delete points, split the mission into several, or take a vehicle with a higher limit.",
        )
    return best


def _ladder(start_m: float, relief_m: float) -> list[float]:
    """Excess heights up to one at which level lines clear the whole path."""
    rungs, end_m = [max(start_m, 0.05)], 1.3 * relief_m + 1.0
    while rungs[-1] < end_m:
        rungs.append(rungs[-1] * LADDER_STEP)
    return rungs


def fewest_bends(band: Corridor, choice: Bends) -> tuple[I64, F64]:
    """Samples (K,) and heights (K,) of the cheapest way through: fewest waypoints, then lowest heights."""
    floor = _hulls(band.s_m, band.bottom_m, choice.sample, 1.0)
    ceiling = _hulls(band.s_m, band.top_m, choice.sample, -1.0)
    bend, level = _search(
        band.s_m, band.bottom_m, band.top_m, choice.sample, choice.is_vertex, choice.level_m, choice.levels,
        *floor, *ceiling, band.climb, band.descent,
    )  # fmt: skip
    return choice.sample[bend], choice.level_m[bend, level]


@njit(cache=True, nogil=True)
def _hulls(s_m: F64, z_m: F64, sample: I64, side: float) -> tuple[I64, I64]:  # pragma: no cover - compiled
    """Of the samples inside each gap between bends, those a straight line can touch first from above or below."""
    kept = np.empty(len(s_m), np.int64)
    start = np.zeros(len(sample), np.int64)
    count = 0
    for b in range(len(sample) - 1):
        first = count
        for j in range(sample[b] + 1, sample[b + 1]):
            while count - first >= 2:
                o, m = kept[count - 2], kept[count - 1]
                chord = (z_m[j] - z_m[o]) * (s_m[m] - s_m[o]) - (z_m[m] - z_m[o]) * (s_m[j] - s_m[o])
                if side * chord < 0:
                    break
                count -= 1
            kept[count] = j
            count += 1
        start[b + 1] = count
    return kept[:count], start


@njit(cache=True, nogil=True)
def _search(
    s_m, bottom_m, top_m, sample, is_vertex, level_m, levels,
    floor, floor_start, ceiling, ceiling_start, climb, descent,
):  # fmt: skip  # pragma: no cover - compiled
    """Forward over (bend, level): from each, the cone of slopes that stays in the corridor up to the next vertex."""
    bends, width = level_m.shape
    cost = np.full((bends, width), np.iinfo(np.int64).max, np.int64)
    from_bend = np.zeros((bends, width), np.int64)
    from_level = np.zeros((bends, width), np.int64)
    for a in range(levels[0]):
        cost[0, a] = a
    for k in range(bends - 1):
        s0 = s_m[sample[k]]
        for a in range(levels[k]):
            here = cost[k, a]
            if here == np.iinfo(np.int64).max:
                continue
            z0 = level_m[k, a]
            low, high = -np.inf, np.inf
            for i in range(k + 1, bends):
                for q in range(floor_start[i - 1], floor_start[i]):
                    low = max(low, (bottom_m[floor[q]] - z0) / (s_m[floor[q]] - s0))
                for q in range(ceiling_start[i - 1], ceiling_start[i]):
                    high = min(high, (top_m[ceiling[q]] - z0) / (s_m[ceiling[q]] - s0))
                run = s_m[sample[i]] - s0
                least = max(low * run, -descent * run - HEIGHT_UNIT_M) - SLACK
                most = min(high * run, climb * run + HEIGHT_UNIT_M) + SLACK
                if least > most:
                    break
                for b in range(levels[i]):
                    rise = level_m[i, b] - z0
                    if rise > most:
                        break
                    if rise >= least and here + WAYPOINT_COST + b < cost[i, b]:
                        cost[i, b] = here + WAYPOINT_COST + b
                        from_bend[i, b] = k
                        from_level[i, b] = a
                if is_vertex[i]:
                    break
                low = max(low, (bottom_m[sample[i]] - z0) / run)
                high = min(high, (top_m[sample[i]] - z0) / run)
    return _trace(cost[bends - 1, : levels[bends - 1]], from_bend, from_level)


@njit(cache=True, nogil=True)
def _trace(final, from_bend, from_level):  # pragma: no cover - compiled
    """Back from the cheapest end to the start: bends and levels in flying order."""
    bend = np.empty(len(from_bend), np.int64)
    level = np.empty(len(from_bend), np.int64)
    bend[0], level[0] = len(from_bend) - 1, np.argmin(final)
    count = 1
    while bend[count - 1] != 0:
        bend[count] = from_bend[bend[count - 1], level[count - 1]]
        level[count] = from_level[bend[count - 1], level[count - 1]]
        count += 1
    return bend[:count][::-1].copy(), level[:count][::-1].copy()
