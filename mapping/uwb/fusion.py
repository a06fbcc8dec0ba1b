"""The cells in the radar's view: whether all are traversable, and Bayes' rule for those that are not (eqs 2-4, 7)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

MOST_LOG_ODDS = 12.0
"""Beyond this a cell would not change its mind in any reasonable time, and float32 nearly cannot."""


@njit(cache=True, nogil=True)
def _window(shape, place, farthest_m, half_width_rad):
    """Rows and columns around the sector: the radar, its rim every few degrees, and a cell to spare."""
    row, col, heading_rad, cell_m = place
    low_row, high_row, low_col, high_col = row, row, col, col
    for k in range(-8, 9):
        angle = heading_rad + half_width_rad * k / 8.0
        r = row - farthest_m / cell_m * math.cos(angle)
        c = col + farthest_m / cell_m * math.sin(angle)
        low_row, high_row = min(low_row, r), max(high_row, r)
        low_col, high_col = min(low_col, c), max(high_col, c)
    # Between two points of the rim it bulges by no more than this.
    spare = 2.0 + farthest_m / cell_m * (1.0 - math.cos(half_width_rad / 8.0))
    r0, r1 = max(0, math.floor(low_row - spare)), min(shape[0], math.ceil(high_row + spare))
    c0, c1 = max(0, math.floor(low_col - spare)), min(shape[1], math.ceil(high_col + spare))
    return r0, r1, c0, c1


@njit(cache=True, nogil=True)
def _seen_from(i, j, place):
    """Distance in metres and angle off the beam's axis of a cell's middle."""
    row, col, heading_rad, cell_m = place
    east, north = (j + 0.5 - col) * cell_m, (row - i - 0.5) * cell_m
    s, c = math.sin(heading_rad), math.cos(heading_rad)
    return math.sqrt(east * east + north * north), math.atan2(east * c - north * s, east * s + north * c)


@njit(cache=True, nogil=True)
def view_is_clear(passable, place, nearest_m, farthest_m, half_width_rad):
    """Whether every cell of the field of view is inside the grid, known and traversable."""
    row, col, heading_rad, cell_m = place
    reach = farthest_m / cell_m
    for side in (-half_width_rad, 0.0, half_width_rad):
        r = row - reach * math.cos(heading_rad + side)
        c = col + reach * math.sin(heading_rad + side)
        if not (0.0 <= r < passable.shape[0] and 0.0 <= c < passable.shape[1]):
            return False
    if not (0.0 <= row < passable.shape[0] and 0.0 <= col < passable.shape[1]):
        return False
    r0, r1, c0, c1 = _window(passable.shape, place, farthest_m, half_width_rad)
    for i in range(r0, r1):
        for j in range(c0, c1):
            if not passable[i, j]:
                away_m, off_rad = _seen_from(i, j, place)
                if nearest_m <= away_m <= farthest_m and abs(off_rad) <= half_width_rad:
                    return False
    return True


@njit(cache=True, nogil=True)
def fuse(log_odds, time_in_view_s, blocked, place, region, weight, peak, beam, limits, gap_s, apart_m):
    """Bayes' rule in log odds for the untraversable cells in view; all cells in view gain ``gap_s``.

    ``peak``: of each bin, the one its echo belongs to. ``beam``: range of the first bin's middle, metres per bin,
    beamwidth theta; ``limits``: R_min, R_max. With ``apart_m`` infinite no cell explains another's echo: the paper's
    rule.
    """
    first_m, bin_m, theta = beam
    nearest_m, farthest_m = limits
    suspects = explainers(log_odds, blocked, place, peak, beam, farthest_m, apart_m)
    r0, r1, c0, c1 = _window(blocked.shape, place, farthest_m, theta / 2.0)
    for i in range(r0, r1):
        for j in range(c0, c1):
            away_m, off_rad = _seen_from(i, j, place)
            if not (nearest_m <= away_m <= farthest_m and abs(off_rad) <= theta / 2.0):
                continue
            time_in_view_s[i, j] += gap_s
            bin_number = math.floor((away_m - first_m) / bin_m + 0.5)
            if not blocked[i, j] or not 0 <= bin_number < len(region) or region[bin_number] == 0:
                continue
            chance = weight[bin_number] * (1.0 - 2.0 * off_rad * off_rad / (theta * theta))  # Ahtiainen, eq. 4
            if region[bin_number] != 1:
                chance *= (farthest_m + nearest_m - away_m) / (2.0 * farthest_m) + 0.5  # Ahtiainen, eq. 7
            # Below 0.5 a free bin would make a cell MORE occupied, and an echo less: neither says anything then.
            if chance <= 0.5:
                continue
            odds = chance / (1.0 - chance)
            step = -math.log(odds)
            if region[bin_number] == 1:
                share = explained(suspects, i, j, peak[bin_number], apart_m / place[3])
                step = math.log(odds / (1.0 + (odds - 1.0) * share))
            new = log_odds[i, j] + step
            log_odds[i, j] = np.float32(min(MOST_LOG_ODDS, max(-MOST_LOG_ODDS, new)))


@njit(cache=True, nogil=True)
def explainers(log_odds, blocked, place, peak, beam, farthest_m, apart_m):
    """(K, 4) Row, column, bin and chance of each untraversable cell that may be what a peak comes from.

    The beam does not end where the field of view does: what stands at its rim echoes, as weakly as eq. 4 has it.
    """
    first_m, bin_m, theta = beam
    if math.isinf(apart_m):
        return np.empty((0, 4))
    half_width_rad = theta / math.sqrt(2.0)
    r0, r1, c0, c1 = _window(blocked.shape, place, farthest_m + bin_m, half_width_rad)
    found, count = np.empty((max(0, r1 - r0) * max(0, c1 - c0), 4)), 0
    for i in range(r0, r1):
        for j in range(c0, c1):
            if not blocked[i, j]:
                continue
            away_m, off_rad = _seen_from(i, j, place)
            bin_number = math.floor((away_m - first_m) / bin_m + 0.5)
            if abs(off_rad) < half_width_rad and 0 <= bin_number < len(peak):
                gain = 1.0 - 2.0 * off_rad * off_rad / (theta * theta)  # Ahtiainen, eq. 4
                found[count, 0], found[count, 1], found[count, 2] = i, j, bin_number
                found[count, 3] = gain / (1.0 + math.exp(-log_odds[i, j]))
                count += 1
    return found[:count]


@njit(cache=True, nogil=True)
def explained(suspects, i, j, peak, apart_cells):
    """How likely something else makes the echo: the likeliest cell in the peak's bin or beside it, far enough away."""
    best = 0.0
    for row, col, bin_number, chance in suspects:
        if chance > best and abs(bin_number - peak) <= 1.0 and math.hypot(row - i, col - j) >= apart_cells:
            best = chance
    return best
