"""Livox's CustomMsg -> points in the sensor's own frame, in slices that each have a time. Runs in the decoding process.

Its points are one sweep: each has the nanoseconds that it was measured after the message's own time.
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from telemetry.recording.ros.bag_types import FARTHEST_M, POINT
from telemetry.recording.ros.point_messages import MalformedMessageError

SLICE_NS = 20_000_000
"""All points of a slice count at its middle: 10 ms off at most, 15 cm at 15 m/s."""
_LONGEST_NS = 2_000_000_000
"""Of a sweep; drivers publish them 5 to 100 times a second."""
_MOST_POINTS = 2_000_000
_CLOCK_NS = 1_000_000_000
_COLUMNS = attrgetter("offset_time", "x", "y", "z")

POINT_DEFINITION = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n"
MESSAGE_DEFINITION = (
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\nCustomPoint[] points\n"
)
"""Of bags that carry no definitions."""


def slices_of(message: Any) -> tuple[list[tuple[int, NDArray[np.void]]], int]:
    """(ns after the message's time, (N,) of POINT) each, and how many points had no place.

    A point at the sensor itself is what it writes where nothing came back. A message without any point has one slice
    without any. Raises MalformedMessageError.
    """
    points, said = message.points, int(message.point_num)
    if said != len(points) or said > _MOST_POINTS:
        raise MalformedMessageError(f"it says {said:,} points and has {len(points):,}")
    table = np.array([_COLUMNS(point) for point in points], np.float64).reshape(-1, 4)
    offset_ns, xyz_m = table[:, 0].astype(np.int64), table[:, 1:]
    if len(offset_ns) and offset_ns.max() > _LONGEST_NS:
        raise MalformedMessageError(f"one of its points was measured {offset_ns.max() / 1e9:.3f} s after it")
    is_near = (np.abs(xyz_m) <= FARTHEST_M).all(axis=1)  # NaN is not
    kept = is_near & (xyz_m != 0.0).any(axis=1)
    return list(_sliced(offset_ns[kept], xyz_m[kept])), int((~is_near).sum())


def has_other_clock(message: Any, stamp_ns: int) -> bool:
    """Whether the sensor's own clock tells another time than the header, which counts."""
    return int(message.timebase) != 0 and abs(int(message.timebase) - stamp_ns) > _CLOCK_NS


def _sliced(offset_ns: NDArray[np.int64], xyz_m: NDArray[np.float64]) -> Iterator[tuple[int, NDArray[np.void]]]:
    found = np.empty(len(xyz_m), POINT)
    found["xyz_m"], found["speed_m_s"], found["snr_db"] = xyz_m, np.nan, np.nan
    if not len(found):
        yield 0, found
        return
    numbers = offset_ns // SLICE_NS
    for number in np.unique(numbers).tolist():
        inside = numbers == number
        middle = (int(offset_ns[inside].min()) + int(offset_ns[inside].max())) // 2
        yield middle, found[inside]
