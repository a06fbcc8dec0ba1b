"""A vehicle's own log of either kind -> a flight log, and states for replay."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from telemetry.errors import RecordingError
from telemetry.recording.recorded_flight import FlightLog, Stamped, StateHistory, track_of, truth_of
from telemetry.recording.tlog import Data
from telemetry.recording.tlog_flight import mission_flown
from telemetry.recording.vehicle_logs.columns import EARLIEST_UTC_S, OwnLog
from telemetry.recording.vehicle_logs.dataflash import looks_like_dataflash
from telemetry.recording.vehicle_logs.dataflash_flight import read_dataflash_flight
from telemetry.recording.vehicle_logs.ulog import looks_like_ulog
from telemetry.recording.vehicle_logs.ulog_flight import read_ulog_flight

OwnKind = Literal["dataflash", "ulog"]
_NO_TIME_OF_DAY = "The log holds no time of day: its times count from the vehicle's start."


def kind_of_own_log(data: Data) -> OwnKind | None:
    if looks_like_dataflash(data):
        return "dataflash"
    return "ulog" if looks_like_ulog(data) else None


def read_own_states(path: Path, data: Data, kind: OwnKind) -> tuple[OwnLog, list[Stamped]]:
    """All that the log tells of the vehicle, every time in seconds since 1970. Raises RecordingError."""
    log = read_dataflash_flight(data) if kind == "dataflash" else read_ulog_flight(data)
    log.to_utc()
    states = log.states()
    if not states:
        what = " ".join(["The log holds nothing that could be shown of a flight.", *log.faults])
        raise RecordingError(what, where=path.name, advice="Choose the log of a flight.")
    if states[0][0] < EARLIEST_UTC_S:
        log.faults.append(_NO_TIME_OF_DAY)
    return log, states


def read_own_flight(path: Path, data: Data, kind: OwnKind) -> FlightLog:
    """Raises RecordingError when nothing in it can be shown."""
    log, states = read_own_states(path, data, kind)
    facts, history = log.facts, StateHistory()
    for t_utc_s, state in states:
        history.on_state(state, t_utc_s)
    home = history.home()
    if not history.positions:
        log.faults.append("The log holds no position of the vehicle.")
    return FlightLog(
        kind=kind,
        name=path.name,
        start_utc_s=states[0][0],
        end_utc_s=states[-1][0],
        states=tuple(history.positions),
        track=track_of(history.positions),
        truth=truth_of(facts.truth, home),
        texts=tuple(log.texts),
        modes=tuple(history.modes),
        armed=tuple(history.armed),
        reached=tuple(facts.reached or history.reached),
        targets=(),
        commands=(),
        vehicle=history.last or log.vehicle,
        home=home,
        mission=mission_flown(facts, history),
        plan=None,
        faults=tuple(log.faults),
    )
