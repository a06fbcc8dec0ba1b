"""A recorded flight as an agent's source of readings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose, UwbScan
from telemetry.agent.client import CloudReading, RadarReading, Reading
from telemetry.agent.link_messages import Slam, Uwb
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.topics.messages import Topic

_RECORDED = (Topic.RADAR_FRAME, Topic.CLOUD_FRAME, Topic.SLAM_POSE, Topic.UWB_SCAN)


def recorded_readings(path: Path) -> Iterator[tuple[float, Reading]]:
    """Seconds since the first of them, and the reading with that time. Raises RecordingError."""
    with open_recording(path) as recording:
        first_s = math.nan
        for entry in recording.entries(_RECORDED):
            message = entry.message
            if not isinstance(message, RadarFrame | CloudFrame | SlamPose | UwbScan):
                continue
            if math.isnan(first_s):
                first_s = message.t_mono_s
            yield message.t_mono_s - first_s, _reading(message)


def at(reading: Reading, t_s: float) -> Reading:
    """The same, measured at another time."""
    if isinstance(reading, Slam | Uwb):
        return msgspec.structs.replace(reading, t_s=t_s)
    return replace(reading, t_s=t_s)


def _reading(message: RadarFrame | CloudFrame | SlamPose | UwbScan) -> Reading:
    t_s = message.t_mono_s
    match message:
        case RadarFrame():
            return RadarReading(t_s, np.column_stack(message.columns()))
        case CloudFrame():
            return CloudReading(t_s, message.points_m)
        case UwbScan():
            return _scan(message)
        case SlamPose():
            return Slam(t_s, message.position_m, message.q_wxyz, message.tracking)


def _scan(message: UwbScan) -> Uwb:
    angles_deg = math.degrees(message.beamwidth_rad), math.degrees(message.bearing_rad)
    return Uwb(message.number, message.t_mono_s, message.intensity, message.bin_m, message.first_bin_m, *angles_deg)
