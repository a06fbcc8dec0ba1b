"""The corridor that a decimated path must keep to, and the places where it may bend."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I64

HEIGHT_UNIT_M = 0.01
"""Autopilots keep whole centimetres (measured on ArduCopter, which truncates)."""
LATERAL_ROUNDING_M = 0.008
"""Half of 1e-7 degree in latitude and in longitude together: how far rounding moves a waypoint."""
BENDS_PER_LEG = 32
LEVELS = 16
SLACK = 1e-9


@dataclass(frozen=True, slots=True)
class Corridor:
    """Between ``bottom_m`` and ``top_m`` (N,) over ``s_m`` (N,), within slopes, through every vertex."""

    s_m: F64
    bottom_m: F64
    top_m: F64
    climb: float
    descent: float
    vertex: I64
    grid_origin_m: float
    """Heights of waypoints differ from it by whole ``HEIGHT_UNIT_M``."""

    def on_grid(self, alt_m: F64) -> F64:
        """The lowest heights of the grid that are not below ``alt_m``."""
        return self.grid_origin_m + np.ceil((alt_m - self.grid_origin_m) / HEIGHT_UNIT_M - SLACK) * HEIGHT_UNIT_M


@dataclass(frozen=True, slots=True)
class Bends:
    """Samples at which a waypoint may stand, with the heights it may have there."""

    sample: I64
    """(M,) ascending, every vertex included."""
    is_vertex: np.ndarray
    """(M,) bool"""
    level_m: F64
    """(M, L) ascending, inf behind the last; the first is the lowest height of the grid in the corridor."""
    levels: I64
    """(M,) how many are finite."""


def corridor(
    s_m: F64, alt_m: F64, vertex: I64, *, excess_m: float, climb: float, descent: float, grid_origin_m: float
) -> Corridor:
    """The band of ``excess_m`` over the profile ``alt_m``.

    Its bottom is lifted by what rounding latitude and longitude can sink a waypoint into a
    slope. It is never thinner than the height grid, so it can always be flown through.
    """
    rise, run = np.diff(alt_m), np.diff(s_m)
    steepest = float(np.max(np.abs(rise / run)))
    bottom = alt_m + LATERAL_ROUNDING_M * steepest
    band = Corridor(s_m, bottom, bottom, climb, descent, vertex, grid_origin_m)
    # A path that is itself steeper ("slow") is followed; the vehicle's vertical limits slow it down there.
    limits = max(climb, float(np.max(rise / run))), max(descent, float(np.max(-rise / run)))
    top = np.maximum(alt_m + excess_m, band.on_grid(bottom))
    return Corridor(s_m, bottom, top, *limits, vertex, grid_origin_m)


def bends(band: Corridor) -> Bends:
    """Bends that follow the terrain: dense where a straight line cannot reach far.

    The path that leaps along the middle of the corridor is always among the choices, so there is a way through.
    """
    lowest = band.on_grid(band.bottom_m)
    middle = np.maximum(lowest, band.on_grid((band.bottom_m + band.top_m) / 2 - HEIGHT_UNIT_M))
    stops = _leaps(band.s_m, middle, band.bottom_m, band.top_m, band.vertex, band.climb, band.descent)
    gaps = np.maximum(1, np.diff(stops) // BENDS_PER_LEG)
    between = [np.arange(a, b, g) for a, b, g in zip(stops[:-1], stops[1:], gaps, strict=True)]
    sample = np.concatenate([*between, stops[-1:]]).astype(np.int64)
    level_m = _levels(band, lowest[sample], middle[sample], sample)
    return Bends(sample, np.isin(sample, band.vertex), level_m, np.isfinite(level_m).sum(axis=1))


def _levels(band: Corridor, lowest_m: F64, middle_m: F64, sample: I64) -> F64:
    """Each bend's lowest and middle height, and multiples of a step common to all, so that level flight exists."""
    room_m = float(np.max(band.top_m[sample] - lowest_m))
    step_m = max(1, int(np.ceil(room_m / HEIGHT_UNIT_M / LEVELS))) * HEIGHT_UNIT_M
    first = np.floor((lowest_m - band.grid_origin_m) / step_m + SLACK) + 1
    common = band.grid_origin_m + (first[:, None] + np.arange(LEVELS)) * step_m
    common[common > band.top_m[sample, None] + SLACK] = np.inf
    return np.sort(np.column_stack([lowest_m, middle_m, common]).astype(np.float64), axis=1)


@njit(cache=True, nogil=True)
def _leaps(
    s_m: F64, alt_m: F64, bottom_m: F64, top_m: F64, vertex: I64, climb: float, descent: float
) -> I64:  # pragma: no cover - compiled
    """Along the profile ``alt_m``, each time as far as a straight line between two of its heights may go."""
    stops = np.empty(len(s_m), np.int64)
    count, at, segment = 1, 0, 1
    stops[0] = 0
    while at < len(s_m) - 1:
        low, high, best = -np.inf, np.inf, at + 1
        for j in range(at + 1, vertex[segment] + 1):
            run = s_m[j] - s_m[at]
            least = max(low * run, -descent * run - HEIGHT_UNIT_M) - SLACK
            most = min(high * run, climb * run + HEIGHT_UNIT_M) + SLACK
            if least > most:
                break
            if least <= alt_m[j] - alt_m[at] <= most:
                best = j
            low = max(low, (bottom_m[j] - alt_m[at]) / run)
            high = min(high, (top_m[j] - alt_m[at]) / run)
        at = best
        if at == vertex[segment]:
            segment += 1
        stops[count] = at
        count += 1
    return stops[:count]
