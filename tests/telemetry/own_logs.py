"""Vehicles' own logs for tests, written after their descriptions with nothing of the project's readers."""

from __future__ import annotations

import struct
from typing import Any

_LETTERS = {
    "Q": "Q",
    "B": "B",
    "b": "b",
    "C": "H",
    "M": "B",
    "H": "H",
    "I": "I",
    "L": "i",
    "f": "f",
    "Z": "64s",
    "N": "16s",
    "c": "h",
    "a": "64s",
}
GPS_WEEK, GPS_MS = 2400, 100_000_000
STARTED_UTC_S = 315_964_800 + GPS_WEEK * 604_800 + GPS_MS / 1000 - 18
"""What 100 s of week 2400 are since 1970, less the leap seconds since 2017."""


class DataFlashWriter:
    def __init__(self) -> None:
        self.data = bytearray()
        self._kinds: dict[str, tuple[int, str]] = {}

    def describe(self, name: str, letters: str, columns: str, *, length: int | None = None) -> None:
        number = len(self._kinds) + 1
        packing = "<" + "".join(_LETTERS.get(letter, "B") for letter in letters)
        self._kinds[name] = (number, packing)
        size = struct.calcsize(packing) + 3 if length is None else length
        head = struct.pack("<BB4s16s64s", number, size, name.encode(), letters.encode(), columns.encode())
        self.data += b"\xa3\x95\x80" + head

    def write(self, name: str, *values: Any) -> None:
        number, packing = self._kinds[name]
        self.data += b"\xa3\x95" + bytes((number,)) + struct.pack(packing, *values)


def dataflash(seconds: int = 20) -> bytes:
    """Ten positions a second due north at 5 m/s, armed and in AUTO, from 100 s after the vehicle's start on."""
    log = DataFlashWriter()
    log.describe("MSG", "QZ", "TimeUS,Message")
    log.describe("PARM", "QNf", "TimeUS,Name,Value")
    log.describe("MODE", "QMBB", "TimeUS,Mode,ModeNum,Rsn")
    log.describe("ORGN", "QBLLf", "TimeUS,Type,Lat,Lng,Alt")
    log.describe("GPS", "QBBIHBfLLf", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt")
    log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    log.describe("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw")
    log.describe("BAT", "QBffffB", "TimeUS,Inst,Volt,VoltR,Curr,CurrTot,RemPct")
    log.describe("CMD", "QHHHffffLLfB", "TimeUS,CTot,CNum,CId,Prm1,Prm2,Prm3,Prm4,Lat,Lng,Alt,Frame")
    log.describe("EV", "QB", "TimeUS,Id")
    start_us = 100_000_000
    log.write("MSG", start_us, b"ArduCopter V4.5.7 (0a1b2c3d)")
    log.write("PARM", start_us, b"SYSID_THISMAV", 7.0)
    log.write("MODE", start_us, 3, 3, 1)
    log.write("ORGN", start_us, 1, 480_000_000, 110_000_000, 500.0)
    for number, (command, lat_e7, alt_m) in enumerate(
        [(16, 480_000_000, 500.0), (22, 480_000_000, 10.0), (16, 480_009_000, 10.0)]
    ):
        log.write("CMD", start_us, 3, number, command, 0, 0, 0, 0, lat_e7, 110_000_000, alt_m, 3 if number else 0)
    for step in range(10 * seconds):
        t_us = start_us + 100_000 * step
        lat_e7 = 480_000_000 + round(step * 0.5 / 111_195 * 1e7)
        log.write("POS", t_us, lat_e7, 110_000_000, 510.0, 10.0, 10.0)
        log.write("ATT", t_us, 1.0, -2.0, 0.0)
        if step % 2 == 0:
            gps_ms = GPS_MS + 100 * step
            log.write("GPS", t_us, 0, 3, gps_ms, GPS_WEEK, 12, 0.8, lat_e7, 110_000_000, 511.0)
            log.write("BAT", t_us, 0, 16.1, 16.2, 11.0, 100.0 + step, 80)
    log.write("MSG", start_us + 100_000 * 10 * seconds, b"Reached command #2")
    log.write("EV", start_us + 100_000 * 10 * seconds, 11)
    return bytes(log.data)


def ulog_record(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


def ulog_head() -> bytes:
    return b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 50_000_000) + ulog_record("B", bytes(40))


def ulog(seconds: int = 10) -> bytes:
    """Five positions a second, 50 s after the vehicle's start; home is corrected by a metre half way."""
    parts = [ulog_head()]
    formats = [
        "vehicle_global_position:uint64_t timestamp;double lat;double lon;float alt;uint8_t[4] _padding0;",
        "home_position:uint64_t timestamp;double lat;double lon;float alt;bool valid_hpos;bool valid_alt;",
        "vehicle_status:uint64_t timestamp;uint8_t nav_state;uint8_t arming_state;uint8_t system_id;",
        "vehicle_gps_position:uint64_t timestamp;uint64_t time_utc_usec;uint8_t fix_type;uint8_t satellites_used;",
        "vehicle_attitude:uint64_t timestamp;float[4] q;",
    ]
    parts += [ulog_record("F", text.encode()) for text in formats]
    parts.append(
        ulog_record("I", bytes((len("uint32_t ver_sw_release"),)) + b"uint32_t ver_sw_release\xff\x02\x0e\x01")
    )
    for number, text in enumerate(formats):
        parts.append(ulog_record("A", struct.pack("<BH", 0, number) + text.partition(":")[0].encode()))

    def logged(number: int, t_us: int, packing: str, *values: Any) -> None:
        parts.append(ulog_record("D", struct.pack("<HQ" + packing, number, t_us, *values)))

    logged(2, 50_000_000, "BBB", 3, 2, 9)
    logged(1, 50_000_000, "ddfBB", 47.0, 8.0, 500.0, 1, 1)
    for step in range(5 * seconds):
        t_us = 50_000_000 + 200_000 * step
        if step == 5 * seconds // 2:
            logged(1, t_us, "ddfBB", 47.0, 8.0, 501.0, 1, 1)
        # The padding at a record's end is not written.
        logged(0, t_us, "ddf", 47.0 + step * 1e-5, 8.0, 510.0)
        logged(4, t_us, "ffff", 0.5**0.5, 0.0, 0.0, 0.5**0.5)
        logged(3, t_us, "QBB", 1_700_000_000_000_000 + t_us, 3, 14)
        if step % 5 == 0:
            parts.append(ulog_record("S", b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"))
    parts.append(ulog_record("L", b"4" + struct.pack("<Q", 51_000_000) + b"[commander] Armed by external command\t"))
    parts.append(ulog_record("O", struct.pack("<H", 250)))
    return b"".join(parts)
