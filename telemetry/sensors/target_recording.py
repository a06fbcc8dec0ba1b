"""Detections as the recordings of flights hold them, so that whatever reads those reads these."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path

from mapping.radar.detections import Detections
from mapping.sensor_frames import RadarFrame
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.sink import describe
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Topic


def radar_frame(found: Detections, *, number: int, t_mono_s: float, t_utc_s: float, source: str) -> RadarFrame:
    """What a live sensor would have put on the bus."""
    columns = (found.xyz_m, found.radial_speed_m_s, found.snr_db)
    return RadarFrame.of(*columns, t_mono_s=t_mono_s, t_utc_s=t_utc_s, number=number, source=source)


def write_targets(path: Path, frames: Iterable[tuple[float, Detections]], *, t_utc_s: float, source: str) -> int:
    """Seconds since the first frame, and its detections, as radar frames of a recording that began at ``t_utc_s``.

    Returns how many were written. A file of that name is replaced once the new one is whole. Raises RecordingError.
    """
    try:
        return _write_targets(path, frames, t_utc_s, source)
    except RecordingError as error:
        advice = f"Check that the folder {path.parent.absolute()} exists, may be written to and has space."
        raise type(error)(error.what, where=str(path), advice=advice) from error


def _write_targets(path: Path, frames: Iterable[tuple[float, Detections]], t_utc_s: float, source: str) -> int:
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    written = 0
    with contextlib.suppress(OSError):
        part.unlink()
    writer = RecordingWriter(part, t_utc_s=t_utc_s, t_mono_s=0.0, name=source)
    try:
        for t_s, found in frames:
            frame = radar_frame(found, number=written, t_mono_s=t_s, t_utc_s=t_utc_s + t_s, source=source)
            writer.write(Topic.RADAR_FRAME, frame, t_utc_s + t_s)
            written += 1
        writer.close()
        _put(part, path)
    except BaseException:
        writer.abandon()
        part.unlink(missing_ok=True)
        raise
    return written


def _put(part: Path, path: Path) -> None:
    try:
        part.replace(path)
    except OSError as error:
        raise describe(error, path) from error
