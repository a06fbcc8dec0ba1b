"""Logs of other programs with distance sensors in them: the vehicle's states, and what was measured, on one clock."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import RecordingError
from telemetry.mavlink.ranges import scan_of, sensor_of
from telemetry.mavlink.reduce import reduce
from telemetry.recording.file_types import is_mcap, opened
from telemetry.recording.frame_facts import decode_frame
from telemetry.recording.tlog import Data, tlog_frames
from telemetry.recording.tlog_flight import looks_like_tlog, survey
from telemetry.recording.vehicle_logs.dataflash_ranges import read_dataflash_ranges
from telemetry.recording.vehicle_logs.logged_ranges import LoggedRanges
from telemetry.recording.vehicle_logs.own_flight import kind_of_own_log, read_own_states
from telemetry.recording.vehicle_logs.ulog_ranges import read_ulog_ranges
from telemetry.topics.vehicle import VehicleState

LogKind = Literal["dataflash", "ulog", "tlog"]
_AS_RECEIVED = "A ground station's log tells when messages came, not when their ranges were measured."


@dataclass(frozen=True, slots=True)
class RangeLog:
    states: list[VehicleState]
    """In the order of time, which is that of ``ranges``: seconds since 1970 where the log tells them."""
    ranges: LoggedRanges
    faults: list[str]


def log_kind(path: Path) -> LogKind | None:
    """None for a recording of Hedgehop, and for whatever is no log at all. Raises RecordingError as ``opened``."""
    with opened(path) as data:
        if is_mcap(data):
            return None
        return kind_of_own_log(data) or ("tlog" if looks_like_tlog(data) else None)


def read_range_log(path: Path, kind: LogKind) -> RangeLog:
    """Raises RecordingError for a log that tells nothing of a flight."""
    with opened(path) as data:
        return _tlog(path, data) if kind == "tlog" else _own(path, data, kind)


def _own(path: Path, data: Data, kind: Literal["dataflash", "ulog"]) -> RangeLog:
    ranges = read_dataflash_ranges(data) if kind == "dataflash" else read_ulog_ranges(data)
    log, states = read_own_states(path, data, kind)
    later_s = log.utc_minus_boot_s or 0.0
    ranges.measured = [each._replace(t_s=each.t_s + later_s) for each in ranges.measured]
    return RangeLog([state for _, state in states], ranges, log.faults)


def _tlog(path: Path, data: Data) -> RangeLog:
    """Of the vehicle's own system; a companion computer's sensors are of another component of it."""
    seen = survey(data)
    address = seen.chosen(path.name)
    decoder, states, ranges = mavlink.MAVLink(None), [VehicleState(*address)], LoggedRanges()
    for entry in tlog_frames(data):
        message = decode_frame(decoder, entry.frame) if entry.system_id == address[0] else None
        if message is None:
            continue
        changed = reduce(states[-1], message, t_mono_s=entry.t_utc_s, t_utc_s=entry.t_utc_s)
        if changed is not None and changed is not states[-1]:
            states.append(changed)
        if (sensor := sensor_of(message)) is not None:
            ranges.take(sensor, entry.t_utc_s, scan_of(message))
    if not states[1:]:
        raise RecordingError("It tells nothing of the vehicle.", where=path.name, advice="Choose another log.")
    doubts = [_AS_RECEIVED] if ranges.measured else []
    return RangeLog(states[1:], ranges, [*seen.damage.words(len(data)), *doubts])
