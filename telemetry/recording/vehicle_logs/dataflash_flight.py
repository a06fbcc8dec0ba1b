"""A DataFlash log of ArduPilot -> what was known of the vehicle."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import MissionItem
from planning.formats.commands import plain_frame
from telemetry.mavlink.modes import mode_name
from telemetry.mavlink.reduce import GNSS_FIXES
from telemetry.recording.frame_facts import FrameFacts, TruePosition
from telemetry.recording.mission_frames import ItemSet
from telemetry.recording.tlog import Data
from telemetry.recording.vehicle_logs.columns import (
    OwnLog,
    Told,
    blowing,
    middle_utc_s,
    moving,
    ordered,
    placed,
    unless,
)
from telemetry.recording.vehicle_logs.dataflash import DataFlash, read_dataflash
from telemetry.recording.vehicle_logs.rows import Rows
from telemetry.topics.messages import VehicleText
from telemetry.topics.vehicle import VehicleState

_WANTED = frozenset(
    [
        *("AHR2", "ARM", "ATT", "BAT", "CMD", "CURR", "DSF", "ERR", "EV", "GPA", "GPS", "MISE", "MODE"),
        *("MSG", "NKF1", "NKF2", "ORGN", "PARM", "POS", "SIM", "XKF1", "XKF2"),
    ]
)
_GPS_EPOCH_UTC_S, _WEEK_S, _LEAP_S = 315_964_800.0, 604_800.0, 18.0
"""1980-01-06; the seconds by which GPS time is ahead since 2017."""
_VERSION = re.compile(r"(Copter|Plane|Rover|Sub) V(\d[\w.\-]*)")
_REACHED = re.compile(r"Reached command #(\d+)")
_TYPES = {"Copter": 2, "Plane": 1, "Rover": 10, "Sub": 12}
"""MAV_TYPE, for the names of modes."""
_ARMING = {"Arming motors": True, "Disarming motors": False}
_EVENT_ARMED, _EVENT_DISARMED, _EVENT_LANDED, _EVENT_NOT_LANDED = 10, 11, 18, 28
_INFO, _ERROR = 6, 3
"""MAV_SEVERITY: the log keeps no severity with its texts."""
_HOME = 1
"""ORGN.Type"""
_ATTITUDES = ("ATT", "XKF1", "NKF1", "AHR2")
_FAILURES = {
    2: "Radio",
    3: "Compass",
    5: "Failsafe: remote control",
    6: "Failsafe: battery",
    8: "Failsafe: ground station",
    9: "Failsafe: fence",
    10: "Flight mode",
    11: "GPS",
    12: "Crash check",
    16: "Estimator check",
    17: "Failsafe: estimator",
    18: "Barometer",
    21: "Terrain",
    22: "Navigation",
    23: "Failsafe: terrain",
    24: "Estimator changed",
    25: "Thrust lost",
    29: "Failsafe: vibration",
    30: "Internal error",
    31: "Failsafe: dead reckoning",
}
"""ERR.Subsys"""


def read_dataflash_flight(data: Data) -> OwnLog:
    flash = read_dataflash(data, _WANTED)
    messages, messages_t_s = timed(flash, "MSG")
    texts = list(zip(messages_t_s.tolist(), messages.texts("Message"), strict=True))
    vehicle = _vehicle(flash, [text for _, text in texts])
    gps, gps_t_s = _receiver(*timed(flash, "GPS"))
    log = OwnLog(vehicle, middle_utc_s(gps_utc_s(gps), gps_t_s))
    log.facts = FrameFacts(vehicle.system_id, vehicle.component_id)
    log.texts = [VehicleText(t, _INFO, text) for t, text in texts] + _failures(flash)
    log.faults = [*flash.damage.words(len(data)), *_doubts(flash)]
    log.told = [
        _position(flash),
        *_velocity(flash, gps, gps_t_s),
        _attitude(flash),
        _battery(flash),
        *_gnss(flash, gps, gps_t_s),
        _wind(flash),
        _home(flash),
        _modes(flash, vehicle.vehicle_type),
        _armed(flash, texts),
        _landed(flash),
        _item_flown(flash),
    ]
    log.facts.reached += [(t, int(found[1])) for t, text in texts if (found := _REACHED.search(text))]
    _missions(flash, log.facts)
    _truth(flash, log.facts)
    return log


def timed(flash: DataFlash, name: str) -> tuple[Rows, F64]:
    """The records of a kind, and when each was written, in seconds since the vehicle's start."""
    rows = flash.rows(name)
    return ordered(rows, rows.column("TimeUS") / 1e6)


def vehicle_words(texts: list[str]) -> tuple[str, str]:
    """What kind of vehicle it is and its version, out of what it said; empty when it did not say."""
    found = next((found for text in texts if (found := _VERSION.search(text))), None)
    return (found[1], found[2]) if found else ("", "")


def gps_utc_s(gps: Rows) -> F64:
    fixed = gps.column("Status") >= 3
    week, in_week_s = gps.column("GWk"), gps.column("GMS") / 1000
    return unless(_GPS_EPOCH_UTC_S + week * _WEEK_S + in_week_s - _LEAP_S, ~fixed | (week <= 0))


