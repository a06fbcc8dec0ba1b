"""What a list says of a vehicle's own log, from its first and last bytes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from telemetry.recording.tlog import Data
from telemetry.recording.vehicle_logs import ulog_flight
from telemetry.recording.vehicle_logs.columns import EARLIEST_UTC_S, middle_utc_s
from telemetry.recording.vehicle_logs.dataflash import MARKER, read_dataflash
from telemetry.recording.vehicle_logs.dataflash_flight import gps_utc_s, timed, vehicle_words
from telemetry.recording.vehicle_logs.own_flight import OwnKind
from telemetry.recording.vehicle_logs.ulog import FILE_HEAD_BYTES, SYNC, read_ulog
from telemetry.recording.vehicle_logs.ulog_flight import utc_minus_boot_s, version_of

_HEAD_BYTES, _TAIL_BYTES = 1 << 20, 1 << 18
_DATAFLASH = ("MSG", "GPS", "ATT", "POS", "MODE", "BAT")
_ULOG = ("vehicle_attitude", "vehicle_gps_position", "sensor_gps", "vehicle_status", "battery_status")


@dataclass(frozen=True, slots=True)
class Glance:
    """None: not told by the bytes that were looked at."""

    start_utc_s: float | None
    duration_s: float | None
    version: str
    cut_short: bool


def glance_at(data: Data, kind: OwnKind) -> Glance:
    return _dataflash(data) if kind == "dataflash" else _ulog(data)


def _dataflash(data: Data) -> Glance:
    head = read_dataflash(data[:_HEAD_BYTES], _DATAFLASH)
    start = data.find(MARKER, max(0, len(data) - _TAIL_BYTES))
    tail = read_dataflash(data, _DATAFLASH, start=max(0, start), kinds=head.kinds)
    times_s = [timed(part, name)[1] for part in (head, tail) for name in _DATAFLASH]
    known_s = np.concatenate(times_s)
    gps, gps_t_s = timed(head, "GPS")
    utc_minus_boot = middle_utc_s(gps_utc_s(gps), gps_t_s)
    if not len(known_s):
        return Glance(None, None, "", tail.damage.cut_short)
    starts = None if utc_minus_boot is None else float(known_s.min()) + utc_minus_boot
    version = vehicle_words(timed(head, "MSG")[0].texts("Message"))[1]
    return Glance(starts, float(known_s.max() - known_s.min()), version, tail.damage.cut_short)


def _ulog(data: Data) -> Glance:
    head = read_ulog(data[:_HEAD_BYTES], _ULOG)
    start_s = int.from_bytes(data[8:FILE_HEAD_BYTES], "little") / 1e6
    mark = data.find(SYNC, max(FILE_HEAD_BYTES, len(data) - _TAIL_BYTES)) if len(data) > _HEAD_BYTES else -1
    tail = read_ulog(data, _ULOG, start=mark + len(SYNC), head=head) if mark >= 0 else head
    utc_minus_boot = utc_minus_boot_s(head)
    if utc_minus_boot is None and start_s > EARLIEST_UTC_S:
        utc_minus_boot = 0.0  # simulated vehicles whose own clock is the time of day
    starts = None if utc_minus_boot is None else start_s + utc_minus_boot
    known_s = np.concatenate([ulog_flight.timed(tail, name)[1] for name in _ULOG])
    lasts_s = float(known_s.max()) - start_s if len(known_s) and known_s.max() >= start_s else None
    return Glance(starts, lasts_s, version_of(head) or "", tail.damage.cut_short)
