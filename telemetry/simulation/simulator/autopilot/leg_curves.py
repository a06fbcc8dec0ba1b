"""The target on a mission's legs: S-curves that join at corners, as ArduCopter flies them.

The same model predicts durations (``planning.flight_time``); here it also says where the target is.
"""

from __future__ import annotations

import math

import numpy as np

from planning.flight_time.scurve import Axes, Leg, leg, overlap_s
from telemetry.simulation.simulator.neu_frame import Vec3

Motion = tuple[Vec3, Vec3, Vec3]
"""Position, velocity, acceleration."""
REST: Vec3 = (0.0, 0.0, 0.0)
SHORTEST_M = 1e-6


class LegTrack:
    """Flies from a place at rest through one waypoint after the other.

    ``advance`` moves along; when ``passed`` says that the target is through the waypoint (half way
    through its corner), ``go_on`` takes the next one.
    """

    def __init__(self, start_neu: Vec3, radius_m: float) -> None:
        self._radius_m = radius_m
        self._origin = self._end = start_neu
        self._before: tuple[Leg | None, float] = (None, 0.0)
        self._leg: Leg | None = None
        self._next: Leg | None = None
        self._t_s = 0.0
        self._overlap_s = 0.0

    def go_on(self, goal_neu: Vec3, axes: Axes, following: tuple[Vec3, Axes] | None) -> None:
        """The next waypoint, and the one after it if the corner between them may be cut."""
        joined_s, t_s = self._overlap_s, self._t_s
        self._before = (self._leg, t_s) if joined_s > 0 else (None, 0.0)
        self._t_s = t_s - (self._duration_s() - joined_s) if joined_s > 0 else 0.0
        self._origin, self._end = self._end, goal_neu
        self._leg = _leg(self._origin, goal_neu, axes)
        self._next = _leg(goal_neu, *following) if following and self._leg else None
        self._overlap_s = 0.0
        if self._leg and self._next:
            self._overlap_s = overlap_s(self._leg, self._next, axes, radius_m=self._radius_m)

    def advance(self, dt_s: float) -> None:
        self._t_s += dt_s
        before, before_t_s = self._before
        if before:
            self._before = (before, before_t_s + dt_s) if before_t_s < before.duration_s else (None, 0.0)

    @property
    def passed(self) -> bool:
        return self._t_s >= self._duration_s() - self._overlap_s / 2

    def target(self) -> Motion:
        """Position, velocity and acceleration of the target now."""
        p, v, a = self._origin, REST, REST
        p, v, a = _plus((p, v, a), self._leg, self._t_s)
        before, before_t_s = self._before
        if before:
            p, v, a = _plus((p, v, a), before, before_t_s, from_end=True)
        if self._next and self._overlap_s > 0:
            p, v, a = _plus((p, v, a), self._next, self._t_s - (self._duration_s() - self._overlap_s))
        return p, v, a

    def _duration_s(self) -> float:
        return self._leg.duration_s if self._leg else 0.0


def _leg(start_neu: Vec3, end_neu: Vec3, axes: Axes) -> Leg | None:
    delta = np.subtract(end_neu, start_neu)
    return leg(delta, axes) if math.hypot(*delta.tolist()) > SHORTEST_M else None


def _plus(motion: Motion, this: Leg | None, t_s: float, *, from_end: bool = False) -> Motion:
    """A motion with what a leg adds to it after ``t_s``, counted from the leg's end if asked."""
    if this is None or t_s <= 0:
        return motion
    x, v, a = along(this, t_s)
    if from_end:
        x -= along(this, this.duration_s)[0]
    d = this.direction
    p0, v0, a0 = motion
    return (
        (p0[0] + d[0] * x, p0[1] + d[1] * x, p0[2] + d[2] * x),
        (v0[0] + d[0] * v, v0[1] + d[1] * v, v0[2] + d[2] * v),
        (a0[0] + d[0] * a, a0[1] + d[1] * a, a0[2] + d[2] * a),
    )


def along(this: Leg, t_s: float) -> tuple[float, float, float]:
    """Distance, speed and acceleration on a leg, ``t_s`` after its start."""
    rise, cruise_s = this.rise, this.cruise_s
    if t_s <= rise.duration_s:
        return rise.at(max(t_s, 0.0))
    if t_s <= rise.duration_s + cruise_s:
        return rise.distance_m + rise.speed_m_s * (t_s - rise.duration_s), rise.speed_m_s, 0.0
    x, v, a = rise.at(max(this.duration_s - t_s, 0.0))
    return 2 * rise.distance_m + rise.speed_m_s * cruise_s - x, v, -a
