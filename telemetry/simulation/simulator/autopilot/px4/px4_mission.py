"""The simulated PX4's MISSION: its navigator, item after item."""

from __future__ import annotations

import math
from typing import Literal

from telemetry.simulation.simulator.autopilot.mission_steps import Step
from telemetry.simulation.simulator.autopilot.pilot import Reached
from telemetry.simulation.simulator.autopilot.px4.px4_flying import Px4Flying
from telemetry.simulation.simulator.autopilot.px4.px4_modes import Px4Landing, Stage
from telemetry.simulation.simulator.neu_frame import Vec3

MissionState = Literal["not_started", "active", "paused", "complete"]
FLOWN_THROUGH = ("takeoff", "waypoint", "loiter", "loiter_time")
"""Places that the trajectory looks ahead to."""


class MissionMode:
    name = "MISSION"

    def __init__(self) -> None:
        self.stage: Stage = "ground"
        self.state: MissionState = "not_started"
        self.goal: Vec3 | None = None
        self._step = Step("nothing")
        self._points: tuple[Vec3, Vec3, Vec3] | None = None
        self._climb: Vec3 | None = None
        """Straight up first, to the height of what comes next."""
        self._landing: Px4Landing | None = None
        self._arrived_s: float | None = None

    def enter(self, pilot: Px4Flying) -> str | None:
        if not pilot.mission.steps:
            return "no mission"
        if self.state == "complete" or pilot.mission.current >= len(pilot.mission.steps):
            pilot.mission.restart()
        self._points = self._climb = self._landing = None
        self.stage = "flight" if pilot.flying else "ground"
        self.state = "active" if pilot.armed else "not_started"
        if pilot.armed:
            self.begin(pilot)
        return None

    def leave(self) -> None:
        if self.state == "active":
            self.state = "paused"

    def begin(self, pilot: Px4Flying) -> None:
        """It is armed: it takes off, or goes on where it was."""
        self.state = "active"
        pilot.say(6, "Executing Mission")
        self._begin(pilot, pilot.mission.current, anew=True)

    def jump_to(self, pilot: Px4Flying, seq: int) -> None:
        self._begin(pilot, seq)

    def update(self, pilot: Px4Flying, dt_s: float) -> None:
        if self._landing is not None:
            self._landing.update(pilot, dt_s)
        elif self._climb is not None:
            pilot.climb_to(self._climb, dt_s)
            if pilot.p_neu[2] > self._climb[2] - self._height_radius_m(pilot):
                self._climbed(pilot)
        elif self._points is not None:
            pilot.fly_towards(self._points, dt_s)
            self._look(pilot)

    def _height_radius_m(self, pilot: Px4Flying) -> float:
        return pilot.parameters["NAV_MC_ALT_RAD"]

    def _climbed(self, pilot: Px4Flying) -> None:
        climb, self._climb = self._climb, None
        assert climb is not None
        if self._step.kind == "takeoff":
            self._done(pilot)
        else:
            self._fly_leg(pilot, climb)

    def _look(self, pilot: Px4Flying) -> None:
        """Whether the place is reached, and long enough ago."""
        if self.goal is None or not (pilot.is_at(self.goal) or self._arrived_s is not None):
            return
        if self._step.kind == "land":
            self._land(pilot)
            return
        arrived_s = self._arrived_s = pilot.now_s if self._arrived_s is None else self._arrived_s
        if pilot.now_s - arrived_s >= (math.inf if self._step.kind == "loiter" else self._step.seconds):
            self._done(pilot)

    def _land(self, pilot: Px4Flying) -> None:
        self._landing, self.stage = Px4Landing(self.goal), "landing"
        self._landing.enter(pilot)

    def landed(self, pilot: Px4Flying) -> None:
        """By its own last item."""
        pilot.tell(Reached(pilot.mission.current))
        self.state = "complete"

    def _done(self, pilot: Px4Flying) -> None:
        at = pilot.mission.current
        pilot.tell(Reached(at))
        self._begin(pilot, at + 1)

    def _begin(self, pilot: Px4Flying, start: int, *, anew: bool = False) -> None:
        mission = pilot.mission
        found, settings = mission.next_move(start)
        for step in settings:
            pilot.apply(step)
        if settings:
            pilot.tell(Reached(start + len(settings) - 1))
        if found is None:
            self._end(pilot)
            return
        before = self.goal or pilot.p_neu
        mission.current, self._step = found, mission.steps[found]
        self._arrived_s = None
        kind = self._step.kind
        if kind == "return":
            pilot.tell(Reached(found))
            self._end(pilot)
            pilot.say(6, "Returning to launch")
            pilot.change_mode("RTL")
        elif (anew and self._needs_climb(pilot)) or kind == "takeoff":
            self._start_climb(pilot)
        else:
            self._fly_leg(pilot, pilot.p_neu if anew else before)

    def _needs_climb(self, pilot: Px4Flying) -> bool:
        below_m = self._place(pilot, self._step)[2] - pilot.p_neu[2]
        return not pilot.flying or below_m >= self._height_radius_m(pilot)

    def _start_climb(self, pilot: Px4Flying) -> None:
        up_m = max(self._place(pilot, self._step)[2], pilot.home_neu[2] + pilot.parameters["MIS_TAKEOFF_ALT"])
        self.stage = "takeoff"
        self.goal = self._climb = (*pilot.p_neu[:2], max(up_m, pilot.p_neu[2]))
        pilot.say(6, f"Climb to {up_m - pilot.home_neu[2]:.1f} meters above home")

    def _fly_leg(self, pilot: Px4Flying, before: Vec3) -> None:
        self.stage = "flight"
        goal = self._place(pilot, self._step)
        if self._step.kind == "land":
            goal = (*goal[:2], pilot.p_neu[2])
        self.goal = goal
        self._points = (before, goal, self._after(pilot) or goal)
        pilot.face(goal, at_least_m=pilot.parameters["NAV_ACC_RAD"])

    def _after(self, pilot: Px4Flying) -> Vec3 | None:
        """Where it goes on to, if it does so without waiting."""
        if self._step.kind in ("land", "loiter", "delay") or self._step.seconds > 0:
            return None
        following = pilot.mission.peek_move(pilot.mission.current + 1)
        step = pilot.mission.steps[following] if following is not None else None
        return self._place(pilot, step) if step is not None and step.kind in FLOWN_THROUGH else None

    def _place(self, pilot: Px4Flying, step: Step) -> Vec3:
        return self.goal or pilot.p_neu if step.kind == "delay" else pilot.place(step)

    def _end(self, pilot: Px4Flying) -> None:
        self.state = "complete"
        if self._points is not None:
            self._points = (self._points[0], self._points[1], self._points[1])
        pilot.say(6, "Mission finished, loitering")
