"""The UWB paper's sensor model, cell by cell and equation by equation, with its two misprinted signs put right."""

from __future__ import annotations

import math
from collections.abc import Sequence

NEAREST_M, FARTHEST_M, P_O, P_C2, P_C3, SIGMA = 3.5, 10.0, 0.8, 0.2, 0.3, 4.0
APART_M = 0.9


def t_max(scans: Sequence[Sequence[float]], bin_number: int, c_th: float = 3.0) -> tuple[float, float, float]:
    """(T_d, T_min, T_max) of one range bin; eq. 1."""
    column = [scan[bin_number] for scan in scans]
    t_d = sum(column) / len(column)
    highest = max(column)
    return t_d, min(column), t_d + c_th if highest - t_d < c_th else highest


def g_theta(alpha: float, theta: float) -> float:
    return 1 - 2 * alpha**2 / theta**2  # eq. 4


def g_pw(over: float, up: float, down: float) -> float:
    c, d = (3.0, up) if over >= 0 else (5.0, down)
    return 1 / (1 + math.exp(-c / d * over))  # eq. 5


def g_pk(bins_away: int) -> float:
    return math.exp(-(bins_away**2) / (2 * SIGMA**2)) if bins_away <= SIGMA else 0.0  # eq. 6


def g_d(range_m: float) -> float:
    return (FARTHEST_M + NEAREST_M - range_m) / (2 * FARTHEST_M) + 0.5  # eq. 7


def nearest_peak(scan: Sequence[float], limits: Sequence[tuple[float, float, float]], bin_number: int) -> int:
    above = [b for b in range(len(scan)) if scan[b] > limits[b][0]]
    peaks = [b for b in above if all(scan[b] >= scan[n] for n in (b - 1, b + 1) if 0 <= n < len(scan))]
    return min(peaks, key=lambda b: abs(bin_number - b))


def explained(
    cells: Sequence[tuple[float, float, float]], at: tuple[float, float], peak: int, theta: float, bin_m: float
) -> float:
    """How likely one of ``cells`` (range, angle off the axis, chance of being occupied) makes the echo at ``peak``.

    ``at``: range and angle of the cell that is asked about; what stands within 0.9 m of it is the same thing.
    """
    found = [0.0]
    for away_m, alpha, chance in cells:
        apart_m = math.sqrt(away_m**2 + at[0] ** 2 - 2 * away_m * at[0] * math.cos(alpha - at[1]))
        if abs(math.floor(away_m / bin_m + 0.5) - peak) <= 1 and apart_m >= APART_M - 1e-9:
            found.append(chance * max(0.0, g_theta(alpha, theta)))
    return max(found)


def log_odds_step(
    scan: Sequence[float],
    limits: Sequence[tuple[float, float, float]],
    bin_number: int,
    range_m: float,
    alpha: float,
    theta: float,
    bin_m: float,
    share: float = 0.0,
) -> float:
    """What one scan adds to the log odds of a cell at that range and angle off the axis; ``limits`` from ``t_max``.

    ``share``: how likely another cell makes the echo; the paper asks for none.
    """
    usable = [b for b in range(len(scan)) if NEAREST_M <= b * bin_m <= FARTHEST_M]
    above = [b for b in range(len(scan)) if scan[b] > limits[b][0]]
    strong = [b for b in usable if scan[b] > limits[b][2]]
    echoes = [b for b in usable if b in above]
    if bin_number not in usable or (echoes and bin_number > echoes[-1]):
        return 0.0
    t_d, t_min, highest = limits[bin_number]
    power = g_pw(scan[bin_number] - t_d, highest - t_d, max(t_d - t_min, 1e-6))
    if bin_number in above:
        away = abs(bin_number - nearest_peak(scan, limits, bin_number))
        chance = g_theta(alpha, theta) * power * g_pk(away) * P_O  # eq. 2
        if chance <= 0.5:
            return 0.0
        # The echo if this cell is occupied, against the echo if it is not but another may be.
        return math.log(chance / (1 - chance)) - math.log(share * chance / (1 - chance) + (1 - share))
    free = P_C3 if strong and bin_number > strong[0] else P_C2
    chance = g_theta(alpha, theta) * (1 - power) * g_d(range_m) * (1 - free)  # eq. 3
    return -math.log(chance / (1 - chance)) if chance > 0.5 else 0.0
