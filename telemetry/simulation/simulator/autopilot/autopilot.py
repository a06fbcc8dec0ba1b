"""The simulated autopilot: arming, modes, failsafes, and the demands that it makes of the airframe.

It flies by its estimate and knows neither the truth nor MAVLink. It behaves like ArduCopter as far as a
ground station can tell; ``tests/telemetry/test_simulator_agreement.py`` holds it to recorded flights.
"""

from __future__ import annotations

import math
from typing import Literal

from telemetry.simulation.simulator.airframe.dynamics import Demand
from telemetry.simulation.simulator.autopilot.auto import Auto
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.failsafe import BatteryFailsafe, FailsafeFinding, GcsFailsafe
from telemetry.simulation.simulator.autopilot.flight_modes import Guided, Hold, Landing, Mode, Return, Stabilize
from telemetry.simulation.simulator.autopilot.pilot import (
    AS_REAL_BOOT_S,
    Answer,
    HomeSet,
    Reached,
    Sensed,
    SimulatedPilot,
    StateChanged,
)
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3

ARMING_DELAY_S = 2.0
SPOOL_UP_S = 1.4
"""From a start allowed to lift-off."""
LANDED_AFTER_S = 2.1
REMIND_S = 30.0
HIGHEST_M = 10_000.0
STICKS_NEEDED = ("ALT_HOLD", "POSHOLD", "ACRO", "SPORT", "DRIFT")


