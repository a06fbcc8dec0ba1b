"""How a ULog is packed: messages behind a length each, topics described in the file itself.

After https://docs.px4.io/main/en/dev_log/ulog_file_format. Fields stand in the order of their sizes, as PX4 sorts them.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

MAGIC, VERSION = b"ULog\x01\x12\x35", 1
SYNC = bytes((0x2F, 0x73, 0x13, 0x20, 0x25, 0x0C, 0xBB, 0x12))
_PACKED = {
    "uint64_t": "Q", "int32_t": "i", "uint32_t": "I", "uint16_t": "H", "uint8_t": "B", "bool": "?", "float": "f",
    "double": "d",
}  # fmt: skip
_TEXT_AT = ord("0")
"""Levels of texts are written as figures."""
TOPICS: dict[str, str] = {
    "vehicle_status": "uint64_t timestamp;uint64_t armed_time;uint8_t arming_state;uint8_t nav_state_user_intention;"
    "uint8_t nav_state;uint8_t vehicle_type;bool failsafe;bool gcs_connection_lost;uint8_t system_type;"
    "uint8_t system_id;uint8_t component_id;bool pre_flight_checks_pass;",
    "vehicle_land_detected": "uint64_t timestamp;bool ground_contact;bool maybe_landed;bool landed;",
    "vehicle_attitude": "uint64_t timestamp;uint64_t timestamp_sample;float[4] q;",
    "vehicle_local_position": "uint64_t timestamp;uint64_t timestamp_sample;uint64_t ref_timestamp;double ref_lat;"
    "double ref_lon;float x;float y;float z;float vx;float vy;float vz;float heading;float ref_alt;float dist_bottom;"
    "float eph;float epv;bool xy_valid;bool z_valid;bool v_xy_valid;bool v_z_valid;bool xy_global;bool z_global;"
    "bool dist_bottom_valid;",
    "vehicle_local_position_setpoint": "uint64_t timestamp;float x;float y;float z;float vx;float vy;float vz;"
    "float[3] acceleration;float yaw;",
    "vehicle_global_position": "uint64_t timestamp;uint64_t timestamp_sample;double lat;double lon;float alt;"
    "float eph;float epv;bool lat_lon_valid;bool alt_valid;",
    "vehicle_global_position_groundtruth": "uint64_t timestamp;uint64_t timestamp_sample;double lat;double lon;"
    "float alt;bool lat_lon_valid;bool alt_valid;",
    "sensor_gps": "uint64_t timestamp;double latitude_deg;double longitude_deg;double altitude_msl_m;"
    "uint64_t time_utc_usec;float eph;float epv;float hdop;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;"
    "uint8_t fix_type;bool vel_ned_valid;uint8_t satellites_used;",
    "battery_status": "uint64_t timestamp;float voltage_v;float current_a;float discharged_mah;float remaining;"
    "bool connected;uint8_t cell_count;",
    "home_position": "uint64_t timestamp;double lat;double lon;float alt;float x;float y;float z;uint32_t update_count;"
    "bool valid_alt;bool valid_hpos;bool valid_lpos;",
    "mission_result": "uint64_t timestamp;int32_t seq_reached;uint16_t seq_current;uint16_t seq_total;bool valid;"
    "bool finished;",
    "wind": "uint64_t timestamp;float windspeed_north;float windspeed_east;",
}  # fmt: skip
"""Those of PX4's topics and fields that the simulated vehicle knows."""
_NUMBERS = {name: number for number, name in enumerate(TOPICS)}


def _packing(fields: str) -> struct.Struct:
    codes = "<"
    for field in fields.removesuffix(";").split(";"):
        kind, _, count = field.partition(" ")[0].removesuffix("]").partition("[")
        codes += count + _PACKED[kind]
    return struct.Struct(codes)


_STRUCTS = {name: _packing(fields) for name, fields in TOPICS.items()}


def head(t_us: int, told: Mapping[str, str | int], parameters: Mapping[str, float]) -> bytes:
    """All that stands before the first record; ``parameters`` that are whole are written so."""
    nothing_appended = bytes(40)
    return b"".join([
        MAGIC + bytes((VERSION,)) + struct.pack("<Q", t_us),
        message("B", nothing_appended),
        *(message("F", f"{name}:{fields}".encode()) for name, fields in TOPICS.items()),
        *(_information(name, value) for name, value in told.items()),
        *(_parameter(name, value) for name, value in parameters.items()),
        *(message("A", struct.pack("<BH", 0, number) + name.encode()) for name, number in _NUMBERS.items()),
    ])  # fmt: skip


def record(name: str, *values: Any) -> bytes:
    return message("D", struct.pack("<H", _NUMBERS[name]) + _STRUCTS[name].pack(*values))


def text(t_us: int, severity: int, words: str) -> bytes:
    """``severity``: MAV_SEVERITY, which are the levels of PX4's log as well."""
    return message("L", struct.pack("<BQ", _TEXT_AT + severity, t_us) + words.encode())


def message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def mark() -> bytes:
    """Where a reader finds its way again."""
    return message("S", SYNC)


def _information(name: str, value: str | int) -> bytes:
    if isinstance(value, str):
        encoded = value.encode()
        return _keyed("I", f"char[{len(encoded)}] {name}", encoded)
    kind = "uint64_t" if value >= 1 << 32 else "uint32_t"
    return _keyed("I", f"{kind} {name}", struct.pack("<" + _PACKED[kind], value))


def _parameter(name: str, value: float) -> bytes:
    if isinstance(value, int):
        return _keyed("P", f"int32_t {name}", struct.pack("<i", value))
    return _keyed("P", f"float {name}", struct.pack("<f", value))


def _keyed(kind: str, key: str, value: bytes) -> bytes:
    return message(kind, bytes((len(key),)) + key.encode() + value)
