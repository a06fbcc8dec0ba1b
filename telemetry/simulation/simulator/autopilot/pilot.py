"""What the simulated autopilot knows, and what its modes use of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

from planning.flight_time.scurve import Axes
from telemetry.simulation.simulator.airframe.dynamics import GRAVITY_M_S2
from telemetry.simulation.simulator.autopilot.autopilot_parameters import Parameters
from telemetry.simulation.simulator.autopilot.copter_fence import CopterFence
from telemetry.simulation.simulator.autopilot.leg_curves import Motion
from telemetry.simulation.simulator.autopilot.mission_steps import MissionSteps, Step
from telemetry.simulation.simulator.autopilot.shaping import limited
from telemetry.simulation.simulator.neu_frame import NeuFrame, Vec3

POSITION_PER_S = 1.0
VELOCITY_PER_S = 2.0
VELOCITY_MEMORY_PER_S2 = 1.0
MEMORY_M_S2 = 5.0
HEIGHT_PER_S = 1.0
CLIMB_PER_S = 5.0
CLIMB_MEMORY_PER_S2 = 1.0
FASTEST_CORRECTION_M_S = 3.0
AS_REAL_BOOT_S = 41.5
"""From switching on to a usable position estimate, in the recordings."""
READY_SHARE, FIX_SHARE = 2.35 / AS_REAL_BOOT_S, 19.9 / AS_REAL_BOOT_S
"""When "ArduPilot Ready" is said and when the receiver has its fix, as shares of the boot time."""
FASTEST_M_S = 20.0
"""WPNAV_SPEED's upper end."""
Answer = Literal["accepted", "denied", "failed", "unsupported"]


class PositionControl:
    """ArduCopter's cascade with its default gains (PSC_POSXY_P 1, PSC_VELXY_P 2, PSC_VELXY_I 1, PSC_VELZ_P 5)."""

    def __init__(self) -> None:
        self._memory: Vec3 = (0.0, 0.0, 0.0)

    def reset(self) -> None:
        self._memory = (0.0, 0.0, 0.0)

    def demand(
        self, target: tuple[Vec3, Vec3, Vec3], p_neu: Vec3, v_neu: Vec3, max_tilt_rad: float, dt_s: float
    ) -> Vec3:
        """Acceleration to ask of the airframe, from the target's motion and the estimated one."""
        (pt, vt, at), (mn, me, mu) = target, self._memory
        cn, ce = limited(
            POSITION_PER_S * (pt[0] - p_neu[0]), POSITION_PER_S * (pt[1] - p_neu[1]), FASTEST_CORRECTION_M_S
        )
        en, ee = vt[0] + cn - v_neu[0], vt[1] + ce - v_neu[1]
        eu = vt[2] + max(-1.5, min(1.5, HEIGHT_PER_S * (pt[2] - p_neu[2]))) - v_neu[2]
        mn, me = limited(mn + VELOCITY_MEMORY_PER_S2 * en * dt_s, me + VELOCITY_MEMORY_PER_S2 * ee * dt_s, MEMORY_M_S2)
        mu = max(-MEMORY_M_S2, min(MEMORY_M_S2, mu + CLIMB_MEMORY_PER_S2 * eu * dt_s))
        self._memory = (mn, me, mu)
        most = GRAVITY_M_S2 * math.tan(max_tilt_rad)
        north, east = limited(at[0] + VELOCITY_PER_S * en + mn, at[1] + VELOCITY_PER_S * ee + me, most)
        return north, east, at[2] + CLIMB_PER_S * eu + mu


@dataclass(frozen=True, slots=True)
class Text:
    severity: int
    """0 emergency to 7 debug"""
    text: str


@dataclass(frozen=True, slots=True)
class Reached:
    seq: int


@dataclass(frozen=True, slots=True)
class HomeSet:
    """Home or the estimator's origin is new."""


@dataclass(frozen=True, slots=True)
class StateChanged:
    """Another mode, armed or disarmed."""


Event = Text | Reached | HomeSet | StateChanged


@dataclass(frozen=True, slots=True)
class Sensed:
    """What the autopilot is told at each step."""

    p_neu: Vec3
    v_neu: Vec3
    heading_rad: float
    touching: bool
    """The feet are on something."""
    voltage_v: float
    used_mah: float
    above_ground_m: float = math.inf


