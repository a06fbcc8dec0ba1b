"""A ULog of PX4 -> what was known of the vehicle."""

from __future__ import annotations

from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.mavlink.reduce import GNSS_FIXES, firmware_version
from telemetry.recording.frame_facts import FrameFacts, TruePosition
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
from telemetry.recording.vehicle_logs.rows import Rows
from telemetry.recording.vehicle_logs.ulog import ULog, read_ulog
from telemetry.topics.messages import VehicleText
from telemetry.topics.vehicle import VehicleState

_TRUTH, _POSITION, _LOCAL = "vehicle_global_position_groundtruth", "vehicle_global_position", "vehicle_local_position"
_WANTED = frozenset(
    [
        *(_TRUTH, _POSITION, _LOCAL, "vehicle_attitude", "vehicle_status", "vehicle_gps_position", "sensor_gps"),
        *("home_position", "battery_status", "mission_result", "vehicle_land_detected", "wind", "wind_estimate"),
    ]
)
_MODES = {
    0: "MANUAL",
    1: "ALTCTL",
    2: "POSCTL",
    3: "MISSION",
    4: "HOLD",
    5: "RTL",
    10: "ACRO",
    12: "DESCEND",
    13: "TERMINATION",
    14: "OFFBOARD",
    15: "STABILIZED",
    17: "TAKEOFF",
    18: "LAND",
    19: "FOLLOW",
    20: "PRECLAND",
    21: "ORBIT",
}
"""vehicle_status.nav_state, as the same modes are called over MAVLink."""
_ARMED = 2
_SPHERE_M = 6_371_000.0
"""CONSTANTS_RADIUS_OF_EARTH of PX4."""


def read_ulog_flight(data: Data) -> OwnLog:
    ulog = read_ulog(data, _WANTED)
    gps, gps_t_s = _receiver(ulog)
    status, status_t_s = timed(ulog, "vehicle_status")
    vehicle = _vehicle(ulog, status)
    log = OwnLog(vehicle, utc_minus_boot_s(ulog))
    log.facts = FrameFacts(vehicle.system_id, vehicle.component_id)
    log.texts = [VehicleText(t_us / 1e6, severity, text) for t_us, severity, text in ulog.texts]
    log.faults = [*ulog.damage.words(len(data)), *_doubts(ulog)]
    home, home_t_s = _home(ulog)
    log.told = [
        _position(ulog, home, home_t_s),
        _velocity(ulog),
        _attitude(ulog),
        _battery(ulog),
        _gnss(gps, gps_t_s),
        _wind(ulog),
        Told(home_t_s, _home_fields(home), exact=True),
        _status(status, status_t_s),
        _landed(ulog),
        _mission(ulog),
    ]
    _truth(ulog, log.facts)
    return log


def timed(ulog: ULog, name: str, instance: int = 0) -> tuple[Rows, F64]:
    """The records of a topic, and when each was written, in seconds since the vehicle's start."""
    rows = ulog.rows(name, instance)
    return ordered(rows, rows.column("timestamp") / 1e6)


def _vehicle(ulog: ULog, status: Rows) -> VehicleState:
    def told(name: str, largest: int, otherwise: int) -> int:
        number = status.column(name)[-1] if status.has(name) and len(status) else otherwise
        return int(number) if 0 < number <= largest else otherwise

    return VehicleState(
        system_id=told("system_id", 255, 1),
        component_id=told("component_id", 255, 1),
        autopilot="px4",
        vehicle_type=told("system_type", 255, 2),
        firmware_version=version_of(ulog),
    )


def _receiver(ulog: ULog) -> tuple[Rows, F64]:
    return timed(ulog, "vehicle_gps_position" if len(ulog.rows("vehicle_gps_position")) else "sensor_gps")


def utc_minus_boot_s(ulog: ULog) -> float | None:
    """By the receiver, else by the vehicle's own clock; None when neither tells."""
    gps, gps_t_s = _receiver(ulog)
    utc_s = unless(gps.column("time_utc_usec") / 1e6, ~(gps.column("fix_type") >= 3))
    told = middle_utc_s(utc_s, gps_t_s)
    booted = ulog.told.get("boot_time_utc_us", 0)
    if told is None and isinstance(booted, int):
        told = middle_utc_s(np.array([booted / 1e6]), np.zeros(1))
    return told


