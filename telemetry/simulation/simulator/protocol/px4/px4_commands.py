"""Commands to the simulated PX4, answered as PX4 answers them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot, Verdict
from telemetry.simulation.simulator.neu_frame import Vec3
from telemetry.simulation.simulator.protocol.command_protocol import (
    FARTHEST_M,
    FORCE,
    NO_POSITION,
    NO_VELOCITY,
    NO_YAW,
    WITHOUT_MOTION,
    ReceivedOrder,
    asked_velocity,
    whole,
)
from telemetry.simulation.simulator.protocol.px4.px4_streams import name_of

ON_THE_GROUND_ONLY = {
    wire.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN,
    wire.MAV_CMD_DO_FENCE_ENABLE,
    wire.MAV_CMD_DO_MOTOR_TEST,
    wire.MAV_CMD_DO_SET_HOME,
}
"""While the motors turn they are denied: measured of PX4 1.17, whose source reads otherwise of DO_SET_HOME. The others
are not simulated."""
RESULTS: dict[Verdict, int] = {"accepted": 0, "rejected": 1, "denied": 2, "unsupported": 3, "failed": 4}


class Px4Commands:
    def __init__(self, pilot: Px4Pilot) -> None:
        self._pilot = pilot
        self._handlers: dict[int, Callable[[ReceivedOrder], Verdict]] = {
            wire.MAV_CMD_COMPONENT_ARM_DISARM: self._arm,
            wire.MAV_CMD_RUN_PREARM_CHECKS: self._check,
            wire.MAV_CMD_DO_SET_MODE: self._mode,
            wire.MAV_CMD_MISSION_START: lambda order: pilot.start_mission(),
            wire.MAV_CMD_NAV_TAKEOFF: self._take_off,
            wire.MAV_CMD_NAV_LAND: lambda order: pilot.set_mode("LAND"),
            wire.MAV_CMD_NAV_RETURN_TO_LAUNCH: lambda order: pilot.set_mode("RTL"),
            wire.MAV_CMD_DO_REPOSITION: self._reposition,
            wire.MAV_CMD_DO_CHANGE_SPEED: lambda order: pilot.change_speed(whole(order.params[0]), order.params[1]),
            wire.MAV_CMD_DO_SET_MISSION_CURRENT: lambda order: pilot.set_current(whole(order.params[0])),
            wire.MAV_CMD_DO_SET_HOME: self._set_home,
        }

    def run(self, order: ReceivedOrder) -> int:
        """MAV_RESULT."""
        if order.command in WITHOUT_MOTION:
            return RESULTS["accepted"]
        if order.command in ON_THE_GROUND_ONLY and self._pilot.armed:
            return RESULTS["denied"]
        handler = self._handlers.get(order.command)
        return RESULTS[handler(order) if handler else "unsupported"]

    def set_mode_message(self, message: Any) -> None:
        number = message.custom_mode
        self._to_mode(message.base_mode, number >> 16 & 255, number >> 24 & 255)

    def position_target(self, message: Any) -> None:
        """Set-points of OFFBOARD. They are heard in every mode: a stream must run before the mode may be had."""
        place, velocity = None, None
        if not message.type_mask & NO_POSITION:
            place = self._place_of(message)
        elif not message.type_mask & NO_VELOCITY:
            velocity = asked_velocity(message, self._pilot.heading_goal_rad)
        if place is None and velocity is None:
            return
        self._pilot.offboard.hear(self._pilot.now_s, place, velocity)
        if not message.type_mask & NO_YAW and math.isfinite(message.yaw) and self._pilot.mode.name == "OFFBOARD":
            self._pilot.heading_goal_rad = message.yaw % math.tau

    def _arm(self, order: ReceivedOrder) -> Verdict:
        force = whole(order.params[1]) == FORCE
        if order.params[0] == 1:
            return self._pilot.arm(force=force)
        return self._pilot.disarm(force=force) if order.params[0] == 0 else "unsupported"

    def _check(self, order: ReceivedOrder) -> Verdict:
        self._pilot.repeat_prearm()
        return "accepted" if not self._pilot.armed else "rejected"

    def _mode(self, order: ReceivedOrder) -> Verdict:
        base, main, sub = (whole(value) for value in order.params[:3])
        return self._to_mode(base, main, sub)

    def _to_mode(self, base: int, main: int, sub: int) -> Verdict:
        name = name_of(main, sub) if base & wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED else None
        if name is None:
            self._pilot.say(2, f"Unsupported mode {main} {sub}")
            return "unsupported"
        return self._pilot.set_mode(name)

    def _take_off(self, order: ReceivedOrder) -> Verdict:
        known = math.isfinite(order.alt_m)
        return self._pilot.take_off(order.alt_m - self._pilot.frame.alt_amsl_m if known else None)

    def _reposition(self, order: ReceivedOrder) -> Verdict:
        """Heights are above mean sea level, whatever frame is named; what is not given stays."""
        pilot, changes_mode = self._pilot, bool(whole(order.params[1]) & 1)
        if not any(map(math.isfinite, (order.lat_deg, order.lon_deg, order.alt_m, order.params[3]))):
            return pilot.pause(hold=changes_mode)
        n, e, u = pilot.p_neu
        if math.isfinite(order.lat_deg) and math.isfinite(order.lon_deg):
            if abs(order.lat_deg) > 90 or abs(order.lon_deg) > 180:
                return "denied"
            n, e, _ = pilot.frame.neu_from_geodetic(order.lat_deg, order.lon_deg, 0.0)
        if math.isfinite(order.alt_m):
            u = order.alt_m - pilot.frame.alt_amsl_m
        if max(abs(n), abs(e), abs(u)) > FARTHEST_M:
            return "denied"
        heading = order.params[3]
        verdict = pilot.go_to(
            (n, e, u),
            heading_rad=heading if math.isfinite(heading) else None,
            hold=changes_mode,
        )
        if verdict != "denied" and order.params[0] > 0:
            pilot.change_speed(1, order.params[0])
        return verdict

    def _set_home(self, order: ReceivedOrder) -> Verdict:
        """As Commander.cpp has it, with the motors off. Heights are above mean sea level, whatever frame is named."""
        if order.params[0] > 0.5:
            return self._pilot.set_home(None)
        place = (order.lat_deg, order.lon_deg, order.alt_m)
        if not (all(map(math.isfinite, place)) and abs(order.lat_deg) <= 90 and abs(order.lon_deg) <= 180):
            return "denied"
        frame = self._pilot.frame
        n, e, _ = frame.neu_from_geodetic(order.lat_deg, order.lon_deg, 0.0)
        return self._pilot.set_home((n, e, order.alt_m - frame.alt_amsl_m))

    def _place_of(self, message: Any) -> Vec3 | None:
        frame = self._pilot.frame
        if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            place = (message.x, message.y, -message.z)
        else:
            lat_deg, lon_deg = message.lat_int / 1e7, message.lon_int / 1e7
            home_up_m = self._pilot.home_neu[2] if message.coordinate_frame in (3, 6) else -frame.alt_amsl_m
            n, e, _ = frame.neu_from_geodetic(lat_deg, lon_deg, 0.0)
            place = (n, e, message.alt + home_up_m)
        return place if all(abs(value) < FARTHEST_M for value in place) else None