def _vehicle(flash: DataFlash, texts: list[str]) -> VehicleState:
    kind, version = vehicle_words(texts)
    values = parameters_of(flash)
    system_id = values.get("MAV_SYSID", values.get("SYSID_THISMAV", 1.0))
    return VehicleState(
        system_id=int(system_id) if 1 <= system_id <= 255 else 1,
        component_id=1,
        autopilot="ardupilot",
        vehicle_type=_TYPES.get(kind, 2),
        firmware_version=version or None,
        # Unless it is told to, ArduPilot writes only while it is armed, and begins a little after arming.
        armed=not values.get("LOG_DISARMED", 0.0),
    )


def parameters_of(flash: DataFlash) -> dict[str, float]:
    """As they were last."""
    rows = flash.rows("PARM")
    return dict(zip(rows.texts("Name"), rows.column("Value").tolist(), strict=True))


def _receiver(gps: Rows, t_s: F64) -> tuple[Rows, F64]:
    """Of several receivers the one that was flown by, at each time."""
    used = gps.column("U") == 1
    chosen = used if used.any() else ~(gps.column("I") > 0)
    return gps.where(chosen), t_s[chosen]


def _position(flash: DataFlash) -> Told:
    """Of the second estimator where the first is not in the log."""
    rows, t_s = timed(flash, "POS" if len(flash.rows("POS")) else "AHR2")
    known = placed(rows.column("Lat"), rows.column("Lng"))
    rows = rows.where(known)
    fields: dict[str, Any] = {
        "lat_deg": rows.column("Lat"),
        "lon_deg": rows.column("Lng"),
        "alt_amsl_m": rows.column("Alt"),
        "alt_rel_home_m": rows.column("RelHomeAlt", "RelAlt"),
    }
    return Told(t_s[known], fields, stamp="position_t_mono_s", exact=True)


def _velocity(flash: DataFlash, gps: Rows, gps_t_s: F64) -> list[Told]:
    """The estimator's; the receiver's where the log has none."""
    for name in ("XKF1", "NKF1"):
        rows, t_s = timed(flash, name)
        first = ~(rows.column("C") > 0)
        if first.any():
            rows = rows.where(first)
            return [moving(t_s[first], rows.column("VN"), rows.column("VE"), rows.column("VD"))]
    speed, course = gps.column("Spd"), np.radians(gps.column("GCrs"))
    return [moving(gps_t_s, speed * np.cos(course), speed * np.sin(course), gps.column("VZ"))]


def _attitude(flash: DataFlash) -> Told:
    """What was flown by; else of the estimator's first core, else of the second estimator."""
    name = next((name for name in _ATTITUDES if len(flash.rows(name))), _ATTITUDES[0])
    rows, t_s = timed(flash, name)
    first = ~(rows.column("C") > 0)
    rows, t_s = rows.where(first), t_s[first]
    fields: dict[str, Any] = {
        "roll_rad": np.radians(rows.column("Roll")),
        "pitch_rad": np.radians(rows.column("Pitch")),
        "heading_rad": np.radians(rows.column("Yaw")) % (2 * np.pi),
    }
    return Told(t_s, fields, stamp="attitude_t_mono_s")


def _battery(flash: DataFlash) -> Told:
    rows, t_s = timed(flash, "BAT")
    if not len(rows):
        rows, t_s = timed(flash, "CURR")
    first = ~(rows.column("Inst", "Instance") > 0)
    rows = rows.where(first)
    percent = rows.column("RemPct")
    fields: dict[str, Any] = {
        "battery_v": rows.column("Volt"),
        "battery_a": rows.column("Curr"),
        "battery_used_mah": rows.column("CurrTot"),
        "battery_share": unless(percent / 100, percent > 100),
    }
    return Told(t_s[first], fields, stamp="battery_t_mono_s")


def _gnss(flash: DataFlash, gps: Rows, t_s: F64) -> list[Told]:
    fixes = [GNSS_FIXES[int(status)] if 0 <= status < len(GNSS_FIXES) else "3d" for status in gps.column("Status")]
    fields: dict[str, Any] = {
        "gnss_fix": fixes,
        "satellites": gps.wholes("NSats"),
        "hdop": gps.column("HDop"),
        "gnss_alt_amsl_m": gps.column("Alt"),
    }
    accuracies, accuracies_t_s = timed(flash, "GPA")
    first = ~(accuracies.column("I") > 0)
    accuracies = accuracies.where(first)
    claimed: dict[str, Any] = {
        "horizontal_accuracy_m": _claimed(accuracies.column("HAcc")),
        "vertical_accuracy_m": _claimed(accuracies.column("VAcc")),
    }
    return [Told(t_s, fields, stamp="gnss_t_mono_s"), Told(accuracies_t_s[first], claimed)]


def _claimed(metres: F64) -> F64:
    """0 and the largest that can be written mean that the receiver claims nothing."""
    return unless(metres, (metres <= 0) | (metres > 655.0))


