"""Reads any recording, Hedgehop's own, another ground station's or the vehicle's, as one flight log."""

from __future__ import annotations

from pathlib import Path

from telemetry.recording.file_types import foreign, is_mcap, opened
from telemetry.recording.mcap_flight import read_mcap_flight
from telemetry.recording.recorded_flight import FlightLog, HomePosition, RecordedTrack
from telemetry.recording.tlog_flight import looks_like_tlog, read_tlog_flight
from telemetry.recording.vehicle_logs.own_flight import kind_of_own_log, read_own_flight

__all__ = ["FlightLog", "HomePosition", "RecordedTrack", "read_flight_log"]


def read_flight_log(path: Path) -> FlightLog:
    """A recording (also of a killed recorder), a telemetry log or a vehicle's own log -> all that review needs.

    Raises RecordingError for files that are empty, foreign or hold no flight: it says what the file is instead.
    """
    with opened(path) as data:
        if is_mcap(data):
            return read_mcap_flight(path, data)
        if (kind := kind_of_own_log(data)) is not None:
            return read_own_flight(path, data, kind)
        if looks_like_tlog(data):
            return read_tlog_flight(path, data)
        raise foreign(path, data)
