"""The row of the check that says what avoidance sees: with which sensors, since when, how far, and for what speed."""

from __future__ import annotations

import time

from mapping.perceiving.braking import Braking
from telemetry.flight.avoidance.regions import OLD_S, SENSOR_WORDS, largest_speed
from telemetry.flight.preflight.checks import Row
from telemetry.flight.preflight.parameters import Speeds
from telemetry.topics.obstacles import AvoidanceStatus, Eye

BLIND = "Avoidance is on, but no sensor sees ahead: nothing would brake."
SLOWER = 0.05
"""A difference that no vehicle keeps."""


def avoidance_row(status: AvoidanceStatus, speeds: Speeds, braking: Braking, *, utc_minus_mono_s: float) -> Row:
    """Good while it is off, for then nobody counts on it; to be accepted where it would not do what it is on for."""
    if not status.enabled:
        return Row("avoidance", "good", "Avoidance is off: nothing brakes by itself.")
    if not status.eyes:
        return Row("avoidance", "accept", BLIND, "Switch a sensor on, or tick that it is flown without.")
    largest_m_s = min(eye.largest_speed_m_s for eye in status.eyes)
    text = " ".join(_eye_words(eye, utc_minus_mono_s) for eye in status.eyes)
    if late := [SENSOR_WORDS[eye.sensor] for eye in status.eyes if eye.is_late]:
        text += f" Frames from {' and '.join(late)} come over {OLD_S:g} s late: it brakes later, and then holds."
        return Row("avoidance", "accept", text, "End what else runs on this computer, or mend the way to the sensor.")
    jerk = speeds.brake_jerk_m_s3
    if jerk is not None and jerk < braking.jerk_m_s3 - SLOWER:
        text += f" The vehicle brakes with a jerk of {jerk:g} m/s\u00b3, {braking.jerk_m_s3:g} are counted on."
        return Row(
            "avoidance", "accept", text, f"Set {braking.jerk_m_s3:g} on the vehicle, or {jerk:g} in its profile."
        )
    if speeds.home_m_s is not None and speeds.home_m_s > largest_m_s + SLOWER:
        text += f" The way home is flown at {speeds.home_m_s:.1f} m/s and is slowed only while the link stands."
    mend = _mend(speeds, largest_m_s)
    if speeds.mission_m_s is not None and speeds.mission_m_s > largest_m_s + SLOWER:
        slowed = f" The mission flies at {speeds.mission_m_s:.1f} m/s: it will be slowed."
        deeper = "Plan it slower, or let the sensors look farther ahead."
        return Row("avoidance", "accept", text + slowed, f"{deeper} {mend}".strip())
    return Row("avoidance", "good", text, mend)


def _mend(speeds: Speeds, largest_m_s: float) -> str:
    too_fast = speeds.home_m_s is not None and speeds.home_m_s > largest_m_s + SLOWER
    if not (too_fast and speeds.home_parameter):
        return ""
    return f"Set {speeds.home_value(largest_speed(largest_m_s))} on the vehicle."


def _eye_words(eye: Eye, utc_minus_mono_s: float) -> str:
    who = SENSOR_WORDS[eye.sensor].capitalize()
    since = time.strftime("%H:%M:%S", time.gmtime(eye.since_t_mono_s + utc_minus_mono_s))
    return f"{who}: {eye.depth_m:g} m ahead since {since} UTC, enough for {eye.largest_speed_m_s:.1f} m/s."
