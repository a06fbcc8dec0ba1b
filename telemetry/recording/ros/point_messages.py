"""PointCloud2, LaserScan and Range -> points in the sensor's own frame. Runs in the decoding process."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from telemetry.recording.ros.bag_types import CLOUD, FARTHEST_M, POINT, SCAN

_DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""sensor_msgs/PointField."""
_SPEEDS = ("radial_speed_m_s", "radial_speed", "radial_velocity", "doppler", "velocity")
_STRENGTHS = ("snr_db", "snr")
_MOST_FIELDS, _MOST_STEP_BYTES = 200, 65_536


class MalformedMessageError(ValueError):
    """What in one message contradicts itself."""


def points_of(message: Any, kind: str) -> tuple[NDArray[np.void], int]:
    """(N,) of POINT, and how many had no place. Raises MalformedMessageError."""
    if kind == CLOUD:
        return _finite(_of_cloud(message))
    return _of_scan(message) if kind == SCAN else _of_range(message)


def _finite(found: NDArray[np.void]) -> tuple[NDArray[np.void], int]:
    good = np.flatnonzero((np.abs(found["xyz_m"]) <= FARTHEST_M).all(axis=1))
    return found[good], len(found) - len(good)


def _of_cloud(cloud: Any) -> NDArray[np.void]:
    """Fields by their names, whatever their order, type, spacing and byte order."""
    table = _table(cloud)
    names = table.dtype.names or ()
    found = np.empty(table.size, POINT)
    for axis, name in enumerate("xyz"):
        if name not in names:
            raise MalformedMessageError(f"it has no field {name}, but {', '.join(names) or 'none'}")
        found["xyz_m"][:, axis] = table[name].ravel()
    for column, wanted in (("speed_m_s", _SPEEDS), ("snr_db", _STRENGTHS)):
        name = next((name for name in wanted if name in names), None)
        with np.errstate(over="ignore"):
            found[column] = np.nan if name is None else table[name].ravel()
    return found


def _table(cloud: Any) -> NDArray[np.void]:
    """(height, width), a view into the message's bytes."""
    width, height, step, row = int(cloud.width), int(cloud.height), int(cloud.point_step), int(cloud.row_step)
    data = np.ascontiguousarray(cloud.data, np.uint8)
    row = row if height > 1 or row else width * step
    if not (0 < step <= _MOST_STEP_BYTES and len(cloud.fields) <= _MOST_FIELDS):
        raise MalformedMessageError(f"its points take {step} bytes and have {len(cloud.fields)} fields")
    if width * height and (height - 1) * row + width * step > len(data):
        raise MalformedMessageError(f"it says {width} x {height} points of {step} bytes and has {len(data)} bytes")
    if row < width * step:
        raise MalformedMessageError(f"rows of {row} bytes hold no {width} points of {step} bytes")
    kind = _dtype(cloud, step)
    if width * height == 0:
        return np.empty((0, 0), kind)
    return np.ndarray((height, width), kind, data.tobytes(), strides=(row, step))


def _dtype(cloud: Any, step: int) -> np.dtype[np.void]:
    order, fields = ">" if cloud.is_bigendian else "<", dict[str, tuple[str, int]]()
    for field in cloud.fields:
        kind, offset = _DATATYPES.get(int(field.datatype)), int(field.offset)
        if kind is None or offset + int(kind[1]) > step:
            raise MalformedMessageError(f"its field {field.name[:40]!r} lies outside of its points, or has no type")
        fields.setdefault(str(field.name), (order + kind, offset))
    names = list(fields)
    formats, offsets = [fields[name][0] for name in names], [fields[name][1] for name in names]
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})


def _of_scan(scan: Any) -> tuple[NDArray[np.void], int]:
    """REP 117: beyond the limits, or infinite, is nothing seen; only what is no number is counted."""
    range_m = np.asarray(scan.ranges, np.float64)
    angle_rad = float(scan.angle_min) + float(scan.angle_increment) * np.arange(len(range_m))
    hit = (range_m >= float(scan.range_min)) & (range_m <= float(scan.range_max)) & np.isfinite(angle_rad)
    x, y = range_m[hit] * np.cos(angle_rad[hit]), range_m[hit] * np.sin(angle_rad[hit])
    return _bare(np.column_stack([x, y, np.zeros(len(x))])), int(np.isnan(range_m).sum())


def _of_range(message: Any) -> tuple[NDArray[np.void], int]:
    """On the axis of its cone, x."""
    range_m = float(message.range)
    hit = math.isfinite(range_m) and float(message.min_range) <= range_m <= float(message.max_range)
    return _bare(np.array([[range_m, 0.0, 0.0]] if hit else []).reshape(-1, 3)), int(math.isnan(range_m))


def _bare(xyz_m: NDArray[np.float64]) -> NDArray[np.void]:
    found = np.empty(len(xyz_m), POINT)
    found["xyz_m"], found["speed_m_s"], found["snr_db"] = xyz_m, np.nan, np.nan
    return found
