"""Open Drone ID: what its messages mean, and the 25 bytes of each in a message pack (ASTM F3411)."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

from telemetry.mavlink.reduce import lat_lon
from telemetry.traffic.report import Identity
from telemetry.traffic.words import REMOTE_ID_KINDS, clean

MESSAGE_BYTES, PACK_MAX = 25, 9
UNKNOWN_COURSE_DEG, UNKNOWN_SPEED_M_S, UNKNOWN_CLIMB_M_S = 361.0, 255.0, 63.0
UNKNOWN_ALT_M, UNKNOWN_STAMP = -1000.0, 0xFFFF
HORIZONTAL_M = {1: 18_520.0, 2: 7_408.0, 3: 3_704.0, 4: 1_852.0, 5: 926.0, 6: 555.6, 7: 185.2, 8: 92.6} | {
    9: 30.0,
    10: 10.0,
    11: 3.0,
    12: 1.0,
}
"""By MAV_ODID_HOR_ACC: 95 % of the errors are smaller."""
VERTICAL_M = {1: 150.0, 2: 45.0, 3: 25.0, 4: 10.0, 5: 3.0, 6: 1.0}
"""By MAV_ODID_VER_ACC."""
_TEXT_IDS = frozenset({1, 2})
"""MAV_ODID_ID_TYPE of serial number and registration; the others are numbers."""
_BASIC_ID, _LOCATION, _SYSTEM = 0, 1, 4


@dataclass(frozen=True, slots=True)
class BasicId:
    id_type: int
    ua_type: int
    uas_id: bytes


@dataclass(frozen=True, slots=True)
class Location:
    """Unknown values as they are sent."""

    status: int
    course_deg: float
    speed_m_s: float
    climb_m_s: float
    lat_e7: int
    lon_e7: int
    alt_pressure_m: float
    alt_ellipsoid_m: float
    horizontal_accuracy: int
    vertical_accuracy: int
    pressure_accuracy: int
    past_hour_s: float
    """Of UTC."""


@dataclass(frozen=True, slots=True)
class System:
    operator_lat_e7: int
    operator_lon_e7: int


def identity(told: BasicId) -> Identity:
    uas_id = told.uas_id.rstrip(b"\0")
    name = clean(uas_id) if told.id_type in _TEXT_IDS else uas_id.hex() if told.id_type else ""
    return Identity(name, REMOTE_ID_KINDS.get(told.ua_type, "drone"), is_crewed=False)


def operator(told: System) -> Identity:
    lat_deg, lon_deg = lat_lon(told.operator_lat_e7, told.operator_lon_e7)
    return Identity(operator_deg=None if lat_deg is None or lon_deg is None else (lat_deg, lon_deg))


def unpacked(data: bytes) -> Iterator[BasicId | Location | System]:
    """Of whole messages of ``MESSAGE_BYTES``; kinds that say nothing of a place or a name are left out."""
    for at in range(0, len(data) - MESSAGE_BYTES + 1, MESSAGE_BYTES):
        message = data[at : at + MESSAGE_BYTES]
        kind = message[0] >> 4
        if kind == _BASIC_ID:
            yield BasicId(message[1] >> 4, message[1] & 15, message[2:22])
        elif kind == _LOCATION:
            yield _location(message)
        elif kind == _SYSTEM:
            yield System(*struct.unpack_from("<ii", message, 2))


def _location(message: bytes) -> Location:
    flags, course, speed, climb, lat_e7, lon_e7, baro, geo, _, place, pressure, tenths = struct.unpack_from(
        "<BBBbiiHHHBBH", message, 1
    )
    course_deg = course + 180.0 * bool(flags & 2)
    # Fast ones are told in steps of 0.75 m/s, beyond what 255 steps of 0.25 m/s reach.
    speed_m_s = 0.75 * speed + 63.75 if flags & 1 else 0.25 * speed
    return Location(
        status=flags >> 4,
        course_deg=course_deg,
        speed_m_s=speed_m_s,
        climb_m_s=0.5 * climb,
        lat_e7=lat_e7,
        lon_e7=lon_e7,
        alt_pressure_m=0.5 * baro - 1000.0,
        alt_ellipsoid_m=0.5 * geo - 1000.0,
        horizontal_accuracy=place & 15,
        vertical_accuracy=place >> 4,
        pressure_accuracy=pressure >> 4,
        past_hour_s=float(UNKNOWN_STAMP) if tenths == UNKNOWN_STAMP else tenths / 10,
    )
