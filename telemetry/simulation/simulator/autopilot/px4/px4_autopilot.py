"""The simulated PX4: arming, modes, take-off and landing, and what it demands of the airframe.

It flies by its estimate and knows neither the truth nor MAVLink; ``tests/telemetry/test_px4_agreement.py`` holds it to
recorded flights of PX4 1.17.
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from telemetry.simulation.simulator.airframe.dynamics import Demand
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.pilot import AS_REAL_BOOT_S, Answer, HomeSet, Sensed, StateChanged
from telemetry.simulation.simulator.autopilot.px4.position_control import Px4PositionControl
from telemetry.simulation.simulator.autopilot.px4.px4_flying import Px4Flying
from telemetry.simulation.simulator.autopilot.px4.px4_mission import MissionMode
from telemetry.simulation.simulator.autopilot.px4.px4_modes import (
    Offboard,
    Px4Hold,
    Px4Landing,
    Px4Mode,
    Px4Return,
    Stage,
    Sticks,
    TakeOff,
)
from telemetry.simulation.simulator.autopilot.px4.smoothing import Turn
from telemetry.simulation.simulator.autopilot.px4.unrest import MovingHome, Unrest
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3

Verdict = Answer | Literal["rejected"]
RAMP = ((0.0, -2.4), (0.43, -0.05), (1.53, 1.5))
"""The fastest climb of the take-off's ramp, over MPC_TKO_RAMP_T, as recorded."""
SEEN_S = 1.0
"""From the ramp's beginning to "Takeoff detected"."""
LANDED_AFTER_S = 1.6
BY_HAND = ("MANUAL", "ALTCTL", "POSCTL", "ACRO", "STABILIZED")
GCS_LOST: dict[int, str] = {1: "HOLD", 2: "RTL", 3: "LAND"}
"""NAV_DLL_ACT"""


