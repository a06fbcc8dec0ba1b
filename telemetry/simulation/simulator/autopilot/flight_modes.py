"""What the simulated autopilot does in each of its flight modes but AUTO."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Literal, Protocol

from planning.flight_time.scurve import Axes
from telemetry.simulation.simulator.autopilot.leg_curves import REST, LegTrack, Motion
from telemetry.simulation.simulator.autopilot.pilot import SimulatedPilot
from telemetry.simulation.simulator.autopilot.shaping import BRAKING_SHARE, Shaped, approach_speed, stopping_point
from telemetry.simulation.simulator.neu_frame import Vec3

Stage = Literal["ground", "takeoff", "flight", "landing"]
LOWEST_RETURN_M = 2.0
SLOPE_FROM = 0.5
"""RTL_CONE_SLOPE below this is none."""
TAKEN_OFF_M = 0.02
PAUSE_SHARE = 0.6
"""Deceleration of a pause over the highest acceleration."""
SLOWEST_PAUSED_M_S = 0.5
STRAIGHT_LEGS = 64
"""GUID_OPTIONS: places of GUIDED are flown to as waypoints are, in a straight line."""


class Mode(Protocol):
    name: str
    needs_position: bool
    armable: bool
    stage: Stage
    goal: Vec3 | None
    """Where it is going."""

    def enter(self, pilot: SimulatedPilot) -> str | None:
        """Why the mode cannot be had now, or None."""
        ...

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        """The target after one more step."""
        ...


class Stabilize:
    """Nobody holds the sticks, so it stays on the ground."""

    name, needs_position, armable = "STABILIZE", False, True
    stage: Stage = "ground"
    goal: Vec3 | None = None

    def enter(self, pilot: SimulatedPilot) -> str | None:
        return "no RC receiver" if pilot.flying else None

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        return pilot.target


class Hold:
    """LOITER and BRAKE: stop, then stay."""

    needs_position = True

    def __init__(self, name: str, *, armable: bool) -> None:
        self.name, self.armable = name, armable
        self.stage: Stage = "flight"

    def enter(self, pilot: SimulatedPilot) -> str | None:
        self.stage = "flight" if pilot.flying else "ground"
        self._shaped = shaped_from(pilot)
        self._place: Vec3 | None = None
        self.goal: Vec3 | None = None
        return None

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        if self._place is None:
            if self.name == "BRAKE":
                self._shaped.brake(pilot.axes(), dt_s)
            else:
                self._shaped.stop(pilot.axes(), dt_s)
            if self._shaped.at_rest:
                self.goal = self._place = self._shaped.p_neu
            return self._shaped.motion
        return step_towards(self._shaped, self._place, pilot, dt_s)


class Guided:
    """Goes where it is told."""

    name, needs_position, armable = "GUIDED", True, True

    def enter(self, pilot: SimulatedPilot) -> str | None:
        self.stage: Stage = "flight" if pilot.flying else "ground"
        self._shaped = shaped_from(pilot)
        self._stopping = Hold(self.name, armable=True)
        self._stopping.enter(pilot)
        self._place: Vec3 | None = None
        self._path: Path | None = None
        self._velocity_neu: Vec3 | None = None
        self._told_s = 0.0
        self._sent: Literal["", "places", "velocities", "both"] = ""
        """What it is led by; nothing while it takes off or stops."""
        self.goal: Vec3 | None = None
        return None

    def take_off(self, pilot: SimulatedPilot, up_m: float) -> None:
        """``up_m``: height in the frame."""
        self.stage = "takeoff"
        self._path, self._velocity_neu, self._sent = None, None, ""
        self.goal = self._place = (pilot.p_neu[0], pilot.p_neu[1], up_m)

    def go_to(self, pilot: SimulatedPilot, goal_neu: Vec3) -> None:
        self._begin(pilot, "places")
        self._velocity_neu, self._path = None, self._leg(pilot, goal_neu)
        self.goal = self._place = goal_neu
        self.stage = "flight"

    def fly_at(self, pilot: SimulatedPilot, v_neu: Vec3) -> None:
        """At this velocity, until it has not been told again for too long."""
        self._begin(pilot, "velocities")
        self._velocity_neu, self._told_s = v_neu, pilot.now_s
        self.goal = self._place = self._path = None
        self.stage = "flight"

    def follow(self, pilot: SimulatedPilot, goal_neu: Vec3, v_neu: Vec3) -> None:
        """After this place, which moves on at this velocity until it has not been told again for too long."""
        self._begin(pilot, "both")
        self._velocity_neu, self._told_s, self._path = v_neu, pilot.now_s, None
        self.goal = self._place = goal_neu
        self.stage = "flight"

    def _begin(self, pilot: SimulatedPilot, by: Literal["places", "velocities", "both"]) -> None:
        """What was set before the first of a kind is forgotten, and the vehicle's own speeds count, over ground and up:
        recorded for places."""
        if self._sent != by:
            pilot.forget_speeds()
            self._sent = by
        self._shaped = shaped_from(pilot)

    def _leg(self, pilot: SimulatedPilot, goal_neu: Vec3) -> Path | None:
        if not int(pilot.parameters["GUID_OPTIONS"]) & STRAIGHT_LEGS:
            return None
        path = Path(pilot)
        path.go_on(goal_neu, pilot.axes(pilot.speed_m_s), None)
        return path

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        if not pilot.flying:
            self._shaped = Shaped(pilot.p_neu)
            return pilot.target
        if self._velocity_neu is not None:
            told = pilot.now_s - self._told_s <= pilot.parameters["GUID_TIMEOUT"]
            return self._moved(pilot, self._velocity_neu if told else REST, dt_s)
        if self._path is not None:
            return self._path.update(pilot, dt_s)
        if self._place is None:
            motion = self._stopping.update(pilot, dt_s)
            self._shaped = shaped_from(pilot)
            return motion
        motion = step_towards(self._shaped, self._place, pilot, dt_s)
        if self.stage == "takeoff" and abs(self._place[2] - motion[0][2]) < TAKEN_OFF_M:
            self.stage = "flight"
        return motion

    def _moved(self, pilot: SimulatedPilot, v_neu: Vec3, dt_s: float) -> Motion:
        """At a velocity, or after a place that has it."""
        axes = pilot.axes(pilot.speed_m_s)
        if self._place is None:
            self._shaped.moving(v_neu, axes, dt_s)
            return self._shaped.motion
        self._shaped.following(self._place, v_neu, axes, dt_s)
        n, e, u = self._place
        self.goal = self._place = (n + v_neu[0] * dt_s, e + v_neu[1] * dt_s, u + v_neu[2] * dt_s)
        return self._shaped.motion


class Landing:
    """Down here, slowly on the last metres."""

    name, needs_position, armable = "LAND", False, False

    def enter(self, pilot: SimulatedPilot) -> str | None:
        self.stage: Stage = "landing" if pilot.flying else "ground"
        self._shaped = shaped_from(pilot)
        self._over = stopping_point(self._shaped, pilot.axes())
        self.goal: Vec3 | None = None
        return None

    def over(self, pilot: SimulatedPilot, place_neu: Vec3) -> None:
        """Land at a place straight below or nearly so."""
        self.enter(pilot)
        self._over = place_neu

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        axes = pilot.axes()
        slow_m_s, low_m = pilot.parameters["LAND_SPEED"] / 100, pilot.parameters["LAND_ALT_LOW"] / 100
        fast_m_s = pilot.parameters["LAND_SPEED_HIGH"] / 100 or axes.descent_m_s
        above_m = max(0.0, self._shaped.p_neu[2] - pilot.home_neu[2] - low_m)
        speed = min(fast_m_s, max(slow_m_s, approach_speed(above_m, BRAKING_SHARE * axes.vertical_accel_m_s2)))
        self._shaped.sinking(self._over, speed, replace(axes, descent_m_s=speed), dt_s)
        return self._shaped.motion


class Return:
    """Climb, fly home straight, wait, land: RTL, and AUTO's return."""

    name, needs_position, armable = "RTL", True, False

    def enter(self, pilot: SimulatedPilot) -> str | None:
        self._land: Landing | None = None
        self._wait_s = pilot.parameters["RTL_LOIT_TIME"] / 1000
        self.stage: Stage = "flight" if pilot.flying else "ground"
        axes = pilot.axes(pilot.parameters["RTL_SPEED"] / 100 or None)
        self._path = Path(pilot)
        n, e, _ = self._path.start_neu
        home_n, home_e, home_u = pilot.home_neu
        up = home_u + self._height_m(pilot)
        self._goals = [(n, e, up), (home_n, home_e, up)]
        self.goal: Vec3 | None = self._goals[0]
        self._path.go_on(self._goals[0], axes, (self._goals[1], axes))
        self._axes = axes
        return None

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        if self._land:
            return self._land.update(pilot, dt_s)
        motion = self._path.update(pilot, dt_s)
        if self._path.passed and len(self._goals) == 2:
            self._goals.pop(0)
            self.goal = self._goals[0]
            self._path.go_on(self._goals[0], self._axes, None)
            if int(pilot.parameters["WP_YAW_BEHAVIOR"]) == 1:
                pilot.face(self._goals[0])
        elif self._path.passed and pilot.near(self._goals[0]):
            self._wait_s -= dt_s
            if self._wait_s <= 0:
                self._descend(pilot)
        return motion

    def _descend(self, pilot: SimulatedPilot) -> None:
        self._land = Landing()
        self._land.over(pilot, pilot.home_neu)
        self.stage = self._land.stage

    def _height_m(self, pilot: SimulatedPilot) -> float:
        """Above home: RTL_ALT, less within the cone around home or below a ceiling, never below where it is."""
        p = pilot.parameters
        now_m = max(0.0, self._path.start_neu[2] - pilot.home_neu[2])
        climbed_m = now_m + p["RTL_CLIMB_MIN"] / 100
        height_m = max(climbed_m, p["RTL_ALT"] / 100, LOWEST_RETURN_M)
        if (slope := p["RTL_CONE_SLOPE"]) >= SLOPE_FROM:
            away_m = math.dist(self._path.start_neu[:2], pilot.home_neu[:2])
            height_m = min(height_m, max(away_m * slope, climbed_m, LOWEST_RETURN_M))
        return max(min(height_m, pilot.fence.highest_return_m), now_m)


