"""What workers do with recordings: prove that an uploaded one can be read, and read one that is being written.

The readers bring in the wire protocols; they are imported by the workers only, so that the page answers sooner.
"""

from __future__ import annotations

from pathlib import Path

from server.heard.flown_track import EVERY_S
from server.plan.file_tasks import named
from server.work.jobs import Progress
from telemetry.errors import TelemetryError
from telemetry.topics.vehicle import VehicleState


def read(upload: Path, filename: str, *, report: Progress) -> None:
    """Raises RecordingError, in words about the operator's own file."""
    from telemetry.recording.flight_log import read_flight_log

    report("Reading the recording", None)
    with named(upload, filename, kind=TelemetryError):
        read_flight_log(upload)


def states_so_far(path: Path, *, report: Progress) -> list[VehicleState]:
    """Of a recording that is being written: the positions since the vehicle armed, thinned. Raises RecordingError."""
    from telemetry.recording.flight_log import read_flight_log

    report("Reading the recording", None)
    log = read_flight_log(path)
    armed_utc_s = next((t for t, armed in reversed(log.armed) if armed), log.end_utc_s)
    kept: list[VehicleState] = []
    for t_utc_s, state in log.states:
        if t_utc_s >= armed_utc_s and (not kept or state.t_utc_s - kept[-1].t_utc_s >= EVERY_S):
            kept.append(state)
    return kept
