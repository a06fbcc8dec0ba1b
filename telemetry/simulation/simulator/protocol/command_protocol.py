"""Commands from ground stations to the simulated vehicle, answered as ArduCopter answers them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.mission_steps import Step
from telemetry.simulation.simulator.autopilot.pilot import Answer
from telemetry.simulation.simulator.neu_frame import Vec3

MODE_NUMBERS = {
    "STABILIZE": 0, "ACRO": 1, "ALT_HOLD": 2, "AUTO": 3, "GUIDED": 4, "LOITER": 5, "RTL": 6, "CIRCLE": 7, "LAND": 9,
    "DRIFT": 11, "SPORT": 13, "POSHOLD": 16, "BRAKE": 17, "SMART_RTL": 21,
}  # fmt: skip
MODE_NAMES = {number: name for name, number in MODE_NUMBERS.items()}
"""ArduCopter's flight modes, and the numbers that stand for them on the wire."""
RESULTS: dict[Answer, int] = {"accepted": 0, "denied": 2, "unsupported": 3, "failed": 4}
FORCE = 21196
ABOVE_SEA, ABOVE_HOME, LOCAL, LOCAL_OFFSET = (0, 5), (3, 6), (1,), (7, 9)
WITHOUT_MOTION = {181, 183, 195, 197, 201, 203, 204, 205, 206, 211, 530, 531, 532, 1000, 2000, 2001, 2500, 2501}
"""Cameras, gimbals, servos and regions of interest: accepted, and nothing moves."""
FARTHEST_M = 100_000.0
"""A target beyond this is a mistake."""
FASTEST_M_S = 100.0
"""A velocity beyond this, too."""
NO_POSITION, NO_VELOCITY, NO_YAW = 0b111, 0b111 << 3, 1 << 10
OF_THE_BODY = (8, 9)
"""MAV_FRAME_BODY_NED and MAV_FRAME_BODY_OFFSET_NED"""


@dataclass(frozen=True, slots=True)
class ReceivedOrder:
    """COMMAND_LONG and COMMAND_INT in one."""

    command: int
    params: tuple[float, float, float, float]
    lat_deg: float
    lon_deg: float
    alt_m: float
    frame: int


def read_order(message: Any) -> ReceivedOrder:
    params = (message.param1, message.param2, message.param3, message.param4)
    if message.get_type() == "COMMAND_INT":
        return ReceivedOrder(message.command, params, message.x / 1e7, message.y / 1e7, message.z, message.frame)
    return ReceivedOrder(message.command, params, message.param5, message.param6, message.param7, 3)


def asked_velocity(message: Any, heading_rad: float) -> Vec3 | None:
    """North, east, up (m/s); frames of the body turn with the vehicle's nose. None: faster than anything flies."""
    vx, vy, vz = message.vx, message.vy, message.vz
    if not all(abs(value) < FASTEST_M_S for value in (vx, vy, vz)):
        return None
    turn = heading_rad if message.coordinate_frame in OF_THE_BODY else 0.0
    c, s = math.cos(turn), math.sin(turn)
    return vx * c - vy * s, vx * s + vy * c, -vz


def whole(value: float) -> int:
    """A number that came as a float; ground stations write NaN for "not given"."""
    return int(value) if math.isfinite(value) else 0


