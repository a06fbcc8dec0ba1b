"""What each autopilot is sent to fly the navigation script: ArduPilot in GUIDED, PX4 in HOLD with DO_REPOSITION."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.basics.plan_model import Firmware
from telemetry.mavlink.actions import Message
from telemetry.mavlink.autopilot_orders import HOLD_MODES, MISSION_MODES
from telemetry.mavlink.modes import mode_numbers

CUSTOM_MODE = 1.0
IGNORE_ALL_BUT_PLACE = 0b1101_1111_1000
"""POSITION_TARGET_TYPEMASK: velocity, acceleration, yaw and yaw rate are ignored."""
VELOCITY_IS_GIVEN = 0b1101_1100_0000
YAW_IS_GIVEN = ~mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
GROUND_SPEED, CLIMB_SPEED, ANY_THROTTLE = 1.0, 2.0, -1.0
RETURNS = ("RTL", "SMART_RTL", "AUTO_RTL")


@dataclass(frozen=True, slots=True)
class Place:
    lat_deg: float
    lon_deg: float
    alt_rel_home_m: float
    home_alt_amsl_m: float
    """PX4 takes altitudes above mean sea level only."""
    heading_rad: float | None = None


@dataclass(frozen=True, slots=True)
class GuidedOrders:
    """Messages to one vehicle."""

    firmware: Firmware
    target: tuple[int, int]

    @property
    def guided_mode(self) -> str:
        return "GUIDED" if self.firmware == "ardupilot" else "HOLD"

    @property
    def script_modes(self) -> frozenset[str]:
        """In which the script is in charge; any other was chosen by somebody else."""
        return frozenset({"GUIDED"} if self.firmware == "ardupilot" else {"HOLD", "TAKEOFF"})

    @property
    def stop_modes(self) -> tuple[str, ...]:
        """In order of preference. A change to GUIDED stops ArduPilot too, unless it is in GUIDED already."""
        return HOLD_MODES[self.firmware]

    @property
    def flown_from(self) -> frozenset[str]:
        """Modes in which no pilot flies by hand."""
        return frozenset({MISSION_MODES[self.firmware], self.guided_mode, *self.stop_modes, *RETURNS})

    @property
    def holds_where_it_is_guided(self) -> bool:
        """PX4 goes to places in the mode in which it also holds: that mode does not stop it there."""
        return self.guided_mode == self.stop_modes[0]

    @property
    def counts_from_sea(self) -> bool:
        """Places are sent above mean sea level: they must be sent again when home moves."""
        return self.firmware == "px4"

    def set_mode(self, name: str) -> Message:
        numbers = mode_numbers(self.firmware, name)
        assert numbers is not None, name
        return self._long(mavlink.MAV_CMD_DO_SET_MODE, CUSTOM_MODE, float(numbers.main), float(numbers.sub))

    def arm(self) -> Message:
        return self._long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)

    def disarm(self) -> Message:
        return self._long(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0)

    def take_off(self, alt_rel_home_m: float, home_alt_amsl_m: float) -> Message:
        if self.firmware == "ardupilot":
            return self._long(mavlink.MAV_CMD_NAV_TAKEOFF, last=alt_rel_home_m)
        nan = math.nan
        return self._long(mavlink.MAV_CMD_NAV_TAKEOFF, nan, 0.0, 0.0, nan, nan, nan, home_alt_amsl_m + alt_rel_home_m)

    def change_speed(self, speed_m_s: float, kind: float = GROUND_SPEED) -> Message:
        """``kind``: SPEED_TYPE."""
        return self._long(mavlink.MAV_CMD_DO_CHANGE_SPEED, kind, speed_m_s, ANY_THROTTLE)

    def go_to(self, place: Place, *, changes_mode: bool = True, from_sea: bool = False) -> Message:
        """``changes_mode``: of PX4 in another mode, which else takes no notice. ``from_sea``: ArduPilot too is told the
        height above the sea, which does not move with home."""
        if self.firmware == "px4":
            return self._reposition(place, float(changes_mode))
        return self._position_target(place, IGNORE_ALL_BUT_PLACE, (0.0, 0.0, 0.0), from_sea=from_sea)

    def follow(self, place: Place, v_neu_m_s: tuple[float, float, float]) -> Message:
        """ArduPilot's: the place moves on at this velocity until the next one is sent."""
        return self._position_target(place, VELOCITY_IS_GIVEN, v_neu_m_s)

    def _position_target(
        self, place: Place, mask: int, v_neu_m_s: tuple[float, float, float], *, from_sea: bool = False
    ) -> Message:
        yaw_rad = place.heading_rad
        above_home = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
        return mavlink.MAVLink_set_position_target_global_int_message(
            time_boot_ms=0,
            target_system=self.target[0],
            target_component=self.target[1],
            coordinate_frame=mavlink.MAV_FRAME_GLOBAL_INT if from_sea else above_home,
            type_mask=mask if yaw_rad is None else mask & YAW_IS_GIVEN,
            lat_int=round(place.lat_deg * 1e7),
            lon_int=round(place.lon_deg * 1e7),
            alt=place.alt_rel_home_m + (place.home_alt_amsl_m if from_sea else 0.0),
            vx=v_neu_m_s[0],
            vy=v_neu_m_s[1],
            vz=-v_neu_m_s[2],
            afx=0.0,
            afy=0.0,
            afz=0.0,
            yaw=yaw_rad or 0.0,
            yaw_rate=0.0,
        )

    def pause(self) -> Message:
        """PX4 in HOLD stops and stays: a change of place without a place, as its navigator reads it."""
        nan, default_speed, change_mode = math.nan, -1.0, 0.0
        return self._long(mavlink.MAV_CMD_DO_REPOSITION, default_speed, change_mode, 0.0, nan, nan, nan, nan)

    def end_mode(self, end: Literal["rtl", "land"]) -> str:
        return end.upper()

    def _reposition(self, place: Place, change_mode: float) -> Message:
        default_speed = -1.0
        yaw = math.nan if place.heading_rad is None else place.heading_rad
        lat_e7, lon_e7 = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7)
        alt_amsl_m = place.home_alt_amsl_m + place.alt_rel_home_m
        command, frame = mavlink.MAV_CMD_DO_REPOSITION, mavlink.MAV_FRAME_GLOBAL
        return mavlink.MAVLink_command_int_message(
            *self.target, frame, command, 0, 0, default_speed, change_mode, 0.0, yaw, lat_e7, lon_e7, alt_amsl_m
        )

    def _long(self, command: int, *params: float, last: float = 0.0) -> Message:
        """COMMAND_LONG; parameters that are not named are 0, ``last`` is the seventh."""
        p1, p2, p3, p4, p5, p6, p7 = params if len(params) == 7 else (*params, *(0.0,) * (6 - len(params)), last)
        return mavlink.MAVLink_command_long_message(*self.target, command, 0, p1, p2, p3, p4, p5, p6, p7)
