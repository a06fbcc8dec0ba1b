"""A point that flies where it is sent, and speaks as ArduCopter or PX4 does about it. Written for tests."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tests.telemetry.lossy import STATION

HOME = (-37.1244507, 175.6892878, 803.24)
METRES_PER_DEG = 111_195.0
ACCEPTED, DENIED, FAILED = 0, 2, 4
GUIDED, RTL, LAND, LOITER = 4, 6, 9, 5
PX4_HOLD, PX4_TAKEOFF, PX4_RTL, PX4_LAND = (4 << 16 | sub << 24 for sub in (3, 2, 5, 6))
DT_S = 0.05


@dataclass
class Craft:
    """``log`` holds what it was sent, with the time."""

    px4: bool = False
    mode: int = 0
    armed: bool = False
    refuse_arming: bool = False
    deaf_to_targets: int = 0
    tells_its_target: bool = True
    stuck: bool = False
    home_shift_m: float = 0.0
    """Its home has moved up by so much."""
    speed_m_s: float = 2.0
    at: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    """North, east, up of home, metres."""
    to: list[float] | None = None
    arms: int = 0
    log: list[tuple[float, Any]] = field(default_factory=list)
    ticks: int = 0

    def __post_init__(self) -> None:
        self.mode = PX4_HOLD if self.px4 else self.mode

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        self.log.append((now_s, message))
        kind = message.get_type()
        if kind == "SET_POSITION_TARGET_GLOBAL_INT":
            self._go(message.lat_int, message.lon_int, message.alt - HOME[2] * (message.coordinate_frame in (0, 5)))
            return []
        if kind == "COMMAND_INT":
            self._go(message.x, message.y, message.z - HOME[2])
            return [self._ack(message.command, ACCEPTED)]
        return [self._ack(message.command, self._obey(message))] if kind == "COMMAND_LONG" else []

    def _go(self, lat_e7: int, lon_e7: int, up_m: float) -> None:
        if self.mode not in (GUIDED, PX4_HOLD):
            return
        if self.deaf_to_targets > 0:
            self.deaf_to_targets -= 1
            return
        north, east = (lat_e7 * 1e-7 - HOME[0]) * METRES_PER_DEG, (lon_e7 * 1e-7 - HOME[1]) * METRES_PER_DEG
        self.to = [north, east * math.cos(math.radians(HOME[0])), up_m]

    def _obey(self, message: Any) -> int:
        if message.command == mavlink.MAV_CMD_DO_SET_MODE:
            self.mode = int(message.param2) << 16 | int(message.param3) << 24 if self.px4 else int(message.param2)
            self.to = None
        elif message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            if self.refuse_arming:
                return FAILED
            self.arms += 1
            self.armed = True
        elif message.command == mavlink.MAV_CMD_NAV_TAKEOFF:
            if not self.armed:
                return FAILED
            self.to = [*self.at[:2], message.param7 - (HOME[2] if self.px4 else 0.0)]
            self.mode = PX4_TAKEOFF if self.px4 else self.mode
        elif message.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            self.speed_m_s = message.param2
        else:
            return DENIED
        return ACCEPTED

    def _ack(self, command: int, result: int) -> Any:
        return mavlink.MAVLink_command_ack_message(command, result, 0, 0, *STATION)

    @property
    def flies(self) -> bool:
        return self.armed and self.at[2] > 0.05

    def on_tick(self, now_s: float) -> list[Any]:
        before = tuple(self.at)
        self._move()
        self.ticks += 1
        messages = []
        if self.ticks % 4 == 0:
            messages.append(self._position(now_s, before))
        if self.ticks % 10 == 0 and self.to is not None and self.tells_its_target and self.mode in (GUIDED, PX4_HOLD):
            messages.append(self._target(now_s))
        if self.ticks % 20 == 0:
            landed = 2 if self.flies else 1
            autopilot = 12 if self.px4 else 3
            base = 1 | (128 if self.armed else 0)
            messages.append(mavlink.MAVLink_heartbeat_message(2, autopilot, base, self.mode, 4, 3))
            messages.append(mavlink.MAVLink_extended_sys_state_message(0, landed))
        return messages

    def _move(self) -> None:
        if not self.armed or self.stuck:
            return
        if self.mode in (RTL, PX4_RTL):
            self.to = [0.0, 0.0, self.at[2]] if math.hypot(*self.at[:2]) > 0.2 else [0.0, 0.0, 0.0]
        elif self.mode in (LAND, PX4_LAND):
            self.to = [*self.at[:2], 0.0]
        if self.to is not None:
            way = [b - a for a, b in zip(self.at, self.to, strict=True)]
            length = math.hypot(*way)
            step = min(self.speed_m_s * DT_S, length)
            if length > 0:
                self.at = [a + w / length * step for a, w in zip(self.at, way, strict=True)]
            if length <= step and self.mode == PX4_TAKEOFF:
                self.mode = PX4_HOLD
        if self.mode in (RTL, LAND, PX4_RTL, PX4_LAND) and self.at[2] <= 0.01:
            self.armed = False

    def _degrees_e7(self, place: list[float]) -> tuple[int, int]:
        lat = HOME[0] + place[0] / METRES_PER_DEG
        lon = HOME[1] + place[1] / METRES_PER_DEG / math.cos(math.radians(HOME[0]))
        return round(lat * 1e7), round(lon * 1e7)

    def _position(self, now_s: float, before: tuple[float, ...]) -> Any:
        v = [round((a - b) / DT_S * 100) for a, b in zip(self.at, before, strict=True)]
        up_mm = round(self.at[2] * 1000)
        above_home_mm = up_mm - round(self.home_shift_m * 1000)
        lat, lon = self._degrees_e7(self.at)
        return mavlink.MAVLink_global_position_int_message(
            round(now_s * 1000),
            lat,
            lon,
            round(HOME[2] * 1000) + up_mm,
            above_home_mm,
            v[0],
            v[1],
            -v[2],
            0,
        )

    def _target(self, now_s: float) -> Any:
        assert self.to is not None
        lat, lon = self._degrees_e7(self.to)
        alt_m = HOME[2] + self.to[2]
        return mavlink.MAVLink_position_target_global_int_message(
            round(now_s * 1000), 0, 65016, lat, lon, alt_m, 0, 0, 0, 0, 0, 0, 0, 0
        )
