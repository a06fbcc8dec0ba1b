"""What a list of recordings says of each file, found without reading all of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import RecordingError
from telemetry.mavlink.reduce import autopilot_name
from telemetry.recording.file_types import foreign, is_mcap, opened
from telemetry.recording.frame_facts import decode_frame
from telemetry.recording.mcap_files.continuing import ABOUT
from telemetry.recording.mcap_files.reader import UNFINISHED, own_contents
from telemetry.recording.mcap_files.scan import glance
from telemetry.recording.mcap_files.writer import PLAN, VEHICLE
from telemetry.recording.tlog import CUT_SHORT, Damage, Data, LogFrame, tlog_frames
from telemetry.recording.tlog_flight import looks_like_tlog
from telemetry.recording.vehicle_logs.glance import glance_at
from telemetry.recording.vehicle_logs.own_flight import OwnKind, kind_of_own_log

_AUTOPILOTS = {"ardupilot": "ArduPilot", "px4": "PX4"}
_HEAD_BYTES = 256 * 1024
_TAIL_BYTES = 64 * 1024
_HEARTBEAT = 0
LATEST_UTC_S = 253_402_300_799.0
"""The last second of the year 9999: later ones are no dates."""


@dataclass(frozen=True, slots=True)
class RecordingInfo:
    """One line of a list. ``fault``: why the file cannot be opened, or what is wrong with it; None if nothing is."""

    name: str
    """File name without folder."""
    size_bytes: int
    kind: Literal["hedgehop", "tlog", "dataflash", "ulog", "unreadable"] = "unreadable"
    start_utc_s: float | None = None
    duration_s: float | None = None
    vehicle: str = ""
    """Such as ``ArduPilot 4.7.0-dev, system 1``."""
    plan_name: str = ""
    terrain_id: str = ""
    terrain_sha256: str = ""
    fault: str | None = None


def describe_recording(path: Path) -> RecordingInfo:
    """Never raises for what a file holds: what is wrong with it stands in ``fault``."""
    try:
        size = path.stat().st_size
    except OSError as error:
        return RecordingInfo(path.name, 0, fault=f"The file cannot be read: {error.strerror}.")
    try:
        with opened(path) as data:
            if is_mcap(data):
                return _dated(_of_mcap(path.name, data))
            if (kind := kind_of_own_log(data)) is not None:
                return _dated(_of_own_log(path.name, data, kind))
            if looks_like_tlog(data):
                return _dated(_of_tlog(path.name, data))
            raise foreign(path, data)
    except RecordingError as error:
        return RecordingInfo(path.name, size, fault=error.what)


def _dated(info: RecordingInfo) -> RecordingInfo:
    """Without a time that is none."""
    start_s, lasts_s = info.start_utc_s, info.duration_s
    if start_s is not None and not 0.0 <= start_s <= LATEST_UTC_S:
        fault = " ".join(filter(None, ("The time in it is no date.", info.fault)))
        info = replace(info, start_utc_s=None, fault=fault)
    if lasts_s is not None and not (0.0 <= lasts_s <= LATEST_UTC_S and math.isfinite(lasts_s)):
        info = replace(info, duration_s=None)
    return info


def _of_mcap(name: str, data: Data) -> RecordingInfo:
    contents = own_contents(name, data, glance)
    about, plan = contents.metadata.get(ABOUT, {}), contents.metadata.get(PLAN, {})
    return RecordingInfo(
        name=name,
        size_bytes=len(data),
        kind="hedgehop",
        start_utc_s=contents.start_ns / 1e9,
        duration_s=(contents.end_ns - contents.start_ns) / 1e9,
        vehicle=_vehicle_words(contents.metadata.get(VEHICLE, {})),
        plan_name=plan.get("name") or about.get("name", ""),
        terrain_id=plan.get("terrain_id", ""),
        terrain_sha256=plan.get("terrain_sha256", ""),
        fault=None if contents.finished else UNFINISHED,
    )


def _vehicle_words(vehicle: dict[str, str]) -> str:
    if not vehicle:
        return ""
    autopilot = _AUTOPILOTS.get(vehicle.get("autopilot", ""), "Autopilot")
    return (
        f"{' '.join([autopilot, vehicle.get('firmware_version', '')]).strip()}, system {vehicle.get('system_id', '?')}"
    )


def _of_tlog(name: str, data: Data) -> RecordingInfo:
    """Its first and last bytes: damage between them shows when it is opened."""
    head = list(tlog_frames(data[:_HEAD_BYTES]))
    damage = Damage()
    tail = list(tlog_frames(data, damage, start=max(0, len(data) - _TAIL_BYTES)))
    times = [frame.t_utc_s for frame in head + tail]
    return RecordingInfo(
        name=name,
        size_bytes=len(data),
        kind="tlog",
        start_utc_s=min(times),
        duration_s=max(times) - min(times),
        vehicle=_heard(head),
        fault=CUT_SHORT if damage.cut_short else None,
    )


def _of_own_log(name: str, data: Data, kind: OwnKind) -> RecordingInfo:
    found = glance_at(data, kind)
    autopilot = {"dataflash": "ArduPilot", "ulog": "PX4"}[kind]
    return RecordingInfo(
        name=name,
        size_bytes=len(data),
        kind=kind,
        start_utc_s=found.start_utc_s,
        duration_s=found.duration_s,
        vehicle=f"{autopilot} {found.version}".strip(),
        fault=CUT_SHORT if found.cut_short else None,
    )


def _heard(frames: list[LogFrame]) -> str:
    """The first autopilot with a heartbeat."""
    decoder = mavlink.MAVLink(None)
    for frame in frames:
        message = decode_frame(decoder, frame.frame) if frame.message_id == _HEARTBEAT else None
        if message is not None and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID:
            return _vehicle_words({"autopilot": autopilot_name(message.autopilot), "system_id": str(frame.system_id)})
    return ""
