"""Traffic messages to reports: ADSB_VEHICLE, OPEN_DRONE_ID_* and UTM_GLOBAL_POSITION.

A pure function. What a message declares invalid or unknown becomes None, as does what no aircraft can be: a latitude of
95 degrees, a height of 40 km. Whatever a message holds, reading it raises nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.reduce import INT32_MAX, lat_lon
from telemetry.topics.traffic import HeightDatum
from telemetry.traffic import remote_id
from telemetry.traffic.report import Identity, Position, Report
from telemetry.traffic.words import ADSB_KINDS, clean

LOWEST_M, HIGHEST_M = -1_000.0, 30_000.0
"""No aircraft is lower or higher."""
FASTEST_M_S, FASTEST_CLIMB_M_S = 1_000.0, 150.0
_EMERGENCIES = frozenset({7500, 7600, 7700})
_SURFACE = frozenset(
    {mavlink.ADSB_EMITTER_TYPE_EMERGENCY_SURFACE, mavlink.ADSB_EMITTER_TYPE_SERVICE_SURFACE}
    | {mavlink.ADSB_EMITTER_TYPE_POINT_OBSTACLE}
)
_UTM_SIGMAS_95 = 2.45
"""Of a place in the plane."""
_UINT16_MAX = 65535


def reports(message: Any) -> tuple[Report, ...]:
    """Of any message; none for one that tells of no aircraft."""
    reader = _READERS.get(message.get_type())
    return () if reader is None else reader(message)


def is_traffic(message: Any) -> bool:
    return message.get_type() in _READERS


def _adsb(message: Any) -> tuple[Report, ...]:
    flags = message.flags

    def told(flag: int, value: float) -> float | None:
        return value if flags & flag else None

    named = flags & mavlink.ADSB_FLAGS_VALID_CALLSIGN
    name = clean(message.callsign) if named else ""
    kind = ADSB_KINDS.get(message.emitter_type, "")
    is_crewed = message.emitter_type != mavlink.ADSB_EMITTER_TYPE_UAV
    identity = Identity(name, kind, is_crewed)
    key = f"adsb {message.ICAO_address & 0xFFFFFFFF:06x}"
    lat_deg, lon_deg = lat_lon(message.lat, message.lon)
    if not flags & mavlink.ADSB_FLAGS_VALID_COORDS or lat_deg is None or lon_deg is None:
        return (Report(key, "adsb", identity),)
    alt_m, datum = _adsb_height(message)
    course_deg = told(mavlink.ADSB_FLAGS_VALID_HEADING, message.heading / 100)
    position = Position(
        lat_deg,
        lon_deg,
        delay_s=float(message.tslc),
        speed_m_s=_within(told(mavlink.ADSB_FLAGS_VALID_VELOCITY, message.hor_velocity / 100), 0.0, FASTEST_M_S),
        course_rad=_course(course_deg),
        climb_m_s=_climb(told(mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID, message.ver_velocity / 100)),
        alt_m=alt_m,
        alt_datum=datum,
        on_ground=message.emitter_type in _SURFACE,
        emergency=bool(flags & mavlink.ADSB_FLAGS_VALID_SQUAWK) and message.squawk in _EMERGENCIES,
    )
    return (Report(key, "adsb", identity, position),)


def _adsb_height(message: Any) -> tuple[float | None, HeightDatum]:
    """The message calls both kinds "ASL"; transponders send the one by the standard pressure, and the other above the
    ellipsoid."""
    is_pressure = message.altitude_type == mavlink.ADSB_ALTITUDE_TYPE_PRESSURE_QNH
    needed = mavlink.ADSB_FLAGS_VALID_ALTITUDE | (mavlink.ADSB_FLAGS_BARO_VALID if is_pressure else 0)
    alt_m = _height(message.altitude / 1000) if message.flags & needed else None
    return (None, "unknown") if alt_m is None else (alt_m, "pressure" if is_pressure else "gnss")


def _utm(message: Any) -> tuple[Report, ...]:
    flags = message.flags
    uas_id = bytes(message.uas_id).rstrip(b"\0")
    has_id = bool(flags & mavlink.UTM_DATA_AVAIL_FLAGS_UAS_ID_AVAILABLE and uas_id)
    sender = (message.get_srcSystem(), message.get_srcComponent())
    number = uas_id.hex() if has_id else f"system {sender[0]}"
    identity = Identity(clean(uas_id) or f"…{number[-6:]}" if has_id else "", "drone", False)
    key = f"utm {number}"
    lat_deg, lon_deg = lat_lon(message.lat, message.lon)
    if not flags & mavlink.UTM_DATA_AVAIL_FLAGS_POSITION_AVAILABLE or lat_deg is None or lon_deg is None:
        return (Report(key, "utm", identity),)
    has_speed = flags & mavlink.UTM_DATA_AVAIL_FLAGS_HORIZONTAL_VELO_AVAILABLE
    north, east = message.vx / 100, message.vy / 100
    has_climb = flags & mavlink.UTM_DATA_AVAIL_FLAGS_VERTICAL_VELO_AVAILABLE
    has_alt = flags & mavlink.UTM_DATA_AVAIL_FLAGS_ALTITUDE_AVAILABLE and message.alt != INT32_MAX
    alt_m = _height(message.alt / 1000) if has_alt else None
    position = Position(
        lat_deg,
        lon_deg,
        stamp=message.time / 1e6 if flags & mavlink.UTM_DATA_AVAIL_FLAGS_TIME_VALID and message.time else None,
        within_m=_accuracy(message.h_acc),
        speed_m_s=math.hypot(north, east) if has_speed else None,
        course_rad=math.atan2(east, north) % math.tau if has_speed else None,
        climb_m_s=0.0 - message.vz / 100 if has_climb else None,
        alt_m=alt_m,
        alt_datum="unknown" if alt_m is None else "gnss",
        alt_within_m=_accuracy(message.v_acc),
        on_ground=message.flight_state == mavlink.UTM_FLIGHT_STATE_GROUND,
        emergency=message.flight_state in (mavlink.UTM_FLIGHT_STATE_EMERGENCY, mavlink.UTM_FLIGHT_STATE_NOCTRL),
    )
    return (Report(key, "utm", identity, position),)


def _accuracy(sigma_mm: int) -> float | None:
    return None if sigma_mm in (0, _UINT16_MAX) else _UTM_SIGMAS_95 * sigma_mm / 1000


def _basic_id(message: Any) -> tuple[Report, ...]:
    told = remote_id.BasicId(message.id_type, message.ua_type, bytes(message.uas_id))
    return (_remote(message, remote_id.identity(told)),)


def _location(message: Any) -> tuple[Report, ...]:
    told = remote_id.Location(
        status=message.status,
        course_deg=message.direction / 100,
        speed_m_s=message.speed_horizontal / 100,
        climb_m_s=message.speed_vertical / 100,
        lat_e7=message.latitude,
        lon_e7=message.longitude,
        alt_pressure_m=message.altitude_barometric,
        alt_ellipsoid_m=message.altitude_geodetic,
        horizontal_accuracy=message.horizontal_accuracy,
        vertical_accuracy=message.vertical_accuracy,
        pressure_accuracy=message.barometer_accuracy,
        past_hour_s=message.timestamp,
    )
    return (_remote(message, Identity(), _position(told)),)


def _system(message: Any) -> tuple[Report, ...]:
    told = remote_id.System(message.operator_latitude, message.operator_longitude)
    return (_remote(message, remote_id.operator(told)),)


def _message_pack(message: Any) -> tuple[Report, ...]:
    """Identity before position, so that a pack's place has its name."""
    if message.single_message_size != remote_id.MESSAGE_BYTES or not 1 <= message.msg_pack_size <= remote_id.PACK_MAX:
        return ()
    data = bytes(message.messages)[: remote_id.MESSAGE_BYTES * message.msg_pack_size]
    found: list[Report] = []
    for told in remote_id.unpacked(data):
        match told:
            case remote_id.BasicId():
                found.append(_remote(message, remote_id.identity(told)))
            case remote_id.System():
                found.append(_remote(message, remote_id.operator(told)))
            case remote_id.Location():
                found.append(_remote(message, Identity(is_crewed=False), _position(told)))
    return tuple(sorted(found, key=lambda report: report.position is not None))


