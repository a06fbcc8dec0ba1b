"""MAVLink 2 signing: frames are signed and proven before anything is made of them.

https://mavlink.io/en/guide/message_signing.html. The signature is the beginning of SHA-256 over key and frame; a
timestamp of 10 us counts up per stream (system, component, link), so that no frame is taken twice. Unlike pymavlink's,
no timestamp is written down before its signature has been proven. Frames in, frames and verdicts out; no clock.
"""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import dataclass, field
from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as mavlink
from pymavlink.generator.mavcrc import x25crc

KEY_BYTES = 32
EPOCH_S = 1_420_070_400
"""2015-01-01, from which timestamps count."""
PER_S = 100_000
YOUNG = 60 * PER_S
"""A stream that is new may be so much behind the newest of all."""
FARTHEST = 366 * 86_400 * PER_S
"""A timestamp may be so much ahead: a vehicle with a clock, a computer without one. The largest one would lock out all
others for ever."""
COPY = 5 * PER_S
"""A frame that came over another way before is a copy, once, unless it is older than this, or the newest was proven
longer ago: a vehicle that has fallen silent sends no copies."""
MOST_WAYS = 64
"""That copies are taken from at once."""
UNSIGNED = frozenset({mavlink.MAVLINK_MSG_ID_RADIO_STATUS, mavlink.MAVLINK_MSG_ID_RADIO})
"""Radios put these between the vehicle's own, and have no key."""
_HEADER, _CHECKSUM, _SIGNATURE, _HASH = 10, 2, 13, 6
_SIGNED = mavlink.MAVLINK_IFLAG_SIGNED

Verdict = Literal["good", "unsigned", "wrong", "replayed", "ahead"]
Stream = tuple[int, int, int]
"""System, component, link."""


def timestamp_of(t_utc_s: float) -> int:
    return max(0, round((t_utc_s - EPOCH_S) * PER_S))


def is_signed(frame: bytes) -> bool:
    """Rightly or wrongly."""
    return frame[0] == mavlink.PROTOCOL_MARKER_V2 and bool(frame[2] & _SIGNED)


@dataclass(slots=True)
class Signing:
    """Of one key. ``newest``: the newest timestamp that was sent or proven; ``streams``: the newest of each."""

    key: bytes
    newest: int = 0
    streams: dict[Stream, int] = field(default_factory=dict)
    _floors: dict[Stream, int] = field(init=False)
    """What was proven before this process: below it nothing is a copy."""
    _by_way: dict[tuple[Stream, str], int] = field(init=False, default_factory=dict)
    _proven: dict[Stream, int] = field(init=False, default_factory=dict)
    """When, by our clock, the newest of each was proven."""

    def __post_init__(self) -> None:
        self._floors = dict(self.streams)

    def sign(self, frame: bytes, *, link: int, now: int) -> bytes:
        """An unsigned MAVLink 2 frame, signed. A clock that goes back, or stands, never repeats a timestamp."""
        self.newest = max(now, self.newest + 1)
        end = _HEADER + frame[1]
        signed = bytearray(frame[:end])
        signed[2] |= _SIGNED
        crc = x25crc(bytes(signed[1:]))
        crc.accumulate(bytes([mavlink.mavlink_map[int.from_bytes(frame[7:10], "little")].crc_extra]))
        signed += crc.crc.to_bytes(_CHECKSUM, "little") + bytes([link]) + self.newest.to_bytes(6, "little")
        return bytes(signed) + _hash(self.key, signed)

    def verify(self, frame: bytes, *, now: int, way: str = "", beside: str = "") -> Verdict:
        """Of a whole frame whose checksum holds. What is good is remembered; nothing else changes anything.

        ``way``: the connection that it came on, and who sent it there. Each brings every frame once, the slower one a
        little later. ``beside``: another way whose frames are not to come once more over this one.
        """
        if not is_signed(frame) or len(frame) < _HEADER + _SIGNATURE:
            return "unsigned"
        if not hmac.compare_digest(_hash(self.key, frame[:-_HASH]), frame[-_HASH:]):
            return "wrong"
        stream, at = (frame[5], frame[6], frame[-_SIGNATURE]), int.from_bytes(frame[-12:-6], "little")
        if self._is_replayed(stream, at, (way, beside), now):
            return "replayed"
        if at > max(now, self.newest) + FARTHEST:
            return "ahead"
        if at > self.streams.get(stream, 0):
            self.streams[stream], self._proven[stream] = at, now
        self._remember(stream, at, way)
        self.newest = max(self.newest, at)
        return "good"

    def _remember(self, stream: Stream, at: int, way: str) -> None:
        self._by_way[stream, way] = at
        if len(self._by_way) >= MOST_WAYS:  # what is older than any copy may be says nothing any more
            oldest = {each: newest - COPY for each, newest in self.streams.items()}
            self._by_way = {key: at for key, at in self._by_way.items() if at >= oldest.get(key[0], 0)}

    def _is_replayed(self, stream: Stream, at: int, ways: tuple[str, str], now: int) -> bool:
        newest = self.streams.get(stream)
        if newest is None:
            return at + YOUNG < self.newest
        if at > newest:
            return False
        before = max(self._floors.get(stream, 0), *(self._by_way.get((stream, way), 0) for way in ways))
        is_full = (stream, ways[0]) not in self._by_way and len(self._by_way) >= MOST_WAYS
        is_late = not 0 <= now - self._proven.get(stream, -COPY - 1) <= COPY
        return at <= before or at + COPY < newest or is_late or is_full


def _hash(key: bytes, signed: bytes | bytearray) -> bytes:
    return hashlib.sha256(key + bytes(signed)).digest()[:_HASH]
