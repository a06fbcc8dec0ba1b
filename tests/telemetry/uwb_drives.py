"""A simulated UWB radar's drive as it comes over the bus: vehicle states ten times a second, and scans between them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from mapping.sensor_frames import UwbScan, packed
from planning.ground.traversable import UwbScans
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState

T0_MONO_S, T0_UTC_S = 500.0, 1_700_000_000.0
OFFSET_S = 0.03
"""Of a scan from the state before it."""


def state_of(t_mono_s: float, lat_deg: float, lon_deg: float, heading_rad: float) -> VehicleState:
    return VehicleState(
        1,
        1,
        t_utc_s=T0_UTC_S + float(t_mono_s) - T0_MONO_S,
        position_t_mono_s=float(t_mono_s),
        attitude_t_mono_s=float(t_mono_s),
        lat_deg=lat_deg,
        lon_deg=lon_deg,
        roll_rad=0.0,
        pitch_rad=0.0,
        heading_rad=float(heading_rad),
    )


def scan_of(number: int, t_mono_s: float, intensity: np.ndarray, **lies: float) -> UwbScan:
    t_mono_s = float(t_mono_s)
    t_utc_s = T0_UTC_S + t_mono_s - T0_MONO_S
    return UwbScan(t_mono_s, t_utc_s, number, "rover", packed(np.asarray(intensity, np.float32)), **lies)


def on_the_bus(log: UwbScans) -> Iterator[VehicleState | UwbScan]:
    """The vehicle is where the log says at the middle between two states; it moves on evenly."""
    places, headings = log.lat_lon_deg, np.unwrap(log.heading_rad)
    for k, t_s in enumerate(log.t_s):
        step = (places[min(k + 1, len(places) - 1)] - places[k]) / 10.0
        turn = (headings[min(k + 1, len(headings) - 1)] - headings[k]) / 10.0
        lat_deg, lon_deg = (places[k] - 3 * step).tolist()
        yield state_of(T0_MONO_S + t_s, lat_deg, lon_deg, (headings[k] - 3 * turn) % (2 * math.pi))
        yield scan_of(k, T0_MONO_S + t_s + OFFSET_S, log.intensity[k])


def write_recording(path: Path, log: UwbScans, *, poses: bool = True) -> Path:
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name="drive")
    for message in on_the_bus(log):
        if isinstance(message, UwbScan):
            writer.write(Topic.UWB_SCAN, message, message.t_utc_s)
        elif poses:
            writer.write(Topic.VEHICLE, message, message.t_utc_s)
    writer.close()
    return path
