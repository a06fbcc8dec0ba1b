"""Whether what a radar took for moving has moved as its Doppler says: its places and ranges are the proof."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.poses import Pose

MOST_SIGHTINGS = 100
"""In one frame; more do not pass by, and no proof of them is wanted."""


@dataclass(frozen=True, slots=True)
class MovedParams:
    """A radial speed alone proves nothing: a radar that folds speeds elsewhere, or a velocity of the vehicle that
    comes late, makes moving things of masts. Whatever is in doubt has not moved."""

    folded_m_s: float = 67 * 0.31
    memory_s: float = 7.0
    earlier_s: float = 1.5
    """So long after they are seen targets may come to be believed."""
    way_m: float = 6.0
    """Wanted before and after a place, at the speed that the Doppler tells."""
    shortest_s: float = 0.5
    longest_s: float = 2.0
    near_m: float = 5.0
    """Besides its way: what is so near is taken for the same thing."""
    least_frames: int = 5
    least_m: float = 4.0
    """Along the line of sight, of the way over ground and of the change in range; the latter since the edge of what
    the radar sees keeps pace with the vehicle."""
    late_s: float = 0.5
    """A position so late drags everything along while the vehicle's velocity changes."""
    range_sigma_m: float = 0.3
    sigmas: float = 3.0
    least_share: float = 0.5
    most_share: float = 1.5
    """Of what the Doppler says, in what the places say."""
    agrees_m_s: float = 1.0
    """Measured radial speed and change of range: known without the vehicle's velocity."""
    spread_m: float = 1.0
    """Along the line of sight, root mean square off the even motion."""
    off_m: float = 2.0


@dataclass(frozen=True, slots=True)
class Sightings:
    """Of things said to move. All (N,) unless said otherwise."""

    t_s: F64
    place_enu_m: F64
    """(N, 2)"""
    ahead_enu: F64
    """(N, 2) unit vectors from the vehicle"""
    range_m: F64
    radial_m_s: F64
    surplus_m_s: F64
    """Radial speed over ground."""
    own_m_s: F64
    """(N, 2) the vehicle's velocity"""

    def __len__(self) -> int:
        return len(self.t_s)

    def only(self, which: Bools) -> Sightings:
        return Sightings(
            self.t_s[which],
            self.place_enu_m[which],
            self.ahead_enu[which],
            self.range_m[which],
            self.radial_m_s[which],
            self.surplus_m_s[which],
            self.own_m_s[which],
        )


class Moved:
    """Remembers for some seconds what was said to move."""

    def __init__(self, params: MovedParams | None = None) -> None:
        self._params = params or MovedParams()
        self.clear()

    def clear(self) -> None:
        self._frames: deque[Sightings] = deque()

    def remember(self, t_s: float, points_enu: F64, radial_m_s: F64, surplus_m_s: F64, pose: Pose) -> None:
        """(N, 3) places of a frame, (N,) radial speeds as measured and over ground."""
        while self._frames and self._frames[0].t_s[0] < t_s - self._params.memory_s:
            self._frames.popleft()
        few = slice(MOST_SIGHTINGS)
        place = points_enu[few, :2]
        if not len(place):
            return
        away = place - pose.position_enu_m[:2]
        range_m = np.maximum(np.linalg.norm(away, axis=1), 1e-6)
        own = np.broadcast_to(pose.velocity_enu_m_s[:2], place.shape)
        when = np.full(len(place), t_s)
        ahead = away / range_m[:, None]
        self._frames.append(Sightings(when, place, ahead, range_m, radial_m_s[few], surplus_m_s[few], own))

    def all(self) -> Sightings:
        """To be asked once for many places."""
        names = Sightings.__slots__
        if not self._frames:
            return Sightings(*(np.empty((0, 2)) if name in _PAIRS else np.empty(0) for name in names))
        return Sightings(*(np.concatenate([getattr(frame, name) for frame in self._frames]) for name in names))

    def through(self, seen: Sightings, corner_enu_m: tuple[float, float], size_m: float, from_s: float) -> bool:
        """Whether one thing has moved through this square since then, for sure, and nothing else was there with it."""
        p = self._params
        (east, north), (low_e, low_n) = seen.place_enu_m.T, corner_enu_m
        there = (east >= low_e) & (east < low_e + size_m) & (north >= low_n) & (north < low_n + size_m)
        there &= seen.t_s >= from_s - p.earlier_s
        if not np.any(there):
            return False
        first_s, last_s = float(seen.t_s[there].min()), float(seen.t_s[there].max())
        speed = abs(float(np.mean(seen.surplus_m_s[there])))
        within_s = min(max(p.way_m / max(speed, 1e-6), p.shortest_s), p.longest_s)
        off_s = np.maximum(np.maximum(first_s - seen.t_s, seen.t_s - last_s), 0.0)
        middle = seen.place_enu_m[there].mean(axis=0)
        away = np.sqrt((east - middle[0]) ** 2 + (north - middle[1]) ** 2)
        mine = (off_s <= within_s) & (away <= p.near_m + p.most_share * speed * (off_s + last_s - first_s))
        if _frames(seen.t_s[mine]) < p.least_frames:
            return False
        return self._is_even(seen.only(mine), there[mine])

    def _is_even(self, seen: Sightings, there: Bools) -> bool:
        """Places on their way, and ranges, as the radial speeds say."""
        p = self._params
        lasted_s = float(np.ptp(seen.t_s))
        if lasted_s <= 0.0:
            return False
        ahead = seen.ahead_enu.mean(axis=0)
        ahead /= max(float(np.linalg.norm(ahead)), 1e-6)
        drift, off_m = _line(seen.t_s, seen.place_enu_m @ ahead)
        nearing, _ = _line(seen.t_s, seen.range_m)
        spread_m = float(np.sqrt(np.mean(off_m**2)))
        error = max(spread_m, p.range_sigma_m) / max(float(np.std(seen.t_s)) * math.sqrt(len(seen)), 1e-6)
        surplus = float(np.mean(seen.surplus_m_s))
        dragged_m = p.late_s * float(np.linalg.norm(seen.own_m_s - seen.own_m_s[0], axis=1).max())
        folded = math.remainder(nearing - _mean_folded(seen.radial_m_s, p.folded_m_s), p.folded_m_s)
        return (
            p.least_share * abs(surplus) <= math.copysign(drift, drift * surplus) <= p.most_share * abs(surplus)
            and abs(drift) >= p.sigmas * error
            and abs(drift) * lasted_s >= p.least_m + dragged_m
            and abs(nearing) * lasted_s >= p.least_m
            and abs(folded) <= p.agrees_m_s
            and spread_m <= p.spread_m
            and float(np.abs(off_m[there]).max()) <= p.off_m
        )


def _frames(t_s: F64) -> int:
    """In which they were seen; (N,) times never fall."""
    return 1 + int(np.count_nonzero(np.diff(t_s))) if len(t_s) else 0


_PAIRS = ("place_enu_m", "ahead_enu", "own_m_s")


def _line(t_s: F64, value: F64) -> tuple[float, F64]:
    """Slope of the straight line through the values, and (N,) how far they are off it."""
    t = t_s - t_s.mean()
    slope = float(t @ value / (t @ t))
    return slope, value - value.mean() - slope * t


def _mean_folded(speeds: F64, folded_m_s: float) -> float:
    """Of speeds that are known but for multiples."""
    first = float(speeds[0])
    return first + float(np.mean(np.remainder(speeds - first + folded_m_s / 2, folded_m_s) - folded_m_s / 2))