class Commands:
    """Those that concern flying; what they move is the autopilot's business."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._pilot = autopilot
        self._handlers: dict[int, Callable[[ReceivedOrder], Answer]] = {
            wire.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            wire.MAV_CMD_RUN_PREARM_CHECKS: self._check,
            wire.MAV_CMD_DO_SET_MODE: lambda order: self.set_mode(order.params[0], order.params[1]),
            wire.MAV_CMD_MISSION_START: self._start,
            wire.MAV_CMD_NAV_TAKEOFF: lambda order: autopilot.take_off(order.alt_m),
            wire.MAV_CMD_NAV_LAND: lambda order: autopilot.set_mode("LAND"),
            wire.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda order: autopilot.set_mode("RTL"),
            wire.MAV_CMD_NAV_LOITER_UNLIM: lambda order: autopilot.set_mode("LOITER"),
            wire.MAV_CMD_DO_REPOSITION: self._reposition,
            wire.MAV_CMD_DO_PAUSE_CONTINUE: self._pause,
            wire.MAV_CMD_DO_CHANGE_SPEED: lambda order: autopilot.change_speed(whole(order.params[0]), order.params[1]),
            wire.MAV_CMD_CONDITION_YAW: self._turn,
            wire.MAV_CMD_DO_SET_MISSION_CURRENT: lambda order: autopilot.set_current(whole(order.params[0])),
            wire.MAV_CMD_DO_SET_HOME: self._set_home,
        }

    def run(self, order: ReceivedOrder) -> int:
        """MAV_RESULT."""
        if order.command in WITHOUT_MOTION:
            return RESULTS["accepted"]
        handler = self._handlers.get(order.command)
        return RESULTS[handler(order) if handler else "unsupported"]

    def set_mode(self, base_mode: float, number: float) -> Answer:
        if not whole(base_mode) & wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED:
            return "denied"
        name = MODE_NAMES.get(whole(number))
        if name is None:
            self._pilot.say(4, f"No such mode {whole(number)}")
            return "failed"
        return self._pilot.set_mode(name)

    def set_mode_message(self, message: Any) -> None:
        """SET_MODE, the old way."""
        self.set_mode(message.base_mode, message.custom_mode)

    def position_target(self, message: Any) -> None:
        """SET_POSITION_TARGET_GLOBAL_INT or _LOCAL_NED: a place is flown to, a velocity flown, or both followed."""
        heading_rad = None if message.type_mask & NO_YAW else _heading(message.yaw)
        velocity = None if message.type_mask & NO_VELOCITY else asked_velocity(message, self._pilot.heading_goal_rad)
        if message.type_mask & NO_POSITION:
            if velocity:
                self._pilot.fly_at(velocity, heading_rad=heading_rad)
            return
        if message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
            goal = self._place(message.lat_int / 1e7, message.lon_int / 1e7, message.alt, message.coordinate_frame)
        else:
            goal = self._local(message)
        if goal and velocity:
            self._pilot.follow(goal, velocity, heading_rad=heading_rad)
        elif goal and message.type_mask & NO_VELOCITY:
            self._pilot.go_to(goal, heading_rad=heading_rad)

    def _arm(self, order: ReceivedOrder) -> Answer:
        force = whole(order.params[1]) == FORCE
        if order.params[0] == 1:
            return self._pilot.arm(force=force)
        return self._pilot.disarm(force=force) if order.params[0] == 0 else "unsupported"

    def _check(self, order: ReceivedOrder) -> Answer:
        self._pilot.repeat_prearm()
        return "accepted" if not self._pilot.armed else "failed"

    def _start(self, order: ReceivedOrder) -> Answer:
        return self._pilot.start_mission() if order.params[0] == 0 and order.params[1] == 0 else "denied"

    def _reposition(self, order: ReceivedOrder) -> Answer:
        goal = self._place(order.lat_deg, order.lon_deg, order.alt_m, order.frame)
        if goal is None or not self._pilot.flying:
            return "denied"
        if self._pilot.mode.name != "GUIDED" and (
            not whole(order.params[1]) & 1 or self._pilot.set_mode("GUIDED") != "accepted"
        ):
            return "denied"
        if order.params[0] > 0:
            self._pilot.change_speed(1, order.params[0])
        return self._pilot.go_to(goal, heading_rad=_heading(order.params[3]))

    def _set_home(self, order: ReceivedOrder) -> Answer:
        if order.params[0] == 1 or (order.lat_deg == 0.0 and order.lon_deg == 0.0):
            return self._pilot.set_home(None)
        place = self._place(order.lat_deg, order.lon_deg, order.alt_m, order.frame)
        return "denied" if place is None else self._pilot.set_home(place)

    def _pause(self, order: ReceivedOrder) -> Answer:
        if order.params[0] == 0:
            return self._pilot.pause()
        return self._pilot.go_on() if order.params[0] == 1 else "denied"

    def _turn(self, order: ReceivedOrder) -> Answer:
        if not self._pilot.flying or not math.isfinite(order.params[0]):
            return "failed"
        self._pilot.apply(Step("yaw", values=order.params))
        return "accepted"

    def _place(self, lat_deg: float, lon_deg: float, alt_m: float, frame: int) -> Vec3 | None:
        if not (abs(alt_m) < FARTHEST_M and abs(lat_deg) <= 90 and abs(lon_deg) <= 180):
            return None
        if frame not in ABOVE_SEA + ABOVE_HOME:
            return None
        above = "home" if frame in ABOVE_HOME else "sea"
        return self._pilot.place(Step("waypoint", lat_deg, lon_deg, alt_m, above))

    def _local(self, message: Any) -> Vec3 | None:
        goal = (message.x, message.y, -message.z)
        if message.coordinate_frame in LOCAL_OFFSET:
            p = self._pilot.p_neu
            goal = (goal[0] + p[0], goal[1] + p[1], goal[2] + p[2])
        elif message.coordinate_frame not in LOCAL:
            return None
        return goal if all(abs(value) < FARTHEST_M for value in goal) else None


def _heading(value_rad: float) -> float | None:
    return value_rad if math.isfinite(value_rad) else None