def version_of(ulog: ULog) -> str | None:
    release = ulog.told.get("ver_sw_release", 0)
    return firmware_version(release) if isinstance(release, int) else None


def _doubts(ulog: ULog) -> list[str]:
    doubts = []
    if ulog.newer:
        doubts.append("The log is written in a newer way that is not understood.")
    if ulog.dropouts_s:
        doubts.append(f"The vehicle could not write for {ulog.dropouts_s:.2f} s in all: what came then is missing.")
    return doubts


def _home(ulog: ULog) -> tuple[Rows, F64]:
    rows, t_s = timed(ulog, "home_position")
    valid = placed(rows.column("lat"), rows.column("lon"))
    if rows.has("valid_hpos"):
        valid &= rows.column("valid_hpos") == 1
    return rows.where(valid), t_s[valid]


def _home_fields(home: Rows) -> dict[str, Any]:
    return {
        "home_lat_deg": home.column("lat"),
        "home_lon_deg": home.column("lon"),
        "home_alt_amsl_m": _home_alt_amsl_m(home),
    }


def _home_alt_amsl_m(home: Rows) -> F64:
    return unless(home.column("alt"), home.column("valid_alt") == 0)


def _position(ulog: ULog, home: Rows, home_t_s: F64) -> Told:
    """Heights above home count from home as it was then: PX4 corrects it in flight."""
    t_s, lat_deg, lon_deg, alt_m = _global_places(ulog) if len(ulog.rows(_POSITION)) else _local_places(ulog)
    at = np.searchsorted(home_t_s, t_s, side="right") - 1
    home_alt_m = _home_alt_amsl_m(home)
    below_m = unless(home_alt_m[np.maximum(at, 0)], at < 0) if len(home) else np.full(len(t_s), np.nan)
    fields: dict[str, Any] = {
        "lat_deg": lat_deg,
        "lon_deg": lon_deg,
        "alt_amsl_m": alt_m,
        "alt_rel_home_m": alt_m - below_m,
    }
    return Told(t_s, fields, stamp="position_t_mono_s", exact=True)


def _global_places(ulog: ULog) -> tuple[F64, F64, F64, F64]:
    """Time, latitude, longitude and height above sea level, (N,) each."""
    rows, t_s = timed(ulog, _POSITION)
    known = placed(rows.column("lat"), rows.column("lon"))
    for flag in ("lat_lon_valid", "alt_valid"):
        known &= ~(rows.column(flag) == 0)
    rows = rows.where(known)
    return t_s[known], rows.column("lat"), rows.column("lon"), rows.column("alt")


def _local_places(ulog: ULog) -> tuple[F64, F64, F64, F64]:
    """As ``_global_places``, by the reference that PX4 puts its local metres around, on its sphere.

    Inverse of the azimuthal equidistant projection: Snyder 1987, eqs 20-14 and 20-15.
    """
    rows, t_s = timed(ulog, _LOCAL)
    known = placed(rows.column("ref_lat"), rows.column("ref_lon"))
    for flag in ("xy_valid", "z_valid", "xy_global", "z_global"):
        known &= rows.column(flag) == 1
    rows = rows.where(known)
    north, east = rows.column("x") / _SPHERE_M, rows.column("y") / _SPHERE_M
    ref_lat, ref_lon = np.radians(rows.column("ref_lat")), np.radians(rows.column("ref_lon"))
    c = np.hypot(north, east)
    share = np.sinc(c / np.pi)  # sin(c) / c
    sin_lat = np.cos(c) * np.sin(ref_lat) + north * share * np.cos(ref_lat)  # Snyder 1987, 20-14
    across = np.cos(ref_lat) * np.cos(c) - north * share * np.sin(ref_lat)
    lon = ref_lon + np.arctan2(east * share, across)  # Snyder 1987, 20-15
    lat_deg = np.degrees(np.arcsin(np.clip(sin_lat, -1.0, 1.0)))
    return t_s[known], lat_deg, np.degrees(lon), rows.column("ref_alt") - rows.column("z")


