"""Messages as they come out of a receiver, for tests that have no sockets."""

from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

ARDUPILOT, PX4, GUIDED, AUTO, RTL, ARMED = 3, 12, 4, 3, 6, 129


def packed(message: Any, *, system: int = 1, component: int = 1, sequence: int = 0) -> bytes:
    codec = mavlink.MAVLink(None, system, component)
    codec.seq = sequence
    return bytes(message.pack(codec))


def heard(message: Any, *, system: int = 1, component: int = 1, sequence: int = 0) -> Any:
    """The message as it comes out of a receiver's codec."""
    frame = packed(message, system=system, component=component, sequence=sequence)
    return mavlink.MAVLink(None).decode(bytearray(frame))


def heartbeat(
    autopilot: int = ARDUPILOT, kind: int = 2, custom_mode: int = AUTO, base_mode: int = 1, status: int = 3
) -> Any:
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, base_mode, custom_mode, status, 3)


def ground_station_heartbeat() -> Any:
    return mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)


def attitude(t_boot_ms: int = 0) -> Any:
    return mavlink.MAVLink_attitude_message(t_boot_ms, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
