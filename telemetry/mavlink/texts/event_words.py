"""PX4's events in words. An event's number is the hash of its name, so a table of names and words is enough.

The words are those that PX4 says by STATUSTEXT where it says both, so that nothing is told twice.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from telemetry.mavlink.texts.event_reader import VehicleEvent

AUTOPILOT = 1 << 24
"""The component in an event's number."""
_FNV_BASIS, _FNV_PRIME = 0x811C9DC5, 0x01000193
_CHECK = struct.Struct("<IB")
"""What every event of a report begins with: the modes that it keeps from, and what it is about."""
Names = dict[int, str]

REASONS: Names = {
    1: "RC", 2: "RC (switch)", 3: "internal command", 4: "external command", 5: "mission start", 6: "landing",
    7: "auto preflight disarming", 8: "kill-switch", 9: "lockdown", 10: "failure detector", 11: "shutdown request",
    12: "unit tests", 13: "RC (button)", 14: "failsafe",
}  # fmt: skip
MODES: Names = {
    0: "Manual", 1: "Altitude", 2: "Position", 3: "Mission", 4: "Hold", 5: "Return", 6: "Acro", 7: "Offboard",
    8: "Stabilized", 10: "Takeoff", 11: "Land", 12: "Follow Target", 13: "Precision Landing", 14: "Orbit",
}  # fmt: skip
ACTIONS: Names = {
    1: "a warning", 2: "Position", 3: "Altitude", 4: "Stabilized", 5: "Hold", 6: "Return", 7: "Land", 8: "Descend",
    9: "disarming", 10: "flight termination",
}  # fmt: skip
CAUSES: Names = {
    1: "manual control loss", 2: "GCS connection loss", 3: "low battery level", 4: "critical battery level",
    5: "emergency battery level", 6: "low remaining flight time",
}  # fmt: skip
COMPONENTS = (
    "none", "absolute pressure", "differential pressure", "GPS", "optical flow", "vision position", "distance sensor",
    "remote control", "motors", "UTM", "logging", "battery", "communication links", "rate controller",
    "attitude controller", "position controller", "attitude estimate", "local position estimate", "mission",
    "avoidance", "system", "camera", "gimbal", "payload", "global position estimate", "storage", "parachute",
    "magnetometer", "accelerometer", "gyroscope", "Open Drone ID",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Words:
    text: str
    """With a place for each argument."""
    layout: str = ""
    """Of the arguments, as ``struct`` has it."""
    names: tuple[Names | None, ...] = ()
    """Of numbers that stand for something, by argument."""


def event_id(name: str) -> int:
    """FNV-1a over the name, of which the lower 24 bits count."""
    value = _FNV_BASIS
    for byte in name.encode():
        value = (value ^ byte) * _FNV_PRIME & 0xFFFFFFFF
    return AUTOPILOT | value & 0xFFFFFF


ARMING_SUMMARY, HEALTH_SUMMARY = event_id("commander_arming_check_summary"), event_id("commander_health_summary")
"""The first and the last event of a report of what keeps from arming."""

CHECKS = {
    "check_modes_cannot_takeoff": Words("Mode not suitable for arming"),
    "check_modes_angular_velocity": Words("Angular velocity not valid"),
    "check_modes_attitude": Words("No valid attitude estimate"),
    "check_modes_local_pos": Words("Navigation error: No valid position estimate"),
    "check_modes_global_pos": Words("Navigation error: No valid global position estimate"),
    "check_modes_local_alt": Words("Navigation error: No valid altitude estimate"),
    "check_modes_mission": Words("No valid mission available"),
    "check_modes_home_position": Words("Home position not set"),
    "check_modes_manual_control": Words("No manual control input"),
    "check_modes_not_supported": Words("Mode not supported"),
    "check_system_flight_term_active": Words("Flight termination active"),
    "check_system_usb_connected": Words("Flying with USB is not safe"),
    "check_system_no_global_pos": Words("Global position required"),
    "check_system_no_home_pos": Words("Home position required"),
    "check_system_safety_button": Words("Press safety button first"),
    "check_system_avoidance_not_ready": Words("Avoidance system not ready"),
    "check_system_arm_auth_failed": Words("Arm authorization denied"),
    "check_estimator_missing_data": Words("Waiting for estimator to initialize"),
    "check_estimator_heading_not_stable": Words("heading estimate invalid"),
    "check_estimator_hor_vel_not_stable": Words("horizontal velocity unstable"),
    "check_estimator_vert_vel_not_stable": Words("vertical velocity unstable"),
    "check_estimator_hor_pos_not_stable": Words("horizontal position unstable"),
    "check_estimator_hgt_not_stable": Words("height estimate not stable"),
    "check_estimator_mag_interference": Words(
        "Strong magnetic interference (measured {:.3f} G, expected {:.3f} G; inclination {:.1f}, expected {:.1f} deg)",
        "ffff",
    ),
    "check_estimator_gnss_fusion_stopped": Words("GNSS data fusion stopped"),
    "check_estimator_gnss_fusion_started": Words("GNSS data fusion started"),
    "check_estimator_gnss_warning_spoofing": Words("GNSS signal spoofed"),
    "check_estimator_gnss_warning_jamming": Words("GNSS signal jammed"),
    "check_estimator_gps_fix_too_low": Words("GPS fix too low"),
    "check_estimator_gps_num_sats_too_low": Words("not enough GPS Satellites"),
    "check_estimator_gps_pdop_too_high": Words("GPS PDOP too high"),
    "check_estimator_gps_hor_pos_err_too_high": Words("GPS Horizontal Pos Error too high"),
    "check_estimator_gps_vert_pos_err_too_high": Words("GPS Vertical Pos Error too high"),
    "check_mag_missing": Words("Compass Sensor {} missing", "B"),
    "check_mag_no_data": Words("No valid data from Compass {}", "B"),
    "check_mag_not_calibrated": Words("Compass {} uncalibrated", "B"),
    "check_mag_fault": Words("Compass {} fault", "B"),
    "check_mag_sys_has_mag_missing": Words("Found {} compass (required: {})", "BB"),
    "check_mag_consistency": Words("Compasses {}° inconsistent", "h"),
    "check_battery_missing": Words("Battery {} missing", "B"),
    "check_battery_disconnected": Words("Battery {} disconnected", "B"),
    "check_battery_low": Words("Low battery"),
    "check_battery_critical": Words("Critical battery"),
    "check_battery_emergency": Words("Emergency battery level"),
    "check_battery_rem_flight_time_low": Words("Remaining flight time low"),
    "check_battery_unhealthy": Words("Battery unhealthy"),
}
"""Of reports."""

NEWS = {
    "commander_armed_by": Words("Armed by {}", "B", (REASONS,)),
    "commander_disarmed_by": Words("Disarmed by {}", "B", (REASONS,)),
    "commander_arm_denied_calibrating": Words("Arming denied: calibrating"),
    "commander_arm_denied_throttle_center": Words("Arming denied: throttle above center"),
    "commander_arm_denied_throttle_high": Words("Arming denied: high throttle"),
    "commander_arm_denied_not_manual": Words("Arming denied: switch to manual mode first"),
    "commander_disarm_denied_not_landed": Words("Disarming denied: not landed"),
    "commander_modeswitch_not_avail": Words("Switching to {1} is currently not available", "IB", (None, MODES)),
    "commander_unsupported_auto_mode": Words("Unsupported auto mode"),
    "commander_takeoff_detected": Words("Takeoff detected"),
    "commander_landing_detected": Words("Landing detected"),
    "commander_failsafe_enter_generic_hold": Words(
        "Failsafe activated, triggering {1} in {2} seconds", "IBH", (None, ACTIONS, None)
    ),
    "commander_failsafe_enter_hold": Words(
        "Failsafe activated due to {3}, triggering {1} in {2} seconds", "IBHB", (None, ACTIONS, None, CAUSES)
    ),
    "commander_failsafe_enter_generic_warn": Words("Failsafe warning triggered"),
    "commander_failsafe_enter_generic": Words("Failsafe activated, triggering {1}", "IB", (None, ACTIONS)),
    "commander_failsafe_enter_low_bat": Words("Low battery level, return advised"),
    "commander_failsafe_enter_crit_bat_warn": Words("Critical battery level, land now"),
    "commander_failsafe_enter_crit_low_bat_warn": Words("Emergency battery level, land immediately"),
    "commander_failsafe_enter_low_flight_time_warn": Words("Low remaining flight time, return advised"),
    "commander_failsafe_enter_warn": Words("Failsafe warning triggered due to {1}", "IB", (None, CAUSES)),
    "commander_failsafe_enter": Words("Failsafe activated due to {2}, triggering {1}", "IBB", (None, ACTIONS, CAUSES)),
    "navigator_mis_no_pos_lock": Words("Not yet ready for mission, no position lock."),
    "navigator_mis_no_home_rel_alt": Words("Mission rejected: No home pos, WP {} uses rel alt", "h"),
    "navigator_mis_unsup_cmd": Words("Mission rejected: item {}: unsupported cmd: {}", "HH"),
    "navigator_mis_starts_w_landing": Words("Mission rejected: starts with landing"),
    "navigator_mis_takeoff_too_low": Words("Mission rejected: takeoff altitude too low! Minimum: {:.1f} m", "f"),
    "navigator_mis_takeoff_not_first": Words("Mission rejected: takeoff not first waypoint item"),
    "navigator_mis_takeoff_missing": Words("Mission rejected: Takeoff waypoint required."),
    "navigator_mis_land_missing": Words("Mission rejected: Landing waypoint/pattern required."),
    "navigator_mis_takeoff_or_land_missing": Words("Mission rejected: Takeoff or Landing item missing."),
    "navigator_mis_add_land_or_rm_to": Words("Mission rejected: Add Landing item or remove Takeoff."),
    "navigator_mis_add_to_or_rm_land": Words("Mission rejected: Add Takeoff item or remove Landing."),
    "navigator_mis_first_wp_too_far": Words("First waypoint too far away: {}m, {} max", "II"),
    "navigator_mis_wp_dist_too_far": Words("Distance between waypoints too far: {} meters, {} max.", "II"),
    "navigator_mis_wp_below_home": Words("Warning: Waypoint {} below home", "h"),
    "navigator_mis_geofence_path_violation": Words("Geofence breach on path to waypoint {}", "h"),
}
_BY_ID = {event_id(name): (words, name in CHECKS) for name, words in (CHECKS | NEWS).items()}


def words_of(event: VehicleEvent) -> str | None:
    """None: no words are known."""
    words, is_check = _BY_ID.get(event.id, (None, False))
    if words is None:
        return None
    values = struct.unpack_from(f"<{words.layout}", event.arguments, _CHECK.size if is_check else 0)
    names = words.names or (None,) * len(values)
    return words.text.format(*(each.get(v, v) if each else v for v, each in zip(values, names, strict=True)))


def is_news(event: VehicleEvent) -> bool:
    """Of no report, though it may come in the middle of one."""
    return event.id in _BY_ID and not _BY_ID[event.id][1]


def unknown_words(event: VehicleEvent) -> str:
    """Of an event of which no words are known."""
    arguments = event.arguments.rstrip(b"\0").hex(" ")
    return f"Event {event.id} of the vehicle (no words known)" + (f", arguments {arguments}" if arguments else "")


def kept_from(event: VehicleEvent) -> tuple[int, str]:
    """Of an event of a report: the modes that it keeps from, a bit for each, and what it is about."""
    modes, about = _CHECK.unpack_from(event.arguments)
    return modes, COMPONENTS[about] if about < len(COMPONENTS) else f"part {about}"
