"""Packets as TI's firmware sends them, put together field by field."""

from __future__ import annotations

import struct

import numpy as np

MAGIC = bytes.fromhex("0201040306050807")
AWR1843 = 0xA1843
SDK3, SDK2 = 0x03050004, 0x02010004

Point = tuple[float, float, float, float]
"""x, y, z, radial speed"""


def tlv(kind: int, data: bytes) -> bytes:
    return struct.pack("<2I", kind, len(data)) + data


def packet(
    number: int, objects: int, parts: list[bytes], *, version: int = SDK3, sub_frame: int | None = 0, fill: bool = True
) -> bytes:
    """``sub_frame`` None: the short header of the earliest firmware."""
    tail = b"" if sub_frame is None else struct.pack("<I", sub_frame)
    body = b"".join(parts)
    length = 8 + 28 + len(tail) + len(body)
    full = -(-length // 32) * 32 if fill else length
    header = MAGIC + struct.pack("<7I", version, full, AWR1843, number, 123456, objects, len(parts)) + tail
    return header + body + bytes(full - length)


def side_information(strengths_db: list[float], noise_db: float = 12.0) -> bytes:
    values = [(round(10 * strength), round(10 * noise_db)) for strength in strengths_db]
    return tlv(7, np.array(values, "<i2").tobytes())


def sdk3(number: int, points: list[Point], strengths_db: list[float] | None = None, *, sub_frame: int = 0) -> bytes:
    parts = [tlv(1, np.array(points, "<f4").tobytes())] if points else []
    if strengths_db:
        parts.append(side_information(strengths_db))
    return packet(number, len(points), parts, sub_frame=sub_frame)


def sdk2(
    number: int, points: list[tuple[int, int, float, float, float]], bits: int = 8, *, sub_frame: int | None = 0
) -> bytes:
    """Points: range cell, speed cell, x, y, z."""
    rows = [
        struct.pack("<HhH3h", cell, speed, 900, *(round(v * 2**bits) for v in (x, y, z)))
        for cell, speed, x, y, z in points
    ]
    parts = [tlv(1, struct.pack("<2H", len(points), bits) + b"".join(rows))] if points else []
    return packet(number, len(points), parts, version=SDK2, sub_frame=sub_frame)


POINTS = [(1.0, 20.0, 0.5, -3.0), (-4.0, 60.0, 2.0, 0.31)]


def frame(number: int) -> bytes:
    return sdk3(number, POINTS, [20.0, 15.5])


def with_profile(number: int, cells: int) -> bytes:
    points = tlv(1, np.array(POINTS, "<f4").tobytes())
    return packet(number, len(POINTS), [points, tlv(2, np.arange(cells, dtype="<u2").tobytes())])
