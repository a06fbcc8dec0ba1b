"""Where the vehicle was when a frame was measured: positions and attitudes, interpolated, implausible ones refused."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64

DOUBTED_FASTER_M_S = 3.0
"""Than the vehicle says it is: while positions are doubted."""

Refused = Literal["not finite", "out of order", "position jumped", "no fix"]
Missing = Literal["no position", "no attitude", "position too far in time", "attitude too far in time"]


@dataclass(frozen=True, slots=True)
class TrackParams:
    """What is believed of a pose track."""

    longest_gap_s: float = 0.5
    """Between two samples that are interpolated."""
    longest_ahead_s: float = 0.2
    """Beyond the newest sample (or before the oldest) that one is carried on with its velocity."""
    largest_speed_m_s: float = 40.0
    """Between two samples; anything faster is a jump of the receiver, not a flight."""
    slack_m: float = 3.0
    """A jump of so much is still believed: standalone receivers correct themselves by it."""
    settle_s: float = 10.0
    """After a jump the new place is believed when it has been consistent for so long."""
    keep_s: float = 5.0


@dataclass(frozen=True, slots=True)
class Pose:
    """At one moment; ``velocity_enu_m_s`` is zero where it is not known."""

    t_mono_s: float
    position_enu_m: F64
    velocity_enu_m_s: F64
    q_enu_body: F64
    """(w, x, y, z)"""

    @property
    def rotation_enu_body(self) -> F64:
        return quaternions.rotation(self.q_enu_body)

    @property
    def heading_rad(self) -> float:
        return quaternions.heading(self.rotation_enu_body)


@dataclass(frozen=True, slots=True)
class _Sample:
    t_s: float
    value: F64
    rate: F64 | None = None


class _Series:
    """Samples in order of time, the newest last, and the two around a moment."""

    def __init__(self, params: TrackParams) -> None:
        self._params = params
        self.samples: deque[_Sample] = deque()

    def add(self, sample: _Sample) -> None:
        self.samples.append(sample)
        while self.samples[0].t_s < sample.t_s - self._params.keep_s:
            self.samples.popleft()

    @property
    def newest_t_s(self) -> float | None:
        return self.samples[-1].t_s if self.samples else None

    def around(self, t_s: float) -> tuple[_Sample, _Sample, float] | None:
        """(before, after, share between them); share lies beyond 0..1 where the ends are carried on."""
        if not self.samples:
            return None
        first, last = self.samples[0], self.samples[-1]
        if t_s >= last.t_s:
            return self._beyond(last, t_s)
        if t_s <= first.t_s:
            return self._beyond(first, t_s)
        for before, after in pairwise(reversed(self.samples)):
            if after.t_s <= t_s:
                return self._between(after, before, t_s)
        return None

    def _between(self, before: _Sample, after: _Sample, t_s: float) -> tuple[_Sample, _Sample, float] | None:
        gap_s = after.t_s - before.t_s
        if gap_s <= self._params.longest_gap_s:
            return before, after, (t_s - before.t_s) / gap_s
        nearer = before if t_s - before.t_s <= after.t_s - t_s else after
        return self._beyond(nearer, t_s)

    def _beyond(self, sample: _Sample, t_s: float) -> tuple[_Sample, _Sample, float] | None:
        if abs(t_s - sample.t_s) > self._params.longest_ahead_s:
            return None
        return sample, sample, 0.0


class PoseTrack:
    """Positions and attitudes, each with its own clock ticks, from one source.

    Positions are interpolated in a straight line, attitudes by slerp; beyond the newest sample a position is carried
    on with its velocity, an attitude stays, both for ``longest_ahead_s`` at most.
    """

    def __init__(self, params: TrackParams | None = None) -> None:
        self._params = params or TrackParams()
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._positions = _Series(self._params)
        self._attitudes = _Series(self._params)
        self._doubted: list[_Sample] = []
        self._reckoned: _Sample | None = None
        """Where the vehicle is by the velocities that it has told since its position is doubted."""

    @property
    def position_t_mono_s(self) -> float | None:
        """Of the newest position that was believed."""
        return self._positions.newest_t_s

    def heading_at(self, t_mono_s: float) -> float | None:
        """Clockwise from north, from attitudes alone; None while there is none for this moment."""
        around = self._attitudes.around(t_mono_s)
        if around is None:
            return None
        before, after, share = around
        return quaternions.heading(quaternions.rotation(quaternions.slerp(before.value, after.value, share)))

    @property
    def attitude_t_mono_s(self) -> float | None:
        """Of the newest attitude."""
        return self._attitudes.newest_t_s

    @property
    def is_doubting(self) -> bool:
        """The newest positions were refused because they jumped."""
        return bool(self._doubted)

    def add_position(
        self, t_mono_s: float, position_enu_m: ArrayLike, velocity_enu_m_s: ArrayLike | None = None
    ) -> Refused | None:
        """Take a position; the reason when it is refused, None when it is believed (or known already)."""
        p = np.array(position_enu_m, np.float64).reshape(3)
        v = None if velocity_enu_m_s is None else np.array(velocity_enu_m_s, np.float64).reshape(3)
        if not (math.isfinite(t_mono_s) and np.isfinite(p).all() and (v is None or np.isfinite(v).all())):
            return "not finite"
        sample, samples = _Sample(t_mono_s, p, v), self._positions.samples
        if not samples:
            self._positions.add(sample)
            return None
        if t_mono_s <= samples[-1].t_s:
            return None if t_mono_s == samples[-1].t_s and np.array_equal(p, samples[-1].value) else "out of order"
        is_back = self._is_back(samples[-1], sample) if self._doubted else self._is_plausible(samples[-1], sample)
        if is_back:
            self._doubted.clear()
            self._positions.add(sample)
            return None
        return self._doubt(sample)

    def add_attitude(self, t_mono_s: float, q_enu_body: ArrayLike) -> Refused | None:
        """Take a unit quaternion (w, x, y, z); the reason when it is refused."""
        q = np.array(q_enu_body, np.float64).reshape(4)
        length = float(np.linalg.norm(q))
        if not (math.isfinite(t_mono_s) and math.isfinite(length) and length > 0):
            return "not finite"
        samples = self._attitudes.samples
        if samples and t_mono_s <= samples[-1].t_s:
            return None if t_mono_s == samples[-1].t_s else "out of order"
        self._attitudes.add(_Sample(t_mono_s, q / length))
        return None

    def at(self, t_mono_s: float) -> Pose | Missing:
        """The pose at that moment, or why there is none."""
        position, attitude = self._positions.around(t_mono_s), self._attitudes.around(t_mono_s)
        if position is None:
            return "position too far in time" if self._positions.samples else "no position"
        if attitude is None:
            return "attitude too far in time" if self._attitudes.samples else "no attitude"
        p, v = _position_between(*position, t_mono_s)
        before, after, share = attitude
        return Pose(t_mono_s, p, v, quaternions.slerp(before.value, after.value, share))

    def _is_plausible(self, old: _Sample, new: _Sample) -> bool:
        """While positions are doubted the vehicle is not believed to have become fast: a glitch would wait that out."""
        speed = self._params.largest_speed_m_s
        if self._doubted and old.rate is not None:
            speed = min(speed, float(np.linalg.norm(old.rate)) + DOUBTED_FASTER_M_S)
        allowed_m = speed * min(new.t_s - old.t_s, self._params.settle_s) + self._params.slack_m
        return float(np.linalg.norm(new.value - old.value)) <= allowed_m

    def _is_back(self, old: _Sample, new: _Sample) -> bool:
        """Where it must have flown to: a glitch would wait out any circle that grows around the last place."""
        reckoned = self._reckoned
        if reckoned is None or new.rate is None:
            return self._is_plausible(old, new)
        there = reckoned.value + new.rate * (new.t_s - reckoned.t_s)
        self._reckoned = _Sample(new.t_s, there)
        allowed_m = DOUBTED_FASTER_M_S * min(new.t_s - old.t_s, self._params.settle_s) + self._params.slack_m
        return float(np.linalg.norm(new.value - there)) <= allowed_m

    def _doubt(self, sample: _Sample) -> Refused | None:
        """A jump: refused until the new place has been consistent with itself for long enough."""
        doubted, last = self._doubted, self._positions.samples[-1]
        if not doubted:
            told = sample.rate is not None and last.rate is not None
            there = last.value if sample.rate is None else last.value + sample.rate * (sample.t_s - last.t_s)
            self._reckoned = _Sample(sample.t_s, there) if told else None
        if doubted and not self._is_plausible(doubted[-1], sample):
            doubted.clear()
        doubted.append(sample)
        if len(doubted) > 2:
            del doubted[1:-1]  # its begin and its newest are all that count
        if sample.t_s - doubted[0].t_s < self._params.settle_s:
            return "position jumped"
        self._positions.samples.clear()
        self._positions.add(sample)
        doubted.clear()
        return None


def _position_between(before: _Sample, after: _Sample, share: float, t_s: float) -> tuple[F64, F64]:
    """(position, velocity)"""
    still = np.zeros(3)
    if before is after:
        v = still if before.rate is None else before.rate
        return before.value + v * (t_s - before.t_s), v
    straight = (after.value - before.value) / (after.t_s - before.t_s)
    if before.rate is None or after.rate is None:
        return before.value + share * (after.value - before.value), straight
    return before.value + share * (after.value - before.value), before.rate + share * (after.rate - before.rate)
