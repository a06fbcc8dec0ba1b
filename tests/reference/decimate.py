"""Fewest waypoints in a corridor by trying every pair of bends and heights, checking each line sample by sample."""

import numpy as np

from planning.missions.band import HEIGHT_UNIT_M, SLACK, Bends, Corridor


def line_fits(band: Corridor, i: int, zi: float, j: int, zj: float) -> bool:
    """Whether the straight line between two samples stays in the corridor and within the slopes."""
    run = band.s_m[j] - band.s_m[i]
    line = zi + (zj - zi) * (band.s_m[i : j + 1] - band.s_m[i]) / run
    above = bool(np.all(line >= band.bottom_m[i : j + 1] - 2 * SLACK))
    below = bool(np.all(line <= band.top_m[i : j + 1] + 2 * SLACK))
    spare = HEIGHT_UNIT_M + 2 * SLACK
    return above and below and -band.descent * run - spare <= zj - zi <= band.climb * run + spare


def fewest(band: Corridor, choice: Bends) -> int:
    """Smallest possible number of waypoints over the given bends and heights."""
    best = [np.full(len(z), np.inf) for z in choice.level_m]
    best[0] = np.where(np.isfinite(choice.level_m[0]), 1.0, np.inf)
    for j in range(1, len(choice.sample)):
        for b in range(choice.levels[j]):
            for i in range(j - 1, -1, -1):
                for a in range(choice.levels[i]):
                    ends = int(choice.sample[i]), choice.level_m[i, a], int(choice.sample[j]), choice.level_m[j, b]
                    if best[i][a] + 1 < best[j][b] and line_fits(band, *ends):
                        best[j][b] = best[i][a] + 1
                if choice.is_vertex[i]:
                    break
    return int(best[-1].min())
