"""Where an agent's readings come from: lines of JSON that a sensor's driver writes, or a recorded flight."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import numpy as np

from telemetry.agent.client import CloudReading, NoticeReading, RadarReading, Reading, SlamReading
from telemetry.agent.wire import TARGET_COLUMNS, Slam
from telemetry.errors import SensorLinkError
from telemetry.messages import Topic
from telemetry.recording.reader import open_recording
from telemetry.sensing import CloudFrame, RadarFrame, SlamPose, rows

_TRACKING = ("good", "poor", "lost")
_RECORDED = (Topic.RADAR_FRAME, Topic.CLOUD_FRAME, Topic.SLAM_POSE)


def readings_of_lines(lines: TextIO) -> Iterator[Reading]:
    """One JSON object per line (docs/agent.md). Raises SensorLinkError naming the first line that is none."""
    for number, line in enumerate(lines, start=1):
        if line.strip():
            yield reading_of(line, where=f"line {number}")


def reading_of(line: str, *, where: str) -> Reading:
    """Without "t_s" it was measured now. Raises SensorLinkError."""
    try:
        record = json.loads(line)
        t_s = float(record.get("t_s", time.monotonic()))
        match record["type"]:
            case "radar":
                return RadarReading(t_s, _table(record["targets"], TARGET_COLUMNS))
            case "cloud":
                return CloudReading(t_s, _table(record["points"], 3))
            case "slam":
                return SlamReading(t_s, _slam(record))
            case other:
                raise ValueError(f'the type is "{other}"')
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise SensorLinkError(
            f"This is no reading of a sensor: {error}.",
            where=where,
            advice='Write {"type": "radar", "targets": [[x, y, z, speed, snr], ...]} or as docs/agent.md says.',
        ) from error


def recorded_readings(path: Path) -> Iterator[tuple[float, Reading]]:
    """Seconds since the first of them, and the reading with that time. Raises RecordingError."""
    with open_recording(path) as recording:
        first_s = math.nan
        for entry in recording.entries(_RECORDED):
            message = entry.message
            if not isinstance(message, RadarFrame | CloudFrame | SlamPose):
                continue
            if math.isnan(first_s):
                first_s = message.t_mono_s
            yield message.t_mono_s - first_s, _reading(message)


def at(reading: Reading, t_s: float) -> Reading:
    """The same, measured at another time."""
    match reading:
        case RadarReading(_, targets, lost):
            return RadarReading(t_s, targets, lost)
        case CloudReading(_, xyz_m):
            return CloudReading(t_s, xyz_m)
        case SlamReading(_, slam):
            return SlamReading(t_s, slam)
        case NoticeReading(_, warning, text):
            return NoticeReading(t_s, warning, text)


def _reading(message: RadarFrame | CloudFrame | SlamPose) -> Reading:
    t_s = message.t_mono_s
    match message:
        case RadarFrame():
            columns = (rows(message.xyz_m, 3), rows(message.radial_speed_m_s, 1), rows(message.snr_db, 1))
            return RadarReading(t_s, np.hstack(columns))
        case CloudFrame():
            return CloudReading(t_s, rows(message.xyz_m, 3))
        case SlamPose():
            return SlamReading(t_s, Slam(t_s, message.position_m, message.q_wxyz, message.tracking))


def _table(values: Any, columns: int) -> np.ndarray[Any, np.dtype[np.float32]]:
    table = np.asarray(values, dtype=np.float32)
    if table.size == 0:
        return np.zeros((0, columns), np.float32)
    if table.ndim != 2 or table.shape[1] != columns:
        raise ValueError(f"a row has {columns} numbers")
    return table


def _slam(record: dict[str, Any]) -> Slam:
    x, y, z = (float(value) for value in record["position_m"])
    qw, qx, qy, qz = (float(value) for value in record["q_wxyz"])
    tracking = record.get("tracking", "good")
    if tracking not in _TRACKING:
        raise ValueError(f"tracking is one of {', '.join(_TRACKING)}")
    return Slam(0.0, (x, y, z), (qw, qx, qy, qz), tracking)
