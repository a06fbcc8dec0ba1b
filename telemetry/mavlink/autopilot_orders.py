"""The commands of this ground station for each autopilot, and how the vehicle's state shows that they were obeyed."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError
from telemetry.mavlink.actions import Message
from telemetry.mavlink.modes import mode_numbers
from telemetry.topics.vehicle import Autopilot, VehicleState

Seen = Callable[[VehicleState], bool]

MISSION_MODES: dict[Autopilot, str] = {"ardupilot": "AUTO", "px4": "MISSION"}
HOLD_MODES: dict[Autopilot, tuple[str, ...]] = {"ardupilot": ("BRAKE", "GUIDED"), "px4": ("HOLD",)}
"""In order of preference. LOITER is not among them: without a remote control its throttle reads as "down"."""
RETURN_MODES = frozenset({"RTL", "SMART_RTL", "AUTO_RTL"})
LAND_MODES = frozenset({"LAND", "PRECLAND"})
ANY_THROTTLE = -1
FORCE = 21196
"""Of COMPONENT_ARM_DISARM: whatever the autopilot holds against it."""


@dataclass(frozen=True, slots=True)
class Order:
    """``once``: must not be carried out twice. ``seen``: whether a state shows it done."""

    message: Message
    once: bool = False
    seen: Seen | None = None


@dataclass(frozen=True, slots=True)
class Orders:
    target: tuple[int, int]
    autopilot: Autopilot

    def arm(self) -> Order:
        return Order(self._long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1), once=True, seen=lambda state: state.armed)

    def disarm(self) -> Order:
        return Order(self._long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0), seen=lambda state: not state.armed)

    def stop_motors(self) -> Order:
        """Also in the air, where an order to disarm is refused. The same on both autopilots."""
        message = self._long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, FORCE)
        return Order(message, seen=lambda state: not state.armed)

    def check_before_arming(self) -> Message:
        """PX4 answers with a report by events of what keeps it from arming."""
        return self._long(mavlink.MAV_CMD_RUN_PREARM_CHECKS)

    def mode(self, name: str) -> Order:
        numbers = mode_numbers(self.autopilot, name)
        if numbers is None:
            advice = "Hedgehop flies ArduPilot and PX4."
            raise NotAllowedError(f"This autopilot has no mode {name} that is known here.", advice=advice)
        message = self._long(mavlink.MAV_CMD_DO_SET_MODE, 1, numbers.main, numbers.sub)
        return Order(message, seen=lambda state: state.mode == name)

    def mission_mode(self) -> Order:
        return self.mode(MISSION_MODES.get(self.autopilot, "AUTO"))

    def start_mission(self) -> Order:
        mode = MISSION_MODES.get(self.autopilot, "AUTO")
        seen: Seen = lambda state: state.mode == mode and state.landed in ("taking_off", "in_air")  # noqa: E731
        return Order(self._long(mavlink.MAV_CMD_MISSION_START, 0), once=True, seen=seen)

    def take_off(self, alt_rel_home_m: float) -> Order:
        """ArduPilot in GUIDED."""
        message = self._long(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, alt_rel_home_m)
        return Order(message, once=True, seen=lambda state: state.landed in ("taking_off", "in_air"))

    def go_to(self, lat_deg: float, lon_deg: float, alt_rel_home_m: float) -> Order:
        """Straight there, whatever the mission says."""
        place = (round(lat_deg * 1e7), round(lon_deg * 1e7), alt_rel_home_m)
        message = mavlink.MAVLink_command_int_message(
            *self.target,
            mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT,
            mavlink.MAV_CMD_DO_REPOSITION,
            0,
            0,
            -1,
            mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE,
            0,
            math.nan,
            *place,
        )
        return Order(message)

    def set_home(self, lat_deg: float, lon_deg: float, alt_amsl_m: float) -> Order:
        """With its height: where home is set without, both autopilots take the vehicle's own, also in the air."""
        message = mavlink.MAVLink_command_int_message(
            *self.target,
            mavlink.MAV_FRAME_GLOBAL,
            mavlink.MAV_CMD_DO_SET_HOME,
            0,
            0,
            0,
            math.nan,
            math.nan,
            math.nan,
            round(lat_deg * 1e7),
            round(lon_deg * 1e7),
            alt_amsl_m,
        )
        return Order(message)

    def change_speed(self, kind: int, speed_m_s: float) -> Order:
        """``kind``: SPEED_TYPE. Holds until the next change of the flight mode."""
        return Order(self._long(mavlink.MAV_CMD_DO_CHANGE_SPEED, kind, speed_m_s, ANY_THROTTLE))

    def mission_item(self, sequence: int) -> Order:
        """``sequence`` as the vehicle counts."""
        message = self._long(mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, sequence)
        return Order(message, seen=lambda state: state.mission_item == sequence)

    def _long(self, command: int, *params: float) -> Message:
        padded = (*params, *([0.0] * (7 - len(params))))
        return mavlink.MAVLink_command_long_message(*self.target, command, 0, *padded)
