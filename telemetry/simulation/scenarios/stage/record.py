"""Writes a scenario's flight as a recording that Review opens: ground, states, frames, maps, alerts; no clock."""

from __future__ import annotations

from pathlib import Path

from planning.terrain.dsm import Dsm
from telemetry.recording.carried_ground import MEDIA_TYPE, NAME, packed
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.recorded_topics import RECORDED
from telemetry.simulation.scenarios.stage.virtual_link import T0_MONO_S, T0_UTC_S
from telemetry.topics.messages import Published


class FlightRecording:
    """One file. Nothing reads a clock: the same flight gives the same file."""

    def __init__(self, path: Path, name: str, ground: Dsm) -> None:
        """``ground``: what is known of it. Raises RecordingError when the file cannot be created."""
        carried = packed(ground)
        self._virtual_s = 0.0
        self._writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name=name, now=self._now)
        self._writer.attach(NAME, MEDIA_TYPE, carried, T0_UTC_S)

    def tell(self, topic: str, message: Published, t_utc_s: float) -> None:
        if topic in RECORDED:
            self._virtual_s = t_utc_s - T0_UTC_S
            self._writer.write(topic, message, t_utc_s)

    def close(self) -> None:
        self._writer.close()

    def _now(self) -> float:
        return self._virtual_s
