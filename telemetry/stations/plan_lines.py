"""The line that another station's vehicle flies, as it travels: few points with times, and how wrong they may be.

MessagePack of bounded whole numbers: each point as steps from the one before. A line is known by what is in it, so that
none is taken for another one: whatever started again in between, and whoever asked for it when.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from hashlib import blake2b
from typing import Annotated

import msgspec
import numpy as np

from mapping.geometry.arrays import F64
from telemetry.errors import StationsError
from telemetry.stations.station_messages import decode

MOST_POINTS, LINE_BYTES = 128, 4096
ROUNDED_M = 0.1
"""Added to the error: positions to 1e-7 degree, heights to a centimetre, times to a millisecond at up to 60 m/s."""
MOST_ERROR_M = 15.0
"""A line that may be more wrong is neither told nor used."""
Meta = msgspec.Meta
_Step = Annotated[int, Meta(ge=-1_000_000_000, le=1_000_000_000)]
_StepUp = Annotated[int, Meta(ge=-10_000_000, le=10_000_000)]
_StepMs = Annotated[int, Meta(ge=0, le=100_000_000)]


class LineWire(msgspec.Struct, array_like=True, frozen=True, forbid_unknown_fields=True):
    error_cm: Annotated[int, Meta(ge=0, le=10_000_000)]
    lat_e7: Annotated[int, Meta(ge=-900_000_000, le=900_000_000)]
    """Of the first point, as are the next three."""
    lon_e7: Annotated[int, Meta(ge=-1_800_000_000, le=1_800_000_000)]
    alt_amsl_cm: _StepUp
    t_ms: _StepMs
    steps: Annotated[tuple[tuple[_Step, _Step, _StepUp, _StepMs], ...], Meta(min_length=1, max_length=MOST_POINTS - 1)]
    """Latitude, longitude, height and time of each point less those of the one before."""


@dataclass(frozen=True, slots=True)
class PlanLine:
    """Straight in latitude and longitude from point to point."""

    lat_lon_deg: F64
    """(N, 2), 2 <= N <= ``MOST_POINTS``"""
    alt_amsl_m: F64
    """(N,)"""
    t_s: F64
    """(N,) predicted seconds, never falling; ``FleetVehicle.line_s`` is on the same clock"""
    error_m: float
    """At any time the planned place is no farther from the line's."""


def packed(line: PlanLine) -> bytes:
    """Raises StationsError for one that cannot be told: it leads too far, or takes too long."""
    error_cm = math.ceil(100.0 * (line.error_m + ROUNDED_M))
    rows = np.column_stack([1e7 * line.lat_lon_deg, 100.0 * line.alt_amsl_m, 1000.0 * line.t_s])
    if not np.isfinite(rows).all() or len(rows) < 2:
        raise StationsError("A line without places, heights and times cannot be told to other stations.")
    whole = np.round(rows).astype(np.int64)
    first, steps = whole[0].tolist(), np.diff(whole, axis=0).tolist()
    payload = msgspec.msgpack.encode([error_cm, *first, steps])
    unpacked(payload)
    return payload


def unpacked(payload: bytes) -> PlanLine:
    """Raises StationsError: too long, malformed, or out of bounds."""
    wire = decode(payload, LineWire, LINE_BYTES)
    first = [wire.lat_e7, wire.lon_e7, wire.alt_amsl_cm, wire.t_ms]
    rows = np.cumsum(np.array([first, *wire.steps], dtype=np.float64), axis=0)
    if np.abs(rows[:, 0]).max() > 900_000_000 or np.abs(rows[:, 2]).max() > 10_000_000:
        raise StationsError("A line leads off the earth.")
    return PlanLine(rows[:, :2] / 1e7, rows[:, 2] / 100.0, rows[:, 3] / 1000.0, wire.error_cm / 100.0)


def line_id(payload: bytes) -> int:
    """Never 0, which stands for none."""
    return int.from_bytes(blake2b(payload, digest_size=5).digest()) + 1
