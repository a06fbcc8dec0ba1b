"""Messages of other aircraft as receivers send them, packed and read back by pymavlink."""

from __future__ import annotations

import math
import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mapping.geometry.frames import moved_deg
from telemetry.topics.vehicle import VehicleState

HERE = (47.0, 8.0)
ALL_VALID = 1 | 2 | 4 | 8 | 16 | 32 | 128 | 256
MAC = bytes([0x0A, 0x1B, 0x2C, 0x3D, 0x4E, 0x5F])


def over_the_air(message: Any, *, system: int = 1, component: int = 156) -> Any:
    link = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
    return mavlink.MAVLink(None).decode(bytearray(message.pack(link)))


def e7(place_deg: tuple[float, float]) -> tuple[int, int]:
    return round(place_deg[0] * 1e7), round(place_deg[1] * 1e7)


def adsb_message(**changes: Any) -> Any:
    """800 m east of HERE, 150 m higher, to the west at 40 m/s."""
    lat, lon = e7(changes.pop("at", moved_deg(HERE, 800.0, 0.0)))
    fields: dict[str, Any] = {
        "ICAO_address": 0x4B1805,
        "lat": lat,
        "lon": lon,
        "altitude_type": 1,
        "altitude": 650_000,
        "heading": 27_000,
        "hor_velocity": 4_000,
        "ver_velocity": 100,
        "callsign": b"HBABC",
        "emitter_type": 1,
        "tslc": 0,
        "flags": ALL_VALID,
        "squawk": 7000,
    }
    return mavlink.MAVLink_adsb_vehicle_message(**(fields | changes))


def adsb(**changes: Any) -> Any:
    return over_the_air(adsb_message(**changes))


def padded(data: bytes, count: int = 20) -> list[int]:
    return list(data.ljust(count, b"\0"))


def basic_id(uas_id: bytes = b"1581F5FKD", mac: bytes = MAC, **changes: Any) -> Any:
    fields: dict[str, Any] = {"id_type": 1, "ua_type": 2} | changes
    return over_the_air(
        mavlink.MAVLink_open_drone_id_basic_id_message(0, 0, padded(mac), uas_id=padded(uas_id), **fields)
    )


def location(mac: bytes = MAC, **changes: Any) -> Any:
    lat, lon = e7(changes.pop("at", moved_deg(HERE, 0.0, 500.0)))
    fields: dict[str, Any] = {
        "status": 2,
        "direction": 18_000,
        "speed_horizontal": 1_000,
        "speed_vertical": -150,
        "latitude": lat,
        "longitude": lon,
        "altitude_barometric": 480.0,
        "altitude_geodetic": 560.0,
        "height_reference": 0,
        "height": 60.0,
        "horizontal_accuracy": 10,
        "vertical_accuracy": 4,
        "barometer_accuracy": 3,
        "speed_accuracy": 3,
        "timestamp": 1234.5,
        "timestamp_accuracy": 1,
    } | changes
    return over_the_air(mavlink.MAVLink_open_drone_id_location_message(0, 0, padded(mac), **fields))


def system(operator: tuple[float, float] = (46.9, 7.9), mac: bytes = MAC) -> Any:
    lat, lon = e7(operator)
    message = mavlink.MAVLink_open_drone_id_system_message(
        0, 0, padded(mac), 1, 1, lat, lon, 1, 0, -1000.0, -1000.0, 1, 1, -1000.0, 0
    )
    return over_the_air(message)


def utm(*, component: int = 1, source: int = 9, **changes: Any) -> Any:
    lat, lon = e7(changes.pop("at", moved_deg(HERE, -700.0, 0.0)))
    fields: dict[str, Any] = {
        "time": 1_700_000_000_000_000,
        "uas_id": padded(b"UTM-7", 18),
        "lat": lat,
        "lon": lon,
        "alt": 590_000,
        "relative_alt": 80_000,
        "vx": 300,
        "vy": -400,
        "vz": 50,
        "h_acc": 2_000,
        "v_acc": 4_000,
        "vel_acc": 50,
        "next_lat": 0,
        "next_lon": 0,
        "next_alt": 0,
        "update_rate": 100,
        "flight_state": 3,
        "flags": 127,
    } | changes
    message = mavlink.MAVLink_utm_global_position_message(**fields)
    return over_the_air(message, system=source, component=component)


def packed_basic_id(uas_id: bytes = b"1581F5FKD", *, id_type: int = 1, ua_type: int = 2) -> bytes:
    return bytes([0x02, id_type << 4 | ua_type]) + uas_id.ljust(20, b"\0") + bytes(3)


def packed_location(
    *,
    at: tuple[float, float] = HERE,
    status: int = 2,
    course: int = 90,
    east_of: bool = True,
    speed: int = 40,
    fast: bool = False,
    climb: int = -3,
    baro: int = 2960,
    geo: int = 3120,
    tenths: int = 12345,
) -> bytes:
    flags = status << 4 | east_of << 1 | fast
    body = struct.pack(
        "<BBBbiiHHHBBHBB", flags, course, speed, climb, *e7(at), baro, geo, 2120, 4 << 4 | 10, 3, tenths, 1, 0
    )
    return bytes([0x12]) + body


def packed_system(operator: tuple[float, float] = (46.9, 7.9)) -> bytes:
    return bytes([0x42, 1]) + struct.pack("<ii", *e7(operator)) + bytes(15)


def message_pack(*parts: bytes, size: int = 25, count: int | None = None) -> Any:
    data = padded(b"".join(parts), 225)[:225]
    number = len(parts) if count is None else count
    return over_the_air(mavlink.MAVLink_open_drone_id_message_pack_message(0, 0, padded(MAC), size, number, data))


def own_state(now_s: float = 100.0, **changes: Any) -> VehicleState:
    """At HERE, 500 m above the sea and 548 m above the ellipsoid, to the north at 5 m/s."""
    fields: dict[str, Any] = {
        "armed": True,
        "position_t_mono_s": now_s,
        "lat_deg": HERE[0],
        "lon_deg": HERE[1],
        "alt_amsl_m": 500.0,
        "gnss_alt_amsl_m": 502.0,
        "gnss_alt_ellipsoid_m": 550.0,
        "v_north_m_s": 5.0,
        "v_east_m_s": 0.0,
        "v_down_m_s": 0.0,
        "climb_m_s": 0.0,
        "heading_rad": math.radians(0.0),
        "landed": "in_air",
    } | changes
    return VehicleState(1, 1, **fields)
