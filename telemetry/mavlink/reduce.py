"""The pure reducer: how each MAVLink message changes what is known of one vehicle.

The same function serves the live link, replays and logs of other ground stations. What a vehicle does not know
(NaN, the largest integer, -1, a latitude of 95 degrees) becomes None; messages of other systems change nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.modes import mode_name
from telemetry.mavlink.texts.status_texts import said_key
from telemetry.topics.vehicle import Autopilot, FenceBreach, GnssFix, Landed, VehicleState

Changes = dict[str, Any]
Handler = Callable[[VehicleState, Any, float], Changes]

_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
_PRE_ARM = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_FENCE = mavlink.MAV_SYS_STATUS_GEOFENCE
_BREACHES: dict[int, FenceBreach] = {1: "floor", 2: "ceiling", 3: "boundary"}
_AUTOPILOTS: dict[int, Autopilot] = {
    mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot",
    mavlink.MAV_AUTOPILOT_PX4: "px4",
}
_CRITICAL_STATES = frozenset({5, 6, 8})
_NO_VEHICLE_TYPES = frozenset({5, 6, 18, 26, 27, 30, 36})
"""MAV_TYPE of antenna tracker, ground station, onboard computer, gimbal, ADSB, camera and battery."""
_LANDED: dict[int, Landed] = {1: "on_ground", 2: "in_air", 3: "taking_off", 4: "landing"}
GNSS_FIXES: tuple[GnssFix, ...] = ("none", "no_fix", "2d", "3d", "dgps", "rtk_float", "rtk_fixed", "rtk_fixed", "dgps")
_PREARM_WORDS = ("PreArm: ", "Preflight Fail: ")
"""How ArduPilot and PX4 begin what is in the way of arming."""
_TEXT_BYTES = 50
"""Of a STATUSTEXT; longer texts come in parts of so many."""
_ONE_BURST_S = 5.0
"""Reasons that come farther apart are of another look at the vehicle."""
_MOST_REASONS = 5
_CHARGE_S = 10.0
"""BATTERY_STATUS comes at least every two seconds from those that send it."""
_RELEASES = {0: "-dev", 64: "-alpha", 128: "-beta", 192: "-rc", 255: ""}
INT16_MAX, UINT16_MAX, INT32_MAX = 32767, 65535, 2147483647


def is_vehicle_heartbeat(message: Any) -> bool:
    """A heartbeat of an autopilot, not of a ground station, gimbal, camera or radio."""
    return (
        message.get_type() == "HEARTBEAT"
        and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID
        and message.type not in _NO_VEHICLE_TYPES
    )


def autopilot_name(number: int) -> Autopilot:
    """Of a MAV_AUTOPILOT."""
    return _AUTOPILOTS.get(number, "other")


def reduce(state: VehicleState | None, message: Any, *, t_mono_s: float, t_utc_s: float) -> VehicleState | None:
    """What is known after ``message`` (a pymavlink message object); the same object when it changes nothing.

    ``state`` None: the first heartbeat of any autopilot begins one. Clocks as in ``telemetry.topics.vehicle``.
    """
    system, component = message.get_srcSystem(), message.get_srcComponent()
    if state is None:
        if not is_vehicle_heartbeat(message):
            return None
        state = VehicleState(system_id=system, component_id=component)
    elif system != state.system_id or (component != state.component_id and message.get_type() != "RADIO_STATUS"):
        return state
    handler = _HANDLERS.get(message.get_type())
    if handler is None:
        return state
    changes = handler(state, message, t_mono_s)
    return replace(state, t_utc_s=t_utc_s, **changes) if changes else state


def _heartbeat(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    if not is_vehicle_heartbeat(message):
        return {}
    autopilot, armed = autopilot_name(message.autopilot), bool(message.base_mode & _ARMED)
    begins: Changes = {"mission_reached": None} if armed and not state.armed else {}
    return begins | {
        "autopilot": autopilot,
        "vehicle_type": message.type,
        "heartbeat_t_mono_s": t_mono_s,
        "mode": mode_name(autopilot, message.type, message.custom_mode),
        "armed": armed,
        "critical": message.system_status in _CRITICAL_STATES,
    }


def _global_position(_: VehicleState, message: Any, t_mono_s: float) -> Changes:
    lat_deg, lon_deg = lat_lon(message.lat, message.lon)
    north, east, down = (scaled(v, 100, INT16_MAX) for v in (message.vx, message.vy, message.vz))
    return {
        "position_t_mono_s": t_mono_s,
        "lat_deg": lat_deg,
        "lon_deg": lon_deg,
        "alt_amsl_m": scaled(message.alt, 1000, INT32_MAX),
        "alt_rel_home_m": scaled(message.relative_alt, 1000, INT32_MAX),
        "v_north_m_s": north,
        "v_east_m_s": east,
        "v_down_m_s": down,
        "ground_speed_m_s": None if north is None or east is None else math.hypot(north, east),
        "climb_m_s": None if down is None else 0.0 - down,
    }


def _attitude(_: VehicleState, message: Any, t_mono_s: float) -> Changes:
    return {
        "attitude_t_mono_s": t_mono_s,
        "roll_rad": finite(message.roll),
        "pitch_rad": finite(message.pitch),
        "heading_rad": heading(message.yaw),
    }


def _vfr_hud(state: VehicleState, message: Any, _: float) -> Changes:
    if state.v_north_m_s is not None:
        return {}  # GLOBAL_POSITION_INT says the same more often; two sources would make the figures flicker
    return {"ground_speed_m_s": finite(message.groundspeed), "climb_m_s": finite(message.climb)}


def _gps_raw(_: VehicleState, message: Any, t_mono_s: float) -> Changes:
    return {
        "gnss_t_mono_s": t_mono_s,
        "gnss_fix": GNSS_FIXES[message.fix_type] if message.fix_type < len(GNSS_FIXES) else "3d",
        "satellites": None if message.satellites_visible == 255 else message.satellites_visible,
        "hdop": scaled(message.eph, 100, UINT16_MAX),
        "horizontal_accuracy_m": accuracy(message.h_acc),
        "vertical_accuracy_m": accuracy(message.v_acc),
        "gnss_alt_amsl_m": scaled(message.alt, 1000, 0),
        "gnss_alt_ellipsoid_m": scaled(message.alt_ellipsoid, 1000, 0),
    }


def _fence_ok(message: Any) -> bool | None:
    is_on = message.onboard_control_sensors_present & message.onboard_control_sensors_enabled & _FENCE
    return bool(message.onboard_control_sensors_health & _FENCE) if is_on else None


def _fence_status(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    return {"fence_breach": _BREACHES.get(message.breach_type, "boundary") if message.breach_status else "none"}


def _sys_status(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    """PX4 tells whether it is ready by the bit of health alone: it never counts the check as present or enabled."""
    checked = message.onboard_control_sensors_present & message.onboard_control_sensors_enabled & _PRE_ARM
    is_told = checked or state.autopilot == "px4"
    ready = bool(message.onboard_control_sensors_health & _PRE_ARM) if is_told else None
    fence_ok = _fence_ok(message)
    return {
        "ready_to_arm": ready,
        "fence_ok": fence_ok,
        # A fence that is switched off tells no more that it is kept again.
        "fence_breach": None if fence_ok is None and state.fence_ok is not None else state.fence_breach,
        "not_ready_words": () if ready else state.not_ready_words,
        "battery_a": scaled(message.current_battery, 100, -1),
        **_voltage(state, scaled(message.voltage_battery, 1000, UINT16_MAX), t_mono_s),
        **_charge(state, message, t_mono_s),
    }


def _charge(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    """A share that only one of two messages knows is as old as that one's last word, and goes when that is old."""
    left, told_s = share(message.battery_remaining), state.battery_t_mono_s
    if left is None and state.battery_share is not None and told_s is not None and t_mono_s - told_s < _CHARGE_S:
        return {}
    return {"battery_t_mono_s": t_mono_s, "battery_share": left}