def _velocity(ulog: ULog) -> Told:
    rows, t_s = timed(ulog, _LOCAL)
    level = ~(rows.column("v_xy_valid") == 0)
    north, east = (unless(rows.column(name), ~level) for name in ("vx", "vy"))
    down = unless(rows.column("vz"), rows.column("v_z_valid") == 0)
    return moving(t_s, north, east, down)


def _attitude(ulog: ULog) -> Told:
    """From the Hamilton quaternion w, x, y, z that turns the body (forward, right, down) into north, east, down."""
    rows, t_s = timed(ulog, "vehicle_attitude")
    w, x, y, z = rows.columns("q", 4).T
    fields: dict[str, Any] = {
        "roll_rad": np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        "pitch_rad": np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
        "heading_rad": np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) % (2 * np.pi),
    }
    return Told(t_s, fields, stamp="attitude_t_mono_s")


def _battery(ulog: ULog) -> Told:
    rows, t_s = timed(ulog, "battery_status")
    share = rows.column("remaining")
    fields: dict[str, Any] = {
        "battery_v": rows.column("voltage_v"),
        "battery_a": _from_zero(rows.column("current_a")),
        "battery_share": unless(share, (share < 0) | (share > 1)),
        "battery_used_mah": _from_zero(rows.column("discharged_mah")),
    }
    return Told(t_s, fields, stamp="battery_t_mono_s")


def _from_zero(values: F64) -> F64:
    """Below zero means that it is not measured."""
    return unless(values, values < 0)


def _gnss(gps: Rows, t_s: F64) -> Told:
    metres_per_count = 1.0 if gps.has("altitude_msl_m") else 1e-3
    fields: dict[str, Any] = {
        "gnss_fix": [GNSS_FIXES[int(fix)] if 0 <= fix < len(GNSS_FIXES) else "3d" for fix in gps.column("fix_type")],
        "satellites": gps.wholes("satellites_used"),
        "hdop": unless(gps.column("hdop"), gps.column("hdop") == 0),
        "horizontal_accuracy_m": gps.column("eph"),
        "vertical_accuracy_m": gps.column("epv"),
        "gnss_alt_amsl_m": gps.column("altitude_msl_m", "alt") * metres_per_count,
        "gnss_alt_ellipsoid_m": gps.column("altitude_ellipsoid_m", "alt_ellipsoid") * metres_per_count,
    }
    return Told(t_s, fields, stamp="gnss_t_mono_s")


def _wind(ulog: ULog) -> Told:
    rows, t_s = timed(ulog, "wind" if len(ulog.rows("wind")) else "wind_estimate")
    return blowing(t_s, rows.column("windspeed_north"), rows.column("windspeed_east"))


def _status(rows: Rows, t_s: F64) -> Told:
    states = [int(state) for state in np.nan_to_num(rows.column("nav_state"), nan=-1)]
    fields: dict[str, Any] = {
        "mode": [_MODES.get(state, f"MODE {state}") for state in states],
        "armed": [bool(state == _ARMED) for state in rows.column("arming_state")],
        "critical": [bool(state == 1) for state in rows.column("failsafe")],
    }
    return Told(t_s, fields, stamp="heartbeat_t_mono_s", exact=True)


def _landed(ulog: ULog) -> Told:
    rows, t_s = timed(ulog, "vehicle_land_detected")
    words = ["on_ground" if landed == 1 else "in_air" for landed in rows.column("landed")]
    return Told(t_s, {"landed": words}, exact=True)


def _mission(ulog: ULog) -> Told:
    """Which item it flew to; the items themselves are not in the log."""
    rows, t_s = timed(ulog, "mission_result")
    fields: dict[str, Any] = {
        "mission_item": rows.wholes("seq_current"),
        "mission_items": rows.wholes("seq_total"),
        "mission_reached": rows.wholes("seq_reached"),
    }
    return Told(t_s, fields, exact=True)


def _truth(ulog: ULog, facts: FrameFacts) -> None:
    rows, t_s = timed(ulog, _TRUTH)
    known = placed(rows.column("lat"), rows.column("lon"))
    columns = np.column_stack((t_s, rows.column("lat"), rows.column("lon"), rows.column("alt")))
    facts.truth += [TruePosition(*row) for row in columns[known].tolist()]
