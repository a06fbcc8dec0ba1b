"""The simulated autopilot's AUTO mode: flies the mission on board."""

from __future__ import annotations

import math
from typing import Literal

from telemetry.simulation.simulator.autopilot.flight_modes import (
    TAKEN_OFF_M,
    Hold,
    Landing,
    Path,
    Return,
    Stage,
    shaped_from,
    step_towards,
)
from telemetry.simulation.simulator.autopilot.leg_curves import Motion
from telemetry.simulation.simulator.autopilot.mission_steps import NAMES, Step
from telemetry.simulation.simulator.autopilot.pilot import Reached, SimulatedPilot
from telemetry.simulation.simulator.neu_frame import Vec3

MissionState = Literal["not_started", "active", "paused", "complete"]
FASTER = ("waypoint", "loiter", "loiter_time")
"""A corner before these may be cut; before the others the vehicle stops."""
TURN_FROM_M = 0.3


class Auto:
    name, needs_position, armable = "AUTO", True, False

    def __init__(self) -> None:
        self.stage: Stage = "ground"
        self.state: MissionState = "not_started"
        self._step = Step("home")
        self._path: Path | None = None
        self._other: Hold | Landing | Return | None = None
        self._goal: Vec3 = (0.0, 0.0, 0.0)
        self.goal: Vec3 | None = None
        self._left_s = 0.0
        self._joined = False
        self._cleared = False

    def enter(self, pilot: SimulatedPilot) -> str | None:
        """Goes on where the mission broke off; from its beginning when it had ended or MIS_RESTART says so."""
        mission = pilot.mission
        if len(mission.steps) < 2:
            return "init failed"
        if self.state == "complete" or pilot.parameters["MIS_RESTART"] == 1:
            mission.restart()
        first = mission.peek_move(max(1, mission.current))
        if not pilot.flying and (first is None or mission.steps[first].kind != "takeoff"):
            pilot.say(2, "Auto: Missing Takeoff Cmd")
            return "init failed"
        self._path = None
        self._other = None
        self._cleared = pilot.flying
        self.stage = "flight" if pilot.flying else "ground"
        self.state = "active"
        if pilot.flying:
            self._begin(pilot, max(1, mission.current))
        return None

    def clear_to_start(self, pilot: SimulatedPilot) -> None:
        """The pilot's word that the vehicle may leave the ground."""
        if not self._cleared:
            self._cleared = True
            self._begin(pilot, max(1, pilot.mission.current))

    def pause(self, pilot: SimulatedPilot) -> bool:
        if self._path is None or self._other:
            return False
        self._path.paused, self.state = True, "paused"
        return True

    def go_on(self) -> bool:
        if self._path is None or self._other:
            return False
        self._path.paused, self.state = False, "active"
        return True

    def jump_to(self, pilot: SimulatedPilot, seq: int) -> None:
        """The mission's current step was set from outside while it is being flown."""
        if pilot.flying:
            self._path = None
            self.state = "active"
            self._begin(pilot, seq)

    def update(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        if self._other:
            motion = self._other.update(pilot, dt_s)
            self.stage, self.goal = self._other.stage, self._other.goal
            return motion
        if not pilot.flying:
            self._shaped = shaped_from(pilot)
            return pilot.target
        if self._step.kind == "takeoff":
            return self._take_off(pilot, dt_s)
        return self._follow(pilot, dt_s)

    def _take_off(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        motion = step_towards(self._shaped, self._goal, pilot, dt_s)
        if abs(self._goal[2] - motion[0][2]) < TAKEN_OFF_M:
            self._done(pilot)
        return motion

    def _follow(self, pilot: SimulatedPilot, dt_s: float) -> Motion:
        assert self._path is not None
        motion = self._path.update(pilot, dt_s)
        if self._path.passed and (self._joined or pilot.near(self._goal)):
            self._left_s -= dt_s
            if self._left_s <= 0:
                self._done(pilot)
        return motion

    def _done(self, pilot: SimulatedPilot) -> None:
        at = pilot.mission.current
        pilot.tell(Reached(at))
        if self._step.kind != "takeoff":
            pilot.say(6, f"Reached command #{at}")
        self._begin(pilot, at + 1)

    def _begin(self, pilot: SimulatedPilot, start: int) -> None:
        found, settings = pilot.mission.next_move(start)
        pilot.facing_fixed = False
        for step in settings:
            pilot.apply(step)
        if found is None:
            self._end(pilot)
            return
        step = pilot.mission.steps[found]
        pilot.mission.current, self._step = found, step
        pilot.say(6, f"Mission: {found} {NAMES[step.kind]}")
        if step.kind == "takeoff":
            self._start_climb(pilot, step)
        elif step.kind in ("return", "land"):
            self._start_end(pilot, step)
        else:
            self._start_leg(pilot, found, step)

    def _start_climb(self, pilot: SimulatedPilot, step: Step) -> None:
        self.stage = "takeoff"
        self._shaped = shaped_from(pilot)
        n, e, u = pilot.p_neu
        self.goal = self._goal = (n, e, max(u, pilot.place(step)[2]))

    def _start_end(self, pilot: SimulatedPilot, step: Step) -> None:
        if step.kind == "return":
            pilot.forget_speeds()  # the mission's do not hold on the way home: recorded
            self._other = Return()
            self._other.enter(pilot)
        else:
            self._other = Landing()
            self._other.over(pilot, pilot.place(step))

    def _start_leg(self, pilot: SimulatedPilot, at: int, step: Step) -> None:
        if self._path is None:
            self._path = Path(pilot)
        self.stage = "flight"
        self.goal = self._goal = pilot.place(step) if step.kind != "delay" else self._path.start_neu
        self._left_s = math.inf if step.kind == "loiter" else step.seconds
        following = pilot.mission.peek_move(at + 1)
        after = pilot.mission.steps[following] if following is not None else None
        axes = pilot.axes(pilot.speed_m_s)
        if after is None or self._left_s > 0 or after.kind not in FASTER:
            after = None
        self._joined = after is not None
        self._path.go_on(self._goal, axes, (pilot.place(after), axes) if after else None)
        if int(pilot.parameters["WP_YAW_BEHAVIOR"]) > 0 and not pilot.facing_fixed:
            pilot.face(self._goal, at_least_m=TURN_FROM_M)

    def _end(self, pilot: SimulatedPilot) -> None:
        """Nothing left to do: stay."""
        self.state = "complete"
        self._other = Hold("AUTO", armable=False)
        self._other.enter(pilot)