class Path:
    """A track that a moving vehicle joins: what it brings along of place and speed fades away."""

    def __init__(self, pilot: SimulatedPilot) -> None:
        shaped = shaped_from(pilot)
        self.start_neu = s = stopping_point(shaped, pilot.axes())
        self._track = LegTrack(s, pilot.parameters["WPNAV_RADIUS"] / 100)
        p = shaped.p_neu
        self._offset = Shaped((p[0] - s[0], p[1] - s[1], p[2] - s[2]), shaped.v_neu, shaped.accel_neu)
        self._arriving = True
        self._flow = 1.0
        self.paused = False
        self._axes = pilot.axes()

    @property
    def passed(self) -> bool:
        return self._track.passed

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        p, v, a = self._track.target()
        change = self._change_flow(math.hypot(*v), self._wanted_flow(pilot), pilot.axes().accel_m_s2, dt_s)
        self._track.advance(dt_s * self._flow * _scale(p, v, pilot.p_neu))
        p, v, a = self._track.target()
        (op, ov, oa), f = self._fade(pilot, dt_s), self._flow
        return (
            (p[0] + op[0], p[1] + op[1], p[2] + op[2]),
            (v[0] * f + ov[0], v[1] * f + ov[1], v[2] * f + ov[2]),
            (
                a[0] * f * f + v[0] * change + oa[0],
                a[1] * f * f + v[1] * change + oa[1],
                a[2] * f * f + v[2] * change + oa[2],
            ),
        )

    def go_on(self, goal_neu: Vec3, axes: Axes, following: tuple[Vec3, Axes] | None) -> None:
        """As ``Track.go_on``."""
        self._axes = axes
        self._track.go_on(goal_neu, axes, following)

    def _wanted_flow(self, pilot: SimulatedPilot) -> float:
        """Its time runs slower when its speed is lowered on the way; a higher one counts from the next leg on."""
        if self.paused:
            return 0.0
        return 1.0 if pilot.speed_m_s is None else min(1.0, pilot.speed_m_s / self._axes.speed_m_s)

    def _change_flow(self, speed_m_s: float, wanted: float, accel_m_s2: float, dt_s: float) -> float:
        """A paused track's time runs slower until it stands still. Returns the change per second."""
        before = self._flow
        step = dt_s * PAUSE_SHARE * accel_m_s2 / max(speed_m_s, SLOWEST_PAUSED_M_S)
        self._flow = max(wanted, before - step) if before > wanted else min(wanted, before + step)
        return (self._flow - before) / dt_s

    def _fade(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        """What is left of the motion that the vehicle came with."""
        if self._arriving:
            self._offset.stop(pilot.axes(), dt_s)
            self._arriving = not self._offset.at_rest
        else:
            self._offset.towards((0.0, 0.0, 0.0), pilot.axes(), dt_s)
        return self._offset.motion


def _scale(p: Vec3, v: Vec3, at: Vec3) -> float:
    """The target waits for a vehicle that falls behind by more than half a metre, in strong wind say."""
    speed = math.hypot(*v)
    if speed < 1e-3:
        return 1.0
    behind_m = ((p[0] - at[0]) * v[0] + (p[1] - at[1]) * v[1] + (p[2] - at[2]) * v[2]) / speed
    return max(0.1, min(1.0, 1.0 - (behind_m - 0.5) / 2))


def shaped_from(pilot: SimulatedPilot) -> Shaped:
    """A target that goes on from the present one, or stands where the vehicle stands."""
    return Shaped(*pilot.target) if pilot.flying else Shaped(pilot.p_neu)


def step_towards(shaped: Shaped, goal_neu: Vec3, pilot: SimulatedPilot, dt_s: float) -> Motion:
    shaped.towards(goal_neu, pilot.axes(pilot.speed_m_s), dt_s)
    return shaped.motion
