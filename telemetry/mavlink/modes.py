"""Flight modes: the autopilot's own names, and what a heartbeat's ``custom_mode`` or a mode command holds for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.topics.vehicle import Autopilot

_ARDUPILOT_TABLES = {1: "PLANE_MODE", 10: "ROVER_MODE", 11: "ROVER_MODE", 12: "SUB_MODE"}
_ARDUPILOT_TABLES |= dict.fromkeys(range(19, 26), "PLANE_MODE")
_PX4_MAIN = {1: "MANUAL", 2: "ALTCTL", 3: "POSCTL", 5: "ACRO", 6: "OFFBOARD", 7: "STABILIZED", 8: "RATTITUDE"}
_PX4_AUTO = 4
_PX4_AUTO_SUB = {
    1: "READY",
    2: "TAKEOFF",
    3: "HOLD",
    4: "MISSION",
    5: "RTL",
    6: "LAND",
    8: "FOLLOW",
    9: "PRECLAND",
}


@dataclass(frozen=True, slots=True)
class ModeNumbers:
    """What DO_SET_MODE carries: p1 base mode (custom mode enabled), p2 and p3."""

    main: int
    sub: int
    custom_mode: int
    """What the heartbeat then shows."""


def mode_name(autopilot: Autopilot, vehicle_type: int, custom_mode: int) -> str:
    """The autopilot's own name of a mode; ``MODE 42`` for one that has none here."""
    if autopilot == "px4":
        name = _px4_name(custom_mode)
    elif autopilot == "ardupilot":
        name = _ardupilot_name(vehicle_type, custom_mode)
    else:
        name = None
    return name or f"MODE {custom_mode}"


def mode_numbers(autopilot: Autopilot, name: str) -> ModeNumbers | None:
    """Numbers of a mode of a multirotor, None when the autopilot has no such mode."""
    if autopilot == "ardupilot":
        entries = mavlink.enums["COPTER_MODE"]
        found = next((number for number, entry in entries.items() if entry.name == f"COPTER_MODE_{name}"), None)
        return None if found is None else ModeNumbers(found, 0, found)
    if autopilot == "px4":
        for sub, known in _PX4_AUTO_SUB.items():
            if known == name:
                return ModeNumbers(_PX4_AUTO, sub, _PX4_AUTO << 16 | sub << 24)
        for main, known in _PX4_MAIN.items():
            if known == name:
                return ModeNumbers(main, 0, main << 16)
    return None


def commanded_mode(message: Any, autopilot: Autopilot, vehicle_type: int) -> str | None:
    """The flight mode that a message to the vehicle changes to, None for one that changes none."""
    if message.get_type() not in ("COMMAND_INT", "COMMAND_LONG"):
        return None
    if message.command == mavlink.MAV_CMD_DO_REPOSITION:
        return "HOLD" if autopilot == "px4" else "GUIDED"
    if message.command == mavlink.MAV_CMD_MISSION_START:
        return "MISSION" if autopilot == "px4" else "AUTO"
    if message.command != mavlink.MAV_CMD_DO_SET_MODE:
        return None
    main, sub = int(message.param2), int(message.param3)
    return mode_name(autopilot, vehicle_type, main << 16 | sub << 24 if autopilot == "px4" else main)


def _px4_name(custom_mode: int) -> str | None:
    main, sub = custom_mode >> 16 & 255, custom_mode >> 24 & 255
    return _PX4_AUTO_SUB.get(sub) if main == _PX4_AUTO else _PX4_MAIN.get(main)


def _ardupilot_name(vehicle_type: int, custom_mode: int) -> str | None:
    table = _ARDUPILOT_TABLES.get(vehicle_type, "COPTER_MODE")
    entry = mavlink.enums[table].get(custom_mode)
    if entry is None or entry.name.endswith("ENUM_END"):
        return None
    return entry.name.removeprefix(f"{table}_")