class AnyPilot:
    """What every simulated autopilot knows and tells, whoever made it. Positions are in the frame, as estimated."""

    def __init__(self, frame: NeuFrame, parameters: Parameters, boot_s: float) -> None:
        self.frame = frame
        self.parameters = parameters
        self.boot_s = boot_s
        self.mission = MissionSteps()
        self.now_s = 0.0
        self.armed = self.flying = self.crashed = False
        self.home_neu: Vec3 = (0.0, 0.0, 0.0)
        self.home_known = self.home_is_fixed = False
        self.heading_goal_rad = 0.0
        self.p_neu: Vec3 = (0.0, 0.0, 0.0)
        self.v_neu: Vec3 = (0.0, 0.0, 0.0)
        self.target: Motion = (self.p_neu, self.v_neu, (0.0, 0.0, 0.0))
        """Where the vehicle should be now, and how it should be moving."""
        self._events: list[Event] = []

    @property
    def ready(self) -> bool:
        return self.now_s >= self.boot_s * READY_SHARE

    @property
    def has_fix(self) -> bool:
        return self.now_s >= self.boot_s * FIX_SHARE

    @property
    def position_ok(self) -> bool:
        return self.now_s >= self.boot_s

    def take_events(self) -> list[Event]:
        """What has happened since the last call."""
        events, self._events = self._events, []
        return events

    def tell(self, event: Event) -> None:
        self._events.append(event)

    def say(self, severity: int, text: str) -> None:
        self.tell(Text(severity, text))

    def place(self, step: Step) -> Vec3:
        """Where a step is in the frame."""
        lat, lon = step.lat_deg, step.lon_deg
        n, e, _ = self.frame.neu_from_geodetic(lat, lon, 0.0) if lat or lon else self.p_neu
        return n, e, step.alt_m + (self.home_neu[2] if step.above == "home" else -self.frame.alt_amsl_m)

    def fix_home(self, place_neu: Vec3) -> None:
        """By an order: it stays there, also when the vehicle arms elsewhere."""
        self.home_neu, self.home_is_fixed = place_neu, True
        self.tell(HomeSet())

    def face(self, goal_neu: Vec3, *, at_least_m: float = 0.0) -> None:
        """Turn to a place, unless it is nearer than that."""
        north, east = goal_neu[0] - self.p_neu[0], goal_neu[1] - self.p_neu[1]
        if math.hypot(north, east) > at_least_m:
            self.heading_goal_rad = math.atan2(east, north) % (2 * math.pi)


class SimulatedPilot(AnyPilot):
    """ArduCopter's state that its modes read and change."""

    def __init__(self, frame: NeuFrame, parameters: Parameters, boot_s: float) -> None:
        super().__init__(frame, parameters, boot_s)
        self.speed_m_s: float | None = None
        """Replaces WPNAV_SPEED until the mode changes."""
        self._vertical_m_s: dict[str, float] = {}
        """Of Axes; replace WPNAV_SPEED_UP and _DN as long."""
        self.facing_fixed = False
        """A heading was commanded: the next waypoint does not turn the vehicle."""
        self.control = PositionControl()
        self.fence = CopterFence(parameters)

    def axes(self, speed_m_s: float | None = None) -> Axes:
        axes = self.parameters.axes(speed_m_s)
        return replace(axes, **self._vertical_m_s) if self._vertical_m_s else axes

    def forget_speeds(self) -> None:
        """Those that were ordered: the vehicle's own count again."""
        self.speed_m_s = None
        self._vertical_m_s.clear()

    def near(self, goal_neu: Vec3) -> bool:
        return math.dist(self.p_neu, goal_neu) <= self.parameters["WPNAV_RADIUS"] / 100

    def turn_to(self, heading_rad: float) -> None:
        self.heading_goal_rad = heading_rad
        self.facing_fixed = True

    def change_speed(self, kind: int, speed_m_s: float) -> Answer:
        """0 and 1: over ground; 2: climb; 3: descent."""
        if not 0 < speed_m_s < math.inf:
            return "failed"
        if kind in (2, 3):
            self._vertical_m_s["climb_m_s" if kind == 2 else "descent_m_s"] = speed_m_s
        else:
            self.speed_m_s = min(speed_m_s, FASTEST_M_S)
        return "accepted"

    def apply(self, step: Step) -> None:
        """A mission step that sets something."""
        first, second, _, relative = step.values
        if step.kind == "speed":
            self.change_speed(int(first), second)
        elif step.kind == "yaw":
            turn = math.radians(first)
            self.turn_to(self.heading_goal_rad + turn if relative else turn)