class Px4Pilot(Px4Flying):
    """``update`` makes one step; the other methods are the commands that it takes between steps."""

    def __init__(
        self,
        frame: NeuFrame,
        parameters: Parameters,
        *,
        boot_s: float = AS_REAL_BOOT_S,
        speedup: float = 1.0,
        seed: int = 0,
        home_moves: bool = False,
    ) -> None:
        super().__init__(frame, parameters, boot_s)
        shaken, moved = np.random.SeedSequence(seed).spawn(2)
        self.missions = MissionMode()
        self.mode: Px4Mode = Px4Hold()
        self.mode.enter(self)
        self.control = Px4PositionControl(parameters)
        self._turn = Turn()
        self._unrest = Unrest(np.random.default_rng(shaken))
        self._moving_home = MovingHome(np.random.default_rng(moved), is_on=home_moves)
        self._speedup = speedup
        self._chosen = "HOLD"
        """To which it falls back when its motors are off."""
        self._armed_s = self._ramp_s = self._touched_s = self._landed_s = self._gcs_s = -math.inf
        self._gcs_lost = self._ready_said = False
        self.checks_asked = 0
        """How often somebody wanted to know what keeps it from arming."""
        self.is_in_air = False
        """Its take-off has been detected, its landing not yet."""

    # What is told of it.

    @property
    def failsafe_active(self) -> bool:
        return self._gcs_lost or self.fence.acts

    @property
    def ready_to_arm(self) -> bool:
        return self._why_not_arm() is None

    @property
    def failing_checks(self) -> tuple[str, ...]:
        """The names of the events that say what keeps it from arming."""
        failing = [] if self.position_ok else ["check_modes_global_pos"]
        if not self.armed and self.mode.name in ("LAND", "RTL", *BY_HAND):
            failing.append("check_modes_cannot_takeoff")
        if not self.mission.steps:
            failing.append("check_modes_mission")
        return tuple(failing)

    @property
    def stage(self) -> Stage:
        if not self.is_in_air:
            return "ground" if not self.flying else "takeoff"
        return self.mode.stage if self.mode.stage != "ground" else "flight"

    @property
    def landed_stage(self) -> Stage:
        """As EXTENDED_SYS_STATE has it."""
        return "ground" if not self.is_in_air else self.stage

    @property
    def goal_neu(self) -> Vec3 | None:
        return self.mode.goal

    # Commands.

    def arm(self, *, force: bool = False) -> Verdict:
        if self.armed:
            return "accepted"
        reason = self._why_not_arm()
        if reason and (self.crashed or not force):
            self.say(2, f"Arming denied: {reason}")
            return "rejected"
        self.armed, self._armed_s = True, self.now_s
        self._set_home()
        self.say(6, "Armed by external command")
        self.tell(StateChanged())
        if self.mode is self.missions:
            self.missions.begin(self)
        else:
            self.mode.enter(self)
        return "accepted"

    def disarm(self, *, force: bool = False, by: str = "external command") -> Verdict:
        if self.is_in_air and not force:
            self.say(2, "Disarming denied: not landed")
            return "rejected"
        if self.armed:
            self._stop_motors()
            self.say(6, f"Disarmed by {by}")
        return "accepted"

    def set_mode(self, name: str) -> Verdict:
        """By somebody's order."""
        if not self.change_mode(name):
            self.say(2, f"Switching to {name.capitalize()} is currently not available")
            return "rejected"
        if name in ("HOLD", "MISSION", *BY_HAND):
            self._chosen = name
        return "accepted"

    def change_mode(self, name: str) -> bool:
        if name == self.mode.name:
            return True
        mode = self._mode(name)
        if mode is None or (self.armed and not self.position_ok) or mode.enter(self) is not None:
            return False
        self._take(mode)
        return True

    def hold_at(self, place_neu: Vec3) -> None:
        self.change_mode("HOLD")
        if isinstance(self.mode, Px4Hold):
            self.mode.go_to(self, place_neu)

    def start_mission(self) -> Verdict:
        """MISSION_START arms, too."""
        if not self.mission.steps:
            self.say(2, "Mission start denied! No valid mission")
            return "denied"
        return self.arm() if self.set_mode("MISSION") == "accepted" else "rejected"

    def take_off(self, up_m: float | None) -> Verdict:
        """``up_m``: height in the frame; None: as MIS_TAKEOFF_ALT has it."""
        if not self.position_ok:
            return "rejected"
        mode = TakeOff(up_m)
        mode.enter(self)
        self._take(mode)
        return "accepted"

    def go_to(self, goal_neu: Vec3, *, heading_rad: float | None = None, hold: bool = True) -> Verdict:
        """``hold``: changes to HOLD for it; only then its commander knows the order that its navigator carries out."""
        held = self._hold(may_change=hold)
        if held is None:
            return "denied" if hold else "unsupported"
        held.go_to(self, goal_neu)
        if heading_rad is None:
            self.face(goal_neu, at_least_m=self.parameters["NAV_ACC_RAD"])
        else:
            self.heading_goal_rad = heading_rad
        return "accepted" if hold else "unsupported"

    def pause(self, *, hold: bool = True) -> Verdict:
        """Stops, and holds where it comes to rest; ``hold`` as in ``go_to``."""
        held = self._hold(may_change=hold)
        if held is None:
            return "denied" if hold else "unsupported"
        held.enter(self)
        return "accepted" if hold else "unsupported"

    def _hold(self, *, may_change: bool) -> Px4Hold | None:
        """The mode HOLD, into which it is brought if it may be; None: it cannot be had."""
        if not self.flying:
            return None
        if not isinstance(self.mode, Px4Hold):
            if not may_change or not self.change_mode("HOLD"):
                return None
            self._chosen = "HOLD"
        return self.mode if isinstance(self.mode, Px4Hold) else None

    def set_current(self, seq: int) -> Verdict:
        if not 0 <= seq < len(self.mission.steps):
            return "denied"
        self.mission.current = seq
        if self.missions.state == "complete":
            self.missions.state = "not_started"
        if self.mode is self.missions and self.flying:
            self.missions.jump_to(self, seq)
        return "accepted"

    def gcs_heard(self) -> None:
        self._gcs_s = self.now_s

    def repeat_prearm(self) -> None:
        self.checks_asked += 1
        if (reason := self._why_not_arm()) is not None:
            self.say(3, f"Preflight Fail: {reason}")

    # Each step.

    def update(self, sensed: Sensed, dt_s: float) -> Demand | None:
        """What is asked of the airframe; None: motors off or idling."""
        self.now_s += dt_s
        self.p_neu, self.above_ground_m = sensed.p_neu, sensed.above_ground_m
        (vn, ve, vu), (slip_n, slip_e, slip_u) = sensed.v_neu, self._unrest.slip_neu
        self.v_neu = (vn + slip_n, ve + slip_e, vu + slip_u)
        self._boot()
        self.keep_to_fence(self.mode.name)
        if not self.armed:
            self._face_as_it_stands(sensed)
            return None
        self._watch_gcs()
        if not self.flying:
            self._face_as_it_stands(sensed)
            self._wait_on_ground()
            return None
        return self._fly(sensed, dt_s)

    def _face_as_it_stands(self, sensed: Sensed) -> None:
        self.heading_goal_rad = sensed.heading_rad
        self._turn.reset(sensed.heading_rad)

    def _fly(self, sensed: Sensed, dt_s: float) -> Demand | None:
        ramp_s = self.now_s - self._ramp_s
        if not self.is_in_air and ramp_s >= SEEN_S and self._touched_s == -math.inf:
            self.is_in_air = True
            self.say(6, "Takeoff detected")
        climb_m_s = self._fastest_climb_m_s(ramp_s)
        if climb_m_s <= 0:
            self.trajectory.reset(self.p_neu)
        self.mode.update(self, dt_s)
        self.target = self.trajectory.motion
        if self._has_landed(sensed):
            return None
        if not self.home_is_fixed and self._moving_home.step(
            self.now_s - self._ramp_s, self.parameters["COM_HOME_EN"] == 1
        ):
            self.home_neu = (*self.home_neu[:2], self._home_up_m + self._moving_home.shift_m)
            self.tell(HomeSet())
        tilt = self.parameters["MPC_TILTMAX_LND" if self.above_ground_m < 0.3 else "MPC_TILTMAX_AIR"]
        accel = self.control.demand(
            self.target, self.p_neu, self.v_neu, dt_s, climb_m_s=climb_m_s, tilt_rad=math.radians(tilt)
        )
        shaken = self._unrest.step(sensed.heading_rad, dt_s)
        turning = (math.radians(self.parameters[f"MPC_YAWRAUTO_{name}"]) for name in ("ACC", "MAX"))
        accel_rad_s2, fastest_rad_s = turning
        self._turn.step(self.heading_goal_rad, dt_s, accel_rad_s2=accel_rad_s2, fastest_rad_s=fastest_rad_s)
        return Demand((accel[0] + shaken[0], accel[1] + shaken[1], accel[2] + shaken[2]), self._turn.heading_rad)

    def _fastest_climb_m_s(self, ramp_s: float) -> float:
        p = self.parameters
        times, speeds = zip(*RAMP, strict=True)
        share = ramp_s / max(p["MPC_TKO_RAMP_T"], 0.1)
        if share < times[-1]:
            return float(np.interp(share, times, speeds)) * p["MPC_TKO_SPEED"] / RAMP[-1][1]
        low = self.above_ground_m < p["MPC_LAND_ALT1"] and self.mode.stage == "takeoff"
        return p["MPC_TKO_SPEED"] if low else p["MPC_Z_VEL_MAX_UP"]

    def _wait_on_ground(self) -> None:
        waited_s, p = self.now_s - self._armed_s, self.parameters
        if self.mode.stage == "takeoff":
            if waited_s >= p["COM_SPOOLUP_TIME"]:
                self.flying, self._ramp_s, self._touched_s = True, self.now_s, -math.inf
                self.trajectory.reset(self.p_neu)
                self.control.reset()
        elif 0 < p["COM_DISARM_PRFLT"] * self._speedup < waited_s:
            self.disarm(by="auto preflight disarming")

    def _has_landed(self, sensed: Sensed) -> bool:
        """Detected first; the motors run on for a while."""
        if not sensed.touching or (self.mode.stage != "landing" and self.stage != "landing"):
            self._touched_s = self._landed_s = -math.inf if self.is_in_air else self._touched_s
            return False
        if self._touched_s == -math.inf:
            self._touched_s = self.now_s
        if self.now_s - self._touched_s < LANDED_AFTER_S:
            return False
        if self.is_in_air:
            self.is_in_air, self._landed_s = False, self.now_s
            self.say(6, "Landing detected")
            if self.mode is self.missions:
                self.missions.landed(self)
        if self.now_s - self._landed_s >= max(0.0, self.parameters["COM_DISARM_LAND"]):
            self._stop_motors()
            self.say(6, "Disarmed by landing")
        return True

    def _stop_motors(self) -> None:
        self.armed = self.flying = self.is_in_air = False
        self._unrest.rest()
        self._touched_s = -math.inf
        self.cruise_m_s = None
        if self.missions.state != "complete":
            self.missions.state = "not_started"
        self._set_home()
        chosen = "HOLD" if self._chosen == "MISSION" and self.missions.state == "complete" else self._chosen
        self._take(self._mode(chosen) or Px4Hold())
        self.mode.enter(self)
        self.tell(StateChanged())

    def crash(self, reason: str) -> None:
        """The world's word that the vehicle has hit something."""
        self.crashed = True
        self._stop_motors()
        self.say(0, reason)

    def _take(self, mode: Px4Mode) -> None:
        if self.mode is self.missions and mode is not self.missions:
            self.missions.leave()
        self.mode = mode
        self.cruise_m_s = self.cruise_m_s if self.armed and mode.name in ("MISSION", "HOLD") else None
        self.tell(StateChanged())

    def _mode(self, name: str) -> Px4Mode | None:
        if name == "MISSION":
            return self.missions
        made = {"HOLD": Px4Hold, "RTL": Px4Return, "LAND": Px4Landing, "TAKEOFF": TakeOff, "OFFBOARD": Offboard}.get(
            name
        )
        if made:
            return made()
        return Sticks(name) if name in BY_HAND else None

    def _why_not_arm(self) -> str | None:
        if self.crashed:
            return "Vehicle has crashed: start the simulation again"
        if not self.position_ok or self.fence.is_breached:
            return "Resolve system health failures first"
        if self.mode.name in ("LAND", "RTL", *BY_HAND):
            return f"Resolve system health failures first: {self.mode.name.capitalize()} mode"
        return "No valid mission" if self.mode is self.missions and not self.mission.steps else None

    def _boot(self) -> None:
        if self.has_fix and not self.home_known:
            self.home_known = True
            self._set_home()
        if self.position_ok and not self._ready_said:
            self._ready_said = True
            self.say(6, "Ready for takeoff!")

    def set_home(self, place_neu: Vec3 | None) -> Verdict:
        """None: where it is, as high as it is; such a home is taken anew when it arms."""
        if self.parameters["COM_HOME_EN"] != 1:
            return "denied"
        if not (self.home_known and self.position_ok):
            return "rejected"
        if place_neu is None:
            self.home_is_fixed = False
            self._set_home()
        else:
            self.fix_home(place_neu)
        return "accepted"

    def _set_home(self) -> None:
        if self.home_is_fixed:
            return
        self.home_neu, self._home_up_m = self.p_neu, self.p_neu[2]
        self._moving_home.begin()
        self.tell(HomeSet())

    def _watch_gcs(self) -> None:
        lost = self.now_s - self._gcs_s > self.parameters["COM_DL_LOSS_T"] * self._speedup
        if lost == self._gcs_lost or (lost and self._gcs_s == -math.inf):
            return
        self._gcs_lost = lost and int(self.parameters["NAV_DLL_ACT"]) in GCS_LOST
        if not self._gcs_lost:
            return
        self.say(2, "Connection to ground station lost")
        if self.flying and self.stage != "landing":
            self.change_mode(GCS_LOST[int(self.parameters["NAV_DLL_ACT"])])
