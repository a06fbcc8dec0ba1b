"""One packet of the data port: a header, then parts that tell type and length (TLV), all little-endian.

Header: magic word, version (major, minor, bugfix, build), total length, platform, frame number, CPU cycles, detected
objects, number of parts and, on all but the earliest firmware, the sub-frame's number. A packet is filled up to a
multiple of 32 bytes. Part 1 holds the points: floats in SDK 3, fixed point with a descriptor in SDK 1 and 2.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F32, U16, Bools

MAGIC = bytes((2, 1, 4, 3, 6, 5, 8, 7))
HEADER_BYTES, SHORT_HEADER_BYTES = 40, 36
"""With and without the number of the sub-frame."""
LONGEST_BYTES = 1 << 16
"""Of a packet; the largest heat map takes half of it."""
FILL_BYTES = 32
POINTS, RANGE_PROFILE, SIDE_INFO = 1, 2, 7
"""Types of the parts that are read."""
FARTHEST_M, FASTEST_M_S = 400.0, 200.0
_HEAD = struct.Struct("<7I")
_PART = struct.Struct("<2I")
_DESCRIPTOR = struct.Struct("<2H")
_FIXED_POINT = np.dtype(
    [("range_cell", "<u2"), ("speed_cell", "<i2"), ("peak", "<u2"), ("xyz", "<i2", (3,))]
)  # fmt: skip


class DamagedPacketError(Exception):
    """A packet that is not what its own lengths say."""


@dataclass(slots=True)
class TiFrame:
    """One frame's points. Body frame: x to the right, y forward, z up."""

    number: int
    sub_frame: int
    sdk: tuple[int, int]
    """Major and minor."""
    platform: int
    """0xA1843 is an AWR1843."""
    xyz_m: F32
    """(N, 3)"""
    radial_speed_m_s: F32
    """(N,) positive: moving away; NaN where the stream tells cells and their size is not known"""
    snr_db: F32
    """(N,) NaN where the sensor sends no side information"""
    noise_db: F32
    """(N,) as ``snr_db``"""
    range_profile: U16
    """(range cells,) the firmware's logarithm of the magnitude without motion; empty where it is not sent"""
    packet_bytes: int
    lost_before: int = 0
    """Frames between the last one and this one that never came."""

    @property
    def periods(self) -> int:
        """Since the frame before; none for a further sub-frame."""
        return 0 if self.sub_frame else 1 + self.lost_before


def packet_bytes(head: bytes | bytearray) -> int | None:
    """Length of the packet that begins with these 16 bytes; None where no packet begins like that."""
    version, length = _PART.unpack_from(head, len(MAGIC))
    plausible = 1 <= version >> 24 <= 4 and SHORT_HEADER_BYTES <= length <= LONGEST_BYTES
    return length if plausible else None


def decode_packet(packet: bytes, *, velocity_cell_m_s: float) -> tuple[TiFrame, int]:
    """A whole packet -> its frame, and how many of its points were too absurd to keep. Raises DamagedPacketError."""
    version, _, platform, number, _, objects, count = _HEAD.unpack_from(packet, len(MAGIC))
    major = version >> 24
    header_bytes, parts = _parts(packet, count, major)
    xyz_m, speed = _points(parts.get(POINTS, b""), objects, major, velocity_cell_m_s)
    snr_db, noise_db = _side_information(parts.get(SIDE_INFO), len(xyz_m))
    profile = parts.get(RANGE_PROFILE, b"")
    if len(profile) % 2:
        raise DamagedPacketError("half a range cell")
    kept = _plausible(xyz_m, speed)
    frame = TiFrame(
        number=number,
        sub_frame=struct.unpack_from("<I", packet, SHORT_HEADER_BYTES)[0] if header_bytes == HEADER_BYTES else 0,
        sdk=(major, version >> 16 & 255),
        platform=platform,
        xyz_m=xyz_m[kept],
        radial_speed_m_s=speed[kept],
        snr_db=snr_db[kept],
        noise_db=noise_db[kept],
        range_profile=np.frombuffer(profile, "<u2"),
        packet_bytes=len(packet),
    )
    return frame, len(kept) - int(kept.sum())


def _parts(packet: bytes, count: int, major: int) -> tuple[int, dict[int, bytes]]:
    """The header's length and the parts by type: SDK 3 has the long header, older ones the one that comes out even."""
    lengths = (HEADER_BYTES,) if major >= 3 else (HEADER_BYTES, SHORT_HEADER_BYTES)
    for header_bytes in lengths:
        parts = dict(_walk(packet, header_bytes, count))
        if parts.pop(-1, b""):
            return header_bytes, parts
    raise DamagedPacketError("the lengths of its parts do not add up")


def _walk(packet: bytes, offset: int, count: int) -> Iterator[tuple[int, bytes]]:
    """Types and contents; ends with type -1 when nothing but filling is left over."""
    if count > len(packet) // _PART.size:
        return
    for _ in range(count):
        if offset + _PART.size > len(packet):
            return
        kind, length = _PART.unpack_from(packet, offset)
        offset += _PART.size
        if offset + length > len(packet):
            return
        yield kind, packet[offset : offset + length]
        offset += length
    if 0 <= len(packet) - offset < FILL_BYTES:
        yield -1, b"whole"


def _points(data: bytes, objects: int, major: int, velocity_cell_m_s: float) -> tuple[F32, F32]:
    """(N, 3) places and (N,) speeds, by the version's layout, whose length must fit."""
    if not data:
        if objects and major >= 3:
            raise DamagedPacketError("points are announced and missing")
        return np.zeros((0, 3), np.float32), np.zeros(0, np.float32)
    if major >= 3:
        if len(data) != 16 * objects:
            raise DamagedPacketError("another number of points than announced")
        table = np.frombuffer(data, "<f4").reshape(-1, 4)
        return table[:, :3].copy(), table[:, 3].copy()
    if len(data) < _DESCRIPTOR.size:
        raise DamagedPacketError("no descriptor of the points")
    count, fraction_bits = _DESCRIPTOR.unpack_from(data)
    if len(data) != _DESCRIPTOR.size + count * _FIXED_POINT.itemsize or fraction_bits > 15:
        raise DamagedPacketError("another number of points than described")
    fixed = np.frombuffer(data, _FIXED_POINT, offset=_DESCRIPTOR.size)
    xyz_m = fixed["xyz"].reshape(-1, 3).astype(np.float32) / np.float32(1 << fraction_bits)
    return xyz_m, fixed["speed_cell"].astype(np.float32) * np.float32(velocity_cell_m_s)


def _side_information(data: bytes | None, points: int) -> tuple[F32, F32]:
    """Strength over noise, and noise, both sent in tenths of a decibel."""
    if data is None:
        return np.full(points, np.nan, np.float32), np.full(points, np.nan, np.float32)
    if len(data) != 4 * points:
        raise DamagedPacketError("side information of another number of points")
    table = np.frombuffer(data, "<i2").reshape(-1, 2).astype(np.float32) * np.float32(0.1)
    return table[:, 0].copy(), table[:, 1].copy()


def _plausible(xyz_m: F32, speed: F32) -> Bools:
    with np.errstate(over="ignore", invalid="ignore"):
        near = np.linalg.norm(xyz_m.astype(np.float64), axis=1) <= FARTHEST_M
    return near & ~(np.abs(speed) > FASTEST_M_S) & ~np.isinf(speed)