class Autopilot(SimulatedPilot):
    """``update`` makes one step; the other methods are the commands that it takes between steps.

    Waits for people (DISARM_DELAY, FS_GCS_TIMEOUT) are counted in their time: simulated time over ``speedup``.
    """

    def __init__(
        self, frame: NeuFrame, parameters: Parameters, *, boot_s: float = AS_REAL_BOOT_S, speedup: float = 1.0
    ) -> None:
        super().__init__(frame, parameters, boot_s)
        self.auto = Auto()
        self.mode: Mode = Stabilize()
        self._speedup = speedup
        self._gcs, self._battery = GcsFailsafe(speedup), BatteryFailsafe()
        self._said: set[str] = set()
        self._armed_s = self._start_s = self._touched_s = self._idle_s = self._reminded_s = -math.inf

    @property
    def failsafe_active(self) -> bool:
        return self._gcs.active or self._battery.active

    @property
    def ready_to_arm(self) -> bool:
        """Whether the sensors allow arming in this mode."""
        return self.home_known and (self.position_ok or not self.mode.needs_position) and not self.crashed

    @property
    def stage(self) -> Literal["ground", "takeoff", "flight", "landing"]:
        return "ground" if not self.flying else self.mode.stage if self.mode.stage != "ground" else "flight"

    @property
    def goal_neu(self) -> Vec3 | None:
        return self.mode.goal

    def arm(self, *, force: bool = False) -> Answer:
        if self.armed:
            return "accepted"
        reason = self._why_not_arm()
        if reason and not (force and not self.crashed):
            self.say(2, f"Arm: {reason}")
            return "failed"
        self.armed = True
        self._armed_s = self._idle_s = self.now_s
        if not self.home_is_fixed:
            self._set_home()
        self.tell(StateChanged())
        self.say(6, "Arming motors")
        return "accepted"

    def disarm(self, *, force: bool = False) -> Answer:
        if self.flying and not force:
            return "failed"
        if self.armed:
            self._stop_motors()
            self.tell(StateChanged())
            self.say(6, "Disarming motors")
        return "accepted"

    def set_mode(self, name: str) -> Answer:
        """Change mode; says why not if it cannot be had."""
        if name == self.mode.name:
            return "accepted"
        mode = self._mode(name)
        if mode is None:
            reason = "no RC receiver" if name in STICKS_NEEDED else "not simulated"
        elif mode.needs_position and not self.position_ok and self.armed:
            reason = "requires position"
        else:
            reason = mode.enter(self)
        if mode is None or reason:
            self.say(4, f"Mode change to {name} failed: {reason}")
            return "failed"
        if self.mode is self.auto and self.auto.state == "active":
            self.auto.state = "paused"
        self.mode = mode
        self.forget_speeds()
        self.facing_fixed = False
        self._idle_s = self.now_s
        self.tell(StateChanged())
        return "accepted"

    def start_mission(self) -> Answer:
        if self.set_mode("AUTO") != "accepted":
            return "failed"
        self._start()
        return "accepted"

    def take_off(self, alt_rel_home_m: float) -> Answer:
        if not (isinstance(self.mode, Guided) and self.armed and not self.flying and 0 < alt_rel_home_m < HIGHEST_M):
            return "failed"
        self.mode.take_off(self, self.home_neu[2] + alt_rel_home_m)
        self._start()
        return "accepted"

    def go_to(self, goal_neu: Vec3, *, heading_rad: float | None = None) -> Answer:
        """Only in GUIDED, in the air, and within the fence."""
        if not isinstance(self.mode, Guided) or not self.flying or not self.fence.allows(goal_neu, self.home_neu):
            return "failed"
        self.mode.go_to(self, goal_neu)
        if heading_rad is not None:
            self.turn_to(heading_rad)
        elif int(self.parameters["WP_YAW_BEHAVIOR"]) > 0 and not self.facing_fixed:
            self.face(goal_neu, at_least_m=0.3)
        return "accepted"

    def follow(self, goal_neu: Vec3, v_neu: Vec3, *, heading_rad: float | None = None) -> Answer:
        """Only in GUIDED, in the air, and within the fence."""
        if not isinstance(self.mode, Guided) or not self.flying or not self.fence.allows(goal_neu, self.home_neu):
            return "failed"
        self.mode.follow(self, goal_neu, v_neu)
        return self._turned(heading_rad)

    def fly_at(self, v_neu: Vec3, *, heading_rad: float | None = None) -> Answer:
        """Only in GUIDED and in the air."""
        if not isinstance(self.mode, Guided) or not self.flying:
            return "failed"
        self.mode.fly_at(self, v_neu)
        return self._turned(heading_rad)

    def _turned(self, heading_rad: float | None) -> Answer:
        if heading_rad is not None:
            self.turn_to(heading_rad)
        return "accepted"

    def set_home(self, place_neu: Vec3 | None) -> Answer:
        """None: where it is, as high as it is."""
        if not (self.home_known and self.position_ok):
            return "failed"
        self.fix_home(self.p_neu if place_neu is None else place_neu)
        return "accepted"

    def set_current(self, seq: int) -> Answer:
        if not 0 <= seq < len(self.mission.steps):
            return "denied"
        self.mission.current = seq
        if self.auto.state == "complete":
            self.auto.state = "not_started"
        if self.mode is self.auto:
            self.auto.jump_to(self, seq)
        return "accepted"

    def pause(self) -> Answer:
        if isinstance(self.mode, Guided) and self.flying:
            self.mode.enter(self)
            return "accepted"
        return "accepted" if self.mode is self.auto and self.auto.pause(self) else "failed"

    def go_on(self) -> Answer:
        if isinstance(self.mode, Guided):
            return "accepted"
        return "accepted" if self.mode is self.auto and self.auto.go_on() else "failed"

    def gcs_heard(self) -> None:
        self._gcs.heard(self.now_s)

    def update(self, sensed: Sensed, dt_s: float) -> Demand | None:
        """What is asked of the airframe; None: motors off or idling."""
        self.now_s += dt_s
        self.p_neu, self.v_neu = sensed.p_neu, sensed.v_neu
        self._boot()
        self._keep_to_fence()
        if not self.armed:
            self.heading_goal_rad = sensed.heading_rad
            self._remind()
            return None
        self._watch(sensed)
        self._leave_ground()
        if not self.flying:
            self.heading_goal_rad = sensed.heading_rad
        self.target = self.mode.update(self, dt_s)
        if not self.flying:
            self._idle()
            return None
        if self._has_landed(sensed):
            return None
        tilt = math.radians(self.parameters["ANGLE_MAX"] / 100)
        return Demand(
            self.control.demand(self.target, self.p_neu, self.v_neu, tilt, dt_s), self.heading_goal_rad % (2 * math.pi)
        )

    def crash(self, reason: str) -> None:
        """The world's word that the vehicle has hit something."""
        self.crashed = True
        self._stop_motors()
        self.tell(StateChanged())
        self.say(0, reason)

    def repeat_prearm(self) -> None:
        """Say at the next step why arming would be refused."""
        self._reminded_s = -math.inf

    def _mode(self, name: str) -> Mode | None:
        if name == "AUTO":
            return self.auto
        made = {"STABILIZE": Stabilize, "GUIDED": Guided, "RTL": Return, "LAND": Landing}.get(name)
        if made:
            return made()
        return Hold(name, armable=name == "LOITER") if name in ("LOITER", "BRAKE") else None

    def _boot(self) -> None:
        if self.ready and "ready" not in self._said:
            self._said.add("ready")
            self.say(6, "ArduPilot Ready")
        if self.has_fix and not self.home_known:
            self.home_known = True
            self._set_home()
            self.say(6, "EKF3 IMU0 origin set")
            self.say(6, f"Field Elevation Set: {self.frame.alt_amsl_m:.0f}m")
        if self.position_ok and "position" not in self._said:
            self._said.add("position")
            self.say(6, "EKF3 IMU0 is using GPS")

    def _remind(self) -> None:
        reason = self._why_not_arm()
        if self.has_fix and reason and self.mode.armable and self.now_s - self._reminded_s > REMIND_S:
            self._reminded_s = self.now_s
            self.say(2, f"PreArm: {reason}")

    def _why_not_arm(self) -> str | None:
        if self.crashed:
            return "Vehicle has crashed: start the simulation again"
        if not self.mode.armable:
            return f"{self.mode.name} mode not armable"
        if not self.home_known or (self.mode.needs_position and not self.position_ok):
            return "Need Position Estimate"
        if (beyond := self.fence.why_not_arm()) is not None:
            return beyond
        return "Battery 1 low voltage failsafe" if self._battery.level > 1 else None

    def _set_home(self) -> None:
        self.home_neu = self.p_neu
        self.tell(HomeSet())

    def _start(self) -> None:
        """The vehicle may leave the ground."""
        if self.armed and not self.flying and self._start_s < self._armed_s:
            self._start_s = self.now_s
        if self.mode is self.auto and self.armed:
            self.auto.clear_to_start(self)

    def _leave_ground(self) -> None:
        if self.flying or self.mode.stage != "takeoff":
            return
        self._idle_s = self.now_s
        if self.now_s >= max(self._armed_s + ARMING_DELAY_S, self._start_s) + SPOOL_UP_S:
            self.flying = True
            self._touched_s = -math.inf
            self.control.reset()

    def _idle(self) -> None:
        delay_s = self.parameters["DISARM_DELAY"]
        if 0 < delay_s * self._speedup < self.now_s - self._idle_s:
            self.disarm()

    def _has_landed(self, sensed: Sensed) -> bool:
        if not sensed.touching or self.mode.stage != "landing":
            self._touched_s = -math.inf
            return False
        if self._touched_s == -math.inf:
            self._touched_s = self.now_s
        if self.now_s - self._touched_s < LANDED_AFTER_S:
            return False
        if self.mode is self.auto:
            self.tell(Reached(self.mission.current))
        self._stop_motors()
        self.say(6, "Disarming motors")
        return True

    def _stop_motors(self) -> None:
        """After a landing only the next heartbeat says so; the mission is back at its beginning by then."""
        self.armed = self.flying = False
        self._start_s = -math.inf
        self._touched_s = -math.inf
        if self.auto.state != "not_started":
            ended = self.mode is self.auto and self.auto.stage == "landing"
            self.auto.state = "complete" if ended or self.auto.state == "complete" else "not_started"
        self.mission.restart()
        if self.mode is not self.auto:
            self.mode.enter(self)

    def _watch(self, sensed: Sensed) -> None:
        battery = self._battery.check(
            self.parameters, sensed.voltage_v, sensed.used_mah, flying=self.flying, now_s=self.now_s
        )
        for finding in (self._gcs.check(self.parameters, self.now_s), battery):
            if finding:
                self._act(finding)

    def _keep_to_fence(self) -> None:
        """Looked at on the ground as well: it does not arm beyond its fence."""
        if not self.position_ok:
            return
        landing = not self.flying or self.mode.stage == "landing"
        news = self.fence.check(self.p_neu, self.home_neu, self.now_s, flying=self.flying, landing=landing)
        for text in news.texts:
            self.say(5, text)
        if news.modes and self.armed:
            if self.flying:
                any(self.set_mode(mode) == "accepted" for mode in news.modes)
            else:
                self.disarm()

    def _act(self, finding: FailsafeFinding) -> None:
        self.say(finding.severity, finding.text)
        if finding.takeover == "none":
            return
        if not self.flying:
            self.disarm()
        elif self.mode.stage != "landing":
            self.set_mode(finding.takeover)