def _wind(flash: DataFlash) -> Told:
    rows, t_s = timed(flash, "XKF2")
    if not len(rows):
        rows, t_s = timed(flash, "NKF2")
    first = ~(rows.column("C") > 0)
    rows = rows.where(first)
    return blowing(t_s[first], rows.column("VWN"), rows.column("VWE"))


def _home(flash: DataFlash) -> Told:
    rows, t_s = timed(flash, "ORGN")
    is_home = (rows.column("Type") == _HOME) & placed(rows.column("Lat"), rows.column("Lng"))
    rows = rows.where(is_home)
    fields: dict[str, Any] = {
        "home_lat_deg": rows.column("Lat"),
        "home_lon_deg": rows.column("Lng"),
        "home_alt_amsl_m": rows.column("Alt"),
    }
    return Told(t_s[is_home], fields, exact=True)


def _modes(flash: DataFlash, vehicle_type: int) -> Told:
    rows, t_s = timed(flash, "MODE")
    numbers = rows.column("ModeNum", "Mode")
    names = [mode_name("ardupilot", vehicle_type, int(number)) for number in np.nan_to_num(numbers, nan=-1)]
    return Told(t_s, {"mode": names}, stamp="heartbeat_t_mono_s", exact=True)


def _armed(flash: DataFlash, texts: list[tuple[float, str]]) -> Told:
    arming, arming_t_s = timed(flash, "ARM")
    events, events_t_s = timed(flash, "EV")
    changes = list(zip(arming_t_s.tolist(), (arming.column("ArmState") == 1).tolist(), strict=True))
    for t, event in zip(events_t_s.tolist(), events.column("Id").tolist(), strict=True):
        if event in (_EVENT_ARMED, _EVENT_DISARMED):
            changes.append((t, event == _EVENT_ARMED))
    changes += [(t, _ARMING[text]) for t, text in texts if text in _ARMING]
    changes.sort(key=lambda change: change[0])
    return Told(np.array([t for t, _ in changes]), {"armed": [armed for _, armed in changes]}, exact=True)


def _landed(flash: DataFlash) -> Told:
    rows, t_s = timed(flash, "EV")
    number = rows.column("Id")
    told = (number == _EVENT_LANDED) | (number == _EVENT_NOT_LANDED)
    words = ["on_ground" if event == _EVENT_LANDED else "in_air" for event in number[told]]
    return Told(t_s[told], {"landed": words}, exact=True)


def _item_flown(flash: DataFlash) -> Told:
    rows, t_s = timed(flash, "MISE")
    return Told(t_s, {"mission_item": rows.wholes("CNum"), "mission_items": rows.wholes("CTot")}, exact=True)


def _missions(flash: DataFlash, facts: FrameFacts) -> None:
    """Whole missions: each begins with its row of home, number 0."""
    rows, t_s = timed(flash, "CMD")
    names = ("CTot", "CNum", "CId", "Prm1", "Prm2", "Prm3", "Prm4", "Lat", "Lng", "Alt", "Frame")
    table = np.nan_to_num(np.column_stack([rows.column(name) for name in names]))
    transfer: ItemSet | None = None
    for t, row in zip(t_s.tolist(), table.tolist(), strict=True):
        count, number, command = (int(value) for value in row[:3])
        if number == 0 or transfer is None or transfer.count != count:
            transfer = ItemSet(by_vehicle=True, count=count, t_utc_s=t)
        if number < count and not transfer.complete:
            params = (row[3], row[4], row[5], row[6])
            item = MissionItem(command, plain_frame(int(row[10])), params, row[7], row[8], row[9], True)
            transfer.items[number] = item
            if transfer.complete:
                facts.missions.finished.append(transfer)


def _truth(flash: DataFlash, facts: FrameFacts) -> None:
    rows, t_s = timed(flash, "SIM")
    known = placed(rows.column("Lat"), rows.column("Lng"))
    columns = (t_s, rows.column("Lat"), rows.column("Lng"), rows.column("Alt"))
    facts.truth += [TruePosition(*row) for row in np.column_stack(columns)[known].tolist()]


def _failures(flash: DataFlash) -> list[VehicleText]:
    rows, t_s = timed(flash, "ERR")
    told = []
    for t, part, code in zip(t_s.tolist(), rows.wholes("Subsys"), rows.wholes("ECode"), strict=True):
        if part is None or code is None:
            continue
        name = _FAILURES.get(part, f"Part {part}")
        words = f"{name}: over" if code == 0 else f"{name}: error {code}"
        told.append(VehicleText(t, _INFO if code == 0 else _ERROR, words))
    return told


def _doubts(flash: DataFlash) -> list[str]:
    dropped = flash.rows("DSF").column("Dp")
    lost = int(dropped[-1]) if len(dropped) and np.isfinite(dropped[-1]) else 0
    said = [f"The vehicle could not write {lost} records: they are missing."] if lost else []
    if not len(flash.rows("POS")) and len(flash.rows("AHR2")):
        said.append("The log holds no POS: positions are those of the second estimator (AHR2).")
    return said