def _remote(message: Any, identity: Identity, position: Position | None = None) -> Report:
    """Messages without the address that another aircraft was heard under are the vehicle's own, on their way to its
    transmitter."""
    address = bytes(message.id_or_mac)
    is_own = not any(address)
    key = "rid own" if is_own else f"rid {address.rstrip(bytes(1)).hex()}"
    return Report(key, "remote_id", identity, position, is_own=is_own)


def _position(told: remote_id.Location) -> Position | None:
    lat_deg, lon_deg = lat_lon(told.lat_e7, told.lon_e7)
    if lat_deg is None or lon_deg is None:
        return None
    alt_m, datum, grade = _height(_known(told.alt_ellipsoid_m)), "ellipsoid", told.vertical_accuracy
    if alt_m is None:
        alt_m, datum, grade = _height(_known(told.alt_pressure_m)), "pressure", told.pressure_accuracy
    stamp_s = told.past_hour_s
    return Position(
        lat_deg,
        lon_deg,
        stamp=stamp_s if math.isfinite(stamp_s) and 0 <= stamp_s <= 3600 else None,
        within_m=remote_id.HORIZONTAL_M.get(told.horizontal_accuracy),
        speed_m_s=told.speed_m_s if 0 <= told.speed_m_s < remote_id.UNKNOWN_SPEED_M_S else None,
        course_rad=_course(told.course_deg),
        climb_m_s=told.climb_m_s if abs(told.climb_m_s) < remote_id.UNKNOWN_CLIMB_M_S else None,
        alt_m=alt_m,
        alt_datum="unknown" if alt_m is None else "ellipsoid" if datum == "ellipsoid" else "pressure",
        alt_within_m=None if alt_m is None else remote_id.VERTICAL_M.get(grade),
        on_ground=told.status == mavlink.MAV_ODID_STATUS_GROUND,
        emergency=told.status == mavlink.MAV_ODID_STATUS_EMERGENCY,
    )


def _known(alt_m: float) -> float | None:
    return None if alt_m == remote_id.UNKNOWN_ALT_M else alt_m


def _within(value: float | None, low: float, high: float) -> float | None:
    return value if value is not None and math.isfinite(value) and low <= value <= high else None


def _height(alt_m: float | None) -> float | None:
    return _within(alt_m, LOWEST_M, HIGHEST_M)


def _climb(climb_m_s: float | None) -> float | None:
    return _within(climb_m_s, -FASTEST_CLIMB_M_S, FASTEST_CLIMB_M_S)


def _course(course_deg: float | None) -> float | None:
    known_deg = _within(course_deg, 0.0, 360.0)
    return None if known_deg is None else math.radians(known_deg) % math.tau


_READERS: dict[str, Callable[[Any], tuple[Report, ...]]] = {
    "ADSB_VEHICLE": _adsb,
    "UTM_GLOBAL_POSITION": _utm,
    "OPEN_DRONE_ID_BASIC_ID": _basic_id,
    "OPEN_DRONE_ID_LOCATION": _location,
    "OPEN_DRONE_ID_SYSTEM": _system,
    "OPEN_DRONE_ID_MESSAGE_PACK": _message_pack,
}