def _voltage(state: VehicleState, told_v: float | None, t_mono_s: float) -> Changes:
    """As with the share: what one of two messages knows goes when that one's last word is old."""
    told_s = state.battery_v_t_mono_s
    if told_v is None and told_s is not None and t_mono_s - told_s < _CHARGE_S:
        return {}
    return {"battery_v": told_v, "battery_v_t_mono_s": None if told_v is None else t_mono_s}


def _statustext(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    """Keeps what is in the way of arming; the parts of a long text follow each other."""
    text, words = message.text.strip("\0"), state.not_ready_words
    if message.chunk_seq and message.id:
        if not words or len(words[-1]) != _TEXT_BYTES * message.chunk_seq:
            return {}
        return {"not_ready_words": _with_reason(words[:-1], words[-1] + text)}
    if not text.startswith(_PREARM_WORDS):
        return {}
    if state.not_ready_t_mono_s is None or t_mono_s - state.not_ready_t_mono_s > _ONE_BURST_S:
        words = ()
    return {"not_ready_words": _with_reason(words, text), "not_ready_t_mono_s": t_mono_s}


def _with_reason(words: tuple[str, ...], text: str) -> tuple[str, ...]:
    reason = text if len(text) % _TEXT_BYTES == 0 else text.rstrip()  # a whole part may go on with the next
    return (*(word for word in words if said_key(word) != said_key(reason)), reason)[-_MOST_REASONS:]


def _battery_status(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    if message.id != 0:
        return {}
    cells = [v for v in message.voltages if v != UINT16_MAX] + [v for v in message.voltages_ext if v != 0]
    # SYS_STATUS is about the same battery: what only one of the two knows must not come and go.
    amperes = scaled(message.current_battery, 100, -1)
    return {
        "battery_a": state.battery_a if amperes is None else amperes,
        "battery_used_mah": scaled(message.current_consumed, 1, -1),
        **_voltage(state, sum(cells) / 1000 if cells else None, t_mono_s),
        **_charge(state, message, t_mono_s),
    }


def _home_position(_: VehicleState, message: Any, __: float) -> Changes:
    lat_deg, lon_deg = lat_lon(message.latitude, message.longitude)
    known = lat_deg is not None
    altitude_m = scaled(message.altitude, 1000, INT32_MAX) if known else None
    return {"home_lat_deg": lat_deg, "home_lon_deg": lon_deg, "home_alt_amsl_m": altitude_m}


def _mission_current(state: VehicleState, message: Any, _: float) -> Changes:
    items, number = {0: None, UINT16_MAX: 0}.get(message.total, message.total), mission_id(message)
    is_other = state.mission_item is not None and (items, number) != (state.mission_items, state.mission_id)
    goes_back = state.landed == "in_air" and message.seq < (state.mission_reached or 0)
    # What was reached of another mission, or lies ahead again, says nothing about this one.
    forgets: Changes = {"mission_reached": None} if is_other or goes_back else {}
    return forgets | {"mission_item": message.seq, "mission_items": items, "mission_id": number}


def mission_id(message: Any) -> int | None:
    """Of a MISSION_CURRENT: the dialect in use does not know this extension field, so it is read from the frame."""
    frame = message.get_msgbuf()
    if not frame or frame[0] != mavlink.PROTOCOL_MARKER_V2 or frame[1] <= 6:
        return None
    payload = bytes(frame[10 : 10 + frame[1]])
    return int.from_bytes(payload[6:10], "little") or None


def _mission_item_reached(_: VehicleState, message: Any, __: float) -> Changes:
    return {"mission_reached": message.seq}


def _extended_sys_state(_: VehicleState, message: Any, __: float) -> Changes:
    return {"landed": _LANDED.get(message.landed_state)}


def _ekf_status(_: VehicleState, message: Any, t_mono_s: float) -> Changes:
    bad = mavlink.EKF_CONST_POS_MODE | mavlink.EKF_UNINITIALIZED | mavlink.EKF_GPS_GLITCHING
    ratios = {
        "velocity": message.velocity_variance,
        "place": message.pos_horiz_variance,
        "height": message.pos_vert_variance,
        "compass": message.compass_variance,
        "terrain": message.terrain_alt_variance,
        "airspeed": message.airspeed_variance,
    }
    return {
        "estimator_t_mono_s": t_mono_s,
        "estimator_ok": _estimator_ok(message.flags, bad),
        **_worst_ratio(ratios),
    }


def _estimator_status(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    """A constant position is what PX4 1.16 and newer take for granted of a vehicle that stands on the ground."""
    bad = mavlink.ESTIMATOR_GPS_GLITCH | mavlink.ESTIMATOR_ACCEL_ERROR
    if state.armed and state.landed != "on_ground":
        bad |= mavlink.ESTIMATOR_CONST_POS_MODE
    ratios = {
        "velocity": message.vel_ratio,
        "place": message.pos_horiz_ratio,
        "height": message.pos_vert_ratio,
        "compass": message.mag_ratio,
        "terrain": message.hagl_ratio,
        "airspeed": message.tas_ratio,
    }
    return {
        "estimator_t_mono_s": t_mono_s,
        "estimator_ok": _estimator_ok(message.flags, bad),
        **_worst_ratio(ratios),
    }


def _worst_ratio(ratios: dict[str, float]) -> Changes:
    known = {part: value for part, ratio in ratios.items() if (value := finite(ratio)) is not None}
    part = max(known, key=lambda each: known[each], default=None)
    return {"estimator_ratio": None if part is None else known[part], "estimator_ratio_of": part}


def _vibration(state: VehicleState, message: Any, t_mono_s: float) -> Changes:
    """PX4 gives its accelerometers' figure in the third field alone: the other two are of its gyroscopes."""
    axes = (message.vibration_x, message.vibration_y, message.vibration_z)
    known = [value for axis in (axes[2:] if state.autopilot == "px4" else axes) if (value := finite(axis)) is not None]
    return {
        "vibration_t_mono_s": t_mono_s,
        "vibration_m_s2": max(known, default=None),
        "clipped": message.clipping_0 + message.clipping_1 + message.clipping_2,
    }


def _estimator_ok(flags: int, bad: int) -> bool:
    needed = mavlink.EKF_ATTITUDE | mavlink.EKF_VELOCITY_HORIZ | mavlink.EKF_POS_HORIZ_ABS
    return flags & needed == needed and not flags & bad


def _wind(_: VehicleState, message: Any, t_mono_s: float) -> Changes:
    """Exactly none is what ArduPilot sends whose estimator has found no wind yet."""
    from_deg = finite(message.direction) if message.speed else None
    return {
        "wind_t_mono_s": t_mono_s,
        "wind_speed_m_s": finite(message.speed) or None,
        "wind_from_rad": None if from_deg is None else heading(math.radians(from_deg)),
    }


def _wind_cov(_: VehicleState, message: Any, t_mono_s: float) -> Changes:
    north, east = finite(message.wind_x), finite(message.wind_y)
    told: Changes = {"wind_t_mono_s": t_mono_s, "wind_speed_m_s": None, "wind_from_rad": None}
    if north is not None and east is not None:
        told |= {"wind_speed_m_s": math.hypot(north, east), "wind_from_rad": heading(math.atan2(-east, -north))}
    return told


def _rssi(_: VehicleState, message: Any, __: float) -> Changes:
    return {"rc_rssi": None if message.rssi == 255 else message.rssi / 254}


def _autopilot_version(_: VehicleState, message: Any, __: float) -> Changes:
    return {"firmware_version": firmware_version(message.flight_sw_version)}


def firmware_version(number: int) -> str | None:
    """Of a number that holds major, minor, patch and kind of release in a byte each; None for 0."""
    major, minor, patch, release = number >> 24 & 255, number >> 16 & 255, number >> 8 & 255, number & 255
    return f"{major}.{minor}.{patch}{_RELEASES.get(release, '')}" if number else None


_HANDLERS: dict[str, Handler] = {
    "HEARTBEAT": _heartbeat,
    "GLOBAL_POSITION_INT": _global_position,
    "ATTITUDE": _attitude,
    "VFR_HUD": _vfr_hud,
    "GPS_RAW_INT": _gps_raw,
    "SYS_STATUS": _sys_status,
    "FENCE_STATUS": _fence_status,
    "STATUSTEXT": _statustext,
    "BATTERY_STATUS": _battery_status,
    "HOME_POSITION": _home_position,
    "MISSION_CURRENT": _mission_current,
    "MISSION_ITEM_REACHED": _mission_item_reached,
    "EXTENDED_SYS_STATE": _extended_sys_state,
    "EKF_STATUS_REPORT": _ekf_status,
    "ESTIMATOR_STATUS": _estimator_status,
    "VIBRATION": _vibration,
    "WIND": _wind,
    "WIND_COV": _wind_cov,
    "RC_CHANNELS": _rssi,
    "RADIO_STATUS": _rssi,
    "AUTOPILOT_VERSION": _autopilot_version,
}


def finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def heading(yaw_rad: float) -> float | None:
    """0 to 2 pi; rounding must not let a tiny negative angle become 2 pi itself."""
    if not math.isfinite(yaw_rad):
        return None
    wrapped = yaw_rad % math.tau
    return wrapped if wrapped < math.tau else 0.0


def scaled(value: int, divisor: int, unknown: int) -> float | None:
    return None if value == unknown else value / divisor


def accuracy(millimetres: int) -> float | None:
    """0 is what a message without the extension fields decodes to, 2**32 - 1 what some receivers write for unknown."""
    return millimetres / 1000 if 0 < millimetres < 4_000_000_000 else None


def share(percent: int) -> float | None:
    return percent / 100 if 0 <= percent <= 100 else None


def lat_lon(lat_e7: int, lon_e7: int) -> tuple[float | None, float | None]:
    """Both or none. Exactly 0, 0 is what ArduPilot sends before it has a position."""
    if (lat_e7 == 0 and lon_e7 == 0) or abs(lat_e7) > 900_000_000 or abs(lon_e7) > 1_800_000_000:
        return None, None
    return lat_e7 / 1e7, lon_e7 / 1e7
