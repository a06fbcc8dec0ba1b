"""``distance_sensor`` and ``obstacle_distance`` of PX4's ULog as single ranges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mapping.geometry import quaternions
from mapping.geometry.arrays import F64
from telemetry.mavlink.ranges import NORTH_ALIGNED, Direction, Limits, direction_of, sector_ranges, single_range
from telemetry.recording.tlog import Data
from telemetry.recording.vehicle_logs.logged_ranges import LoggedRanges
from telemetry.recording.vehicle_logs.rows import Rows
from telemetry.recording.vehicle_logs.ulog import read_ulog
from telemetry.recording.vehicle_logs.ulog_flight import timed

SINGLE, SECTORS = "distance_sensor", "obstacle_distance"
_BY_QUATERNION, _SECTORS = 100, 72
"""distance_sensor.orientation: ROTATION_CUSTOM"""
_INVALID_QUALITY, _DISABLED = 0, 2
_LEAST_LENGTH = 0.5
"""Of a quaternion that says anything; it should be 1."""


def read_ulog_ranges(data: Data) -> LoggedRanges:
    """Every instance of both topics."""
    ulog, found = read_ulog(data, {SINGLE, SECTORS}), LoggedRanges()
    for name, instance in sorted(ulog.found):
        rows, t_s = timed(ulog, name, instance)
        sensor = f"{name} {instance}"
        if name == SINGLE:
            _singles(rows, t_s, sensor, found)
        else:
            _sectors(rows, t_s, sensor, found)
    return found


def _singles(rows: Rows, t_s: F64, sensor: str, found: LoggedRanges) -> None:
    q = rows.columns("q", 4)
    names = ("current_distance", "min_distance", "max_distance", "orientation", "h_fov", "signal_quality", "mode")
    table = np.column_stack([rows.column(name) for name in names])
    for t, row, q_wxyz in zip(t_s.tolist(), table.tolist(), q, strict=True):
        range_m, nearest_m, farthest_m, orientation, fov_rad, quality, mode = row
        direction = _direction(orientation, q_wxyz)
        if quality == _INVALID_QUALITY or mode == _DISABLED:
            found.not_valid[f"{sensor}: signal invalid, or switched off"] += 1
        elif direction is None:
            found.not_valid[f"{sensor}: orientation {orientation:g} is not understood"] += 1
        elif not all(map(math.isfinite, (range_m, nearest_m, farthest_m))):
            found.not_valid[f"{sensor}: no finite distance or limits"] += 1
        else:
            fov_rad = fov_rad if math.isfinite(fov_rad) else 0.0
            found.take(sensor, t, single_range(range_m, Limits(nearest_m, farthest_m), direction, fov_rad))


def _direction(orientation: float, q_wxyz: Any) -> Direction | None:
    """By its number, else by the quaternion that turns the sensor's axis into the body: forward, right, down."""
    if orientation != _BY_QUATERNION:
        return direction_of(int(orientation)) if math.isfinite(orientation) else None
    if not (np.isfinite(q_wxyz).all() and np.linalg.norm(q_wxyz) > _LEAST_LENGTH):
        return None
    forward, right, down = quaternions.rotation(q_wxyz)[:, 0].tolist()
    return math.atan2(right, forward) % math.tau, -math.asin(max(-1.0, min(1.0, down)))


def _sectors(rows: Rows, t_s: F64, sensor: str, found: LoggedRanges) -> None:
    distances = rows.columns("distances", _SECTORS)
    table = np.column_stack(
        [rows.column(name) for name in ("frame", "increment", "min_distance", "max_distance", "angle_offset")]
    )
    for t, row, distances_cm in zip(t_s.tolist(), table.tolist(), distances, strict=True):
        frame, step_deg, nearest_cm, farthest_cm, offset_deg = row
        if not (np.isfinite(distances_cm).all() and math.isfinite(nearest_cm + farthest_cm + frame)):
            found.not_valid[f"{sensor}: no finite distances, limits or frame"] += 1
            continue
        scan = sector_ranges(
            distances_cm.astype(int).tolist(),
            Limits(nearest_cm / 100.0, farthest_cm / 100.0),
            offset_deg=offset_deg,
            step_deg=step_deg,
            from_north=frame == NORTH_ALIGNED,
        )
        found.take(sensor, t, scan)
