"""What the board's endpoints are asked, and what they answer: settings, and frames of raw samples.

Endpoint "RBAS" takes frames, "RFMC" tells the sweep. A frame's samples come chirp by chirp, in each receiver by
receiver, first all I, then all Q, packed without gaps; a converter's middle is no signal and is taken off.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import C64, U32
from mapping.radar.radar_params import POSITION2GO, FmcwParams
from telemetry.errors import SensorError

BASE, SWEEP = 0x52424153, 0x52464D43
"""Types of the endpoints: "RBAS", "RFMC"."""
VERSION = 1
RECEIVERS, BOTH_PARTS = 0b11, 2
SAMPLES, CHIRPS = POSITION2GO.samples, POSITION2GO.chirps
PAUSE_S = POSITION2GO.chirp_interval_s - POSITION2GO.samples / POSITION2GO.sample_rate_hz
"""From a chirp's end to the next one's beginning: the board does not tell it."""

LIST_ENDPOINTS = b"\x00"
STOP = struct.pack("<BI", 0x02, 0)
"""The timer that takes frames of its own accord: settings cannot be changed while it runs."""
TAKE_FRAME = b"\x01\x01"
GET_CHIRP, GET_FORMAT, GET_SWEEP = b"\x34", b"\x40", b"\x00"
SET_FORMAT = struct.pack("<BIIBB", 0x41, SAMPLES, CHIRPS, RECEIVERS, BOTH_PARTS)
FORMAT, FRAME = 0x41, 0x00
_UPWARD = 0
_SEPARATE_PARTS = 1
_FRAME_HEAD = struct.Struct("<BIIBIBBBB")
CLIPPED = 0.01
"""Share of samples at the converters' ends from which on a frame was driven too far."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    number: int
    """0 where the board does not count."""
    cube: C64
    """(chirps, receivers, samples), of each chirp and receiver the mean is 0"""
    clipped: float
    """Share of the samples at an end of the converters' scale"""


class WrongAnswerError(Exception):
    """An answer that is not what its own head, or the settings, say."""


def endpoints(data: bytes) -> dict[int, int]:
    """Type -> number of the endpoints of a known version. Raises WrongAnswerError."""
    if len(data) < 2 or data[0] != LIST_ENDPOINTS[0] or len(data) != 2 + 6 * data[1]:
        raise WrongAnswerError("This is no list of endpoints.")
    rows = struct.iter_unpack("<IH", data[2:])
    return {kind: number for number, (kind, version) in enumerate(rows, start=1) if version == VERSION}


def check_format(data: bytes) -> None:
    """Raises WrongAnswerError where the board did not take over the format."""
    if data != SET_FORMAT:
        raise WrongAnswerError(f"It does not take frames of {CHIRPS} chirps of {SAMPLES} samples of two receivers.")


def params_of(sweep: bytes, chirp: bytes) -> FmcwParams:
    """The waveform that the board tells. Raises WrongAnswerError, and SensorError for one that makes no frames here."""
    try:
        _, low_khz, high_khz, direction, _ = struct.unpack("<BIIBB", sweep)
        _, chirp_ns = struct.unpack("<BI", chirp)
    except struct.error as error:
        raise WrongAnswerError("Its sweep has another form.") from error
    if direction != _UPWARD:
        raise SensorError(
            "Its chirps do not go upward only.", advice="Set them so with Infineon's own program, or restart the board."
        )
    if not (23_900_000 <= low_khz < high_khz <= 24_400_000 and 20_000 <= chirp_ns <= 10_000_000):
        raise WrongAnswerError(f"A sweep from {low_khz} to {high_khz} kHz in {chirp_ns} ns is none of its own.")
    chirp_s = chirp_ns * 1e-9
    return replace(
        POSITION2GO,
        start_frequency_hz=low_khz * 1e3,
        slope_hz_per_s=(high_khz - low_khz) * 1e3 / chirp_s,
        sample_rate_hz=SAMPLES / chirp_s,
        chirp_interval_s=chirp_s + PAUSE_S,
    )


def frame_of(data: bytes) -> Frame:
    """Raises WrongAnswerError for a frame of another format, or of another length than its head says."""
    if len(data) < _FRAME_HEAD.size:
        raise WrongAnswerError("The frame is too short.")
    head = _FRAME_HEAD.unpack_from(data)
    kind, number, chirps, receivers, samples, mask, parts, bits, interleaved = head
    told = (kind, chirps, receivers, samples, mask, parts, interleaved)
    if told != (FRAME, CHIRPS, 2, SAMPLES, RECEIVERS, _SEPARATE_PARTS, 0) or not 8 <= bits <= 16:
        raise WrongAnswerError(f"A frame of another format came: {head}.")
    count = chirps * receivers * 2 * samples
    packed = data[_FRAME_HEAD.size :]
    if len(packed) != (count * bits + 7) // 8:
        raise WrongAnswerError(f"A frame of {len(packed)} bytes holds no {count} samples of {bits} bits.")
    words = _unpacked(packed, count, bits)
    ends = np.mean((words == 0) | (words == (1 << bits) - 1))
    blocks = words.reshape(chirps, receivers, 2, samples).astype(np.float32)
    blocks -= blocks.mean(axis=-1, keepdims=True)
    cube = np.ascontiguousarray(blocks[:, :, 0] + 1j * blocks[:, :, 1], dtype=np.complex64)
    return Frame(number, cube, float(ends))


def _unpacked(packed: bytes, count: int, bits: int) -> U32:
    """(count,) numbers of so many bits each, the lowest bit first."""
    each = np.unpackbits(np.frombuffer(packed, np.uint8), bitorder="little")[: count * bits].reshape(count, bits)
    return (each @ (1 << np.arange(bits, dtype=np.uint32))).astype(np.uint32)
