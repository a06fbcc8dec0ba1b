"""The vehicle's health in words while it is connected: what it says of itself, each value beside its limit.

Limits: the ratios of the estimator are where ArduCopter's own failsafe acts (FS_EKF_THRESH) and where PX4 refuses a
measurement; vibration as ArduPilot's and PX4's guides judge it. Battery and wind are held against the way home.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple

from mapping.geometry.frames import offset_m
from planning.basics.plan_model import ANY_VEHICLE, VehicleProfile
from planning.flight_time.return_speeds import ReturnSpeeds, worse_pace
from telemetry.topics.vehicle import Autopilot, GnssFix, VehicleState

Code = Literal["ready", "estimator", "gnss", "vibration", "battery", "wind"]
Level = Literal["good", "near", "bad", "unknown"]

UNHEARD_S = 10.0
"""A value that old says nothing of the vehicle as it is; each of them comes at least every other second."""
ESTIMATOR_NEAR = 0.5
ESTIMATOR_BAD: dict[Autopilot, float] = {"ardupilot": 0.8, "px4": 1.0, "other": 0.8}
VIBRATION_M_S2: dict[Autopilot, tuple[float, float]] = {
    "ardupilot": (30.0, 60.0),
    "px4": (4.905, 9.81),
    "other": (30.0, 60.0),
}
"""(near, bad)"""
CLIPPED_WITHIN_S = 30.0
FIXES: dict[GnssFix, str] = {
    "none": "No receiver",
    "no_fix": "No fix",
    "2d": "2D fix",
    "3d": "3D fix",
    "dgps": "DGPS",
    "rtk_float": "RTK float",
    "rtk_fixed": "RTK fixed",
}
WIND_NEAR, WIND_BAD = 0.5, 0.8
"""Of the vehicle's largest speed: what is left of it must bring it home."""
MEASURED_S, MEASURED_SHARE = 60.0, 0.03
"""A battery's use is measured once it went down by so much in so long: it is told in whole percents."""
SLOWEST_HOME_M_S = 0.5
NEAR_HOME_S = 60.0
NOT_READ = ReturnSpeeds()
ROUNDED_S = 0.01
"""So little more or less makes no other second of what is rounded to its worse end."""


@dataclass(frozen=True, slots=True)
class HealthRow:
    """``value`` in few words, ``limit`` beside it; ``text`` a sentence where there is something to do or to know."""

    code: Code
    level: Level
    value: str
    limit: str = ""
    text: str = ""


class _Used(NamedTuple):
    t_utc_s: float
    share: float


class Health:
    """Of one vehicle; remembers what only time tells: how fast the battery goes down, when samples were clipped."""

    def __init__(self) -> None:
        self._from: _Used | None = None
        self._clipped: deque[tuple[float, int]] = deque()

    def on_state(self, state: VehicleState) -> None:
        if not state.armed or state.battery_share is None:
            self._from = None
        elif self._from is None or state.battery_share > self._from.share:
            self._from = _Used(state.t_utc_s, state.battery_share)
        if state.clipped is not None and (not self._clipped or self._clipped[-1][1] != state.clipped):
            self._clipped.append((state.t_utc_s, state.clipped))
        while len(self._clipped) > 1 and self._clipped[1][0] < state.t_utc_s - CLIPPED_WITHIN_S:
            self._clipped.popleft()

    def rows(
        self,
        state: VehicleState,
        profile: VehicleProfile | None = None,
        *,
        now_mono_s: float | None = None,
        returns: ReturnSpeeds = NOT_READ,
    ) -> tuple[HealthRow, ...]:
        """In the order in which a pilot looks. ``profile``: the vehicle that the plan aboard was made for, None: not
        known. ``now_mono_s``: the state's clock; None for recordings, whose newest word stands for it. ``returns``: as
        it was last read how the vehicle returns."""
        who = profile or ANY_VEHICLE
        heard = _Heard(_newest_mono_s(state) if now_mono_s is None else now_mono_s)
        old_wind = heard.if_told("wind", state.wind_t_mono_s)
        if old_wind is not None:
            state = replace(state, wind_speed_m_s=None, wind_from_rad=None)
        return (
            heard.if_told("ready", state.heartbeat_t_mono_s) or _ready(state),
            heard.row("estimator", state.estimator_t_mono_s) or _estimator(state),
            heard.row("gnss", state.gnss_t_mono_s) or _gnss(state, who),
            heard.row("vibration", state.vibration_t_mono_s) or self._vibration(state),
            heard.row("battery", state.battery_t_mono_s)
            or self._battery(state, who, returns, is_known=profile is not None),
            old_wind or _wind(state, who),
        )

    def _vibration(self, state: VehicleState) -> HealthRow:
        measured_m_s2 = state.vibration_m_s2
        near_m_s2, bad_m_s2 = VIBRATION_M_S2[state.autopilot]
        if measured_m_s2 is None:
            return HealthRow("vibration", "unknown", "Not told")
        clipped = max(0, self._clipped[-1][1] - self._clipped[0][1]) if self._clipped else 0
        value, limit = f"{measured_m_s2:.1f} m/s²", f"under {near_m_s2:.0f} m/s²"
        if clipped:
            text = f"{clipped} samples were clipped within {CLIPPED_WITHIN_S:.0f} s: the heights may go wrong. Land."
            return HealthRow("vibration", "bad", value, limit, text)
        if measured_m_s2 >= bad_m_s2:
            return HealthRow("vibration", "bad", value, limit, "Heights and places may go wrong. Land; look at rotors.")
        if measured_m_s2 >= near_m_s2:
            return HealthRow("vibration", "near", value, limit, "Look at rotors and mounting before the next flight.")
        return HealthRow("vibration", "good", value, limit)

    def _battery(
        self, state: VehicleState, profile: VehicleProfile, returns: ReturnSpeeds, *, is_known: bool
    ) -> HealthRow:
        """At the worse end of the vehicle's endurance as set and as this flight uses it up."""
        if state.battery_share is None:
            value = "Not told" if state.battery_v is None else f"{state.battery_v:.1f} V"
            return HealthRow(
                "battery", "unknown", value, "", "The vehicle does not tell how much is left. Look yourself."
            )
        share = state.battery_share
        told, over = f"{100 * share:.0f} %", f"over {100 * profile.reserve_share:.0f} %"
        ends_s = (profile.endurance_s if is_known else None, self._endurance_s(state))
        known_s = [end_s for end_s in ends_s if end_s is not None]
        if not known_s:
            return HealthRow("battery", _by_share(share, profile), told, over)
        left_s = max(0.0, share - profile.reserve_share) * min(known_s)
        value = f"{told}, {_minutes(left_s + ROUNDED_S)} to the reserve"
        home_s = way_home_s(state, profile, returns)
        if home_s is None:
            return HealthRow("battery", _by_share(share, profile), value, over)
        still = " in still air, for the wind is not known" if state.wind_speed_m_s is None else ""
        hovers = "" if returns.lands else "; over home it hovers until it is landed"
        limit = f"way home {_minutes(math.ceil(home_s - ROUNDED_S))}{still}{hovers}"
        if left_s <= home_s:
            return HealthRow("battery", "bad", value, limit, "The way home needs the reserve. Return now.")
        if left_s <= home_s + NEAR_HOME_S:
            return HealthRow("battery", "near", value, limit, "A minute from now the way home needs the reserve.")
        return HealthRow("battery", "good", value, limit)

    def _endurance_s(self, state: VehicleState) -> float | None:
        """Of a whole battery, at this flight's rate."""
        if self._from is None or state.battery_share is None:
            return None
        lasted_s, used = state.t_utc_s - self._from.t_utc_s, self._from.share - state.battery_share
        return None if lasted_s < MEASURED_S or used < MEASURED_SHARE else lasted_s / used


def way_home_s(state: VehicleState, profile: VehicleProfile, returns: ReturnSpeeds = NOT_READ) -> float | None:
    """Seconds to home and onto the ground by the way that autopilots return: up, straight, down. None: not known.

    At the vehicle's own speeds as far as they are known, at the worse end otherwise.

    The wind that the vehicle tells blows against it, whatever its direction: it may turn. One that it does not tell
    is taken for none, which whoever shows this has to say.
    """
    if state.lat_deg is None or state.lon_deg is None or state.home_lat_deg is None or state.home_lon_deg is None:
        return None
    height_m = state.alt_rel_home_m
    if height_m is None or not state.armed:
        return None
    away_m = math.hypot(*offset_m((state.lat_deg, state.lon_deg), state.home_lat_deg, state.home_lon_deg))
    pace = worse_pace(returns, profile)
    # Autopilots hold their speed over ground as long as the wind lets them.
    against_m_s = max(SLOWEST_HOME_M_S, profile.max_speed_m_s - (state.wind_speed_m_s or 0.0))
    top_m = max(height_m, pace.height_m)
    down_s = max(0.0, top_m - pace.slow_below_m) / pace.descent_m_s + min(top_m, pace.slow_below_m) / pace.land_m_s
    return away_m / min(pace.level_m_s, against_m_s) + (top_m - height_m) / pace.climb_m_s + pace.wait_s + down_s


class _Heard:
    def __init__(self, now_mono_s: float | None) -> None:
        self._now_mono_s = now_mono_s

    def row(self, code: Code, t_mono_s: float | None) -> HealthRow | None:
        """Unknown, where nothing is heard of it; None where it may be judged."""
        if t_mono_s is None:
            return HealthRow(code, "unknown", "Not heard yet")
        return self.if_told(code, t_mono_s)

    def if_told(self, code: Code, t_mono_s: float | None) -> HealthRow | None:
        """The same where not every recording keeps when it came: None as well."""
        if t_mono_s is None or self._now_mono_s is None or self._now_mono_s - t_mono_s < UNHEARD_S:
            return None
        return HealthRow(code, "unknown", f"Not heard for {self._now_mono_s - t_mono_s:.0f} s")


def _newest_mono_s(state: VehicleState) -> float | None:
    told = (
        state.heartbeat_t_mono_s,
        state.position_t_mono_s,
        state.attitude_t_mono_s,
        state.battery_t_mono_s,
        state.gnss_t_mono_s,
        state.estimator_t_mono_s,
        state.vibration_t_mono_s,
    )
    return max((t_mono_s for t_mono_s in told if t_mono_s is not None), default=None)


def _ready(state: VehicleState) -> HealthRow:
    if state.critical:
        return HealthRow("ready", "bad", "Failsafe", "", "The vehicle follows its own failsafe.")
    if state.armed:
        return HealthRow("ready", "good", "Armed")
    if state.ready_to_arm is False:
        words = " ".join(f'"{each}"' for each in state.not_ready_words)
        return HealthRow("ready", "bad", "Not ready", "", f"It says: {words}." if words else "Read its messages.")
    if state.ready_to_arm is None:
        return HealthRow("ready", "unknown", "Not told", "", "Arming will tell.")
    return HealthRow("ready", "good", "Ready to arm")


def _estimator(state: VehicleState) -> HealthRow:
    bad = ESTIMATOR_BAD[state.autopilot]
    limit = f"under {bad:.1f}"
    ratio = state.estimator_ratio
    value = "No figures" if ratio is None else f"{ratio:.2f} ({state.estimator_ratio_of})"
    if state.estimator_ok is False:
        return HealthRow("estimator", "bad", value, limit, "Its position cannot be used. Fly by hand, or wait.")
    if ratio is None:
        return HealthRow("estimator", "unknown", value)
    if ratio >= bad:
        text = f"Its measurements of {state.estimator_ratio_of} disagree: the failsafe may act. Land."
        return HealthRow("estimator", "bad", value, limit, text)
    if ratio >= ESTIMATOR_NEAR:
        text = f"Its measurements of {state.estimator_ratio_of} begin to disagree."
        return HealthRow("estimator", "near", value, limit, text)
    return HealthRow("estimator", "good", value, limit)


def _gnss(state: VehicleState, profile: VehicleProfile) -> HealthRow:
    place_m, height_m = state.horizontal_accuracy_m, state.vertical_accuracy_m
    fix = FIXES[state.gnss_fix]
    limit = f"within {profile.position_error_m:.2g} m"
    if state.gnss_fix in ("none", "no_fix", "2d"):
        return HealthRow("gnss", "bad", fix, limit, "Neither place nor height is held without a 3-D fix.")
    told = [f"±{place_m:.2f} m"] if place_m is not None else []
    told += [f"height ±{height_m:.2f} m"] if height_m is not None else []
    value = ", ".join([fix, *told])
    worst_m = max((error for error in (place_m, height_m) if error is not None), default=None)
    if worst_m is None:
        return HealthRow("gnss", "unknown", value, limit, "The receiver does not say how accurate it is.")
    if worst_m > profile.position_error_m:
        return HealthRow("gnss", "near", value, limit, "Less accurate than the plan counts on: keep more distance.")
    if place_m is None or height_m is None:
        what = "place" if place_m is None else "height"
        return HealthRow("gnss", "unknown", value, limit, f"The receiver does not say how accurate its {what} is.")
    return HealthRow("gnss", "good", value, limit)


def _wind(state: VehicleState, profile: VehicleProfile) -> HealthRow:
    speed_m_s = state.wind_speed_m_s
    if speed_m_s is None:
        return HealthRow("wind", "unknown", "Not told")
    from_ = "" if state.wind_from_rad is None else f" from {math.degrees(state.wind_from_rad) % 360:03.0f}°"
    value, limit = f"{speed_m_s:.1f} m/s{from_}", f"under {WIND_NEAR * profile.max_speed_m_s:.1f} m/s"
    if speed_m_s >= WIND_BAD * profile.max_speed_m_s:
        return HealthRow("wind", "bad", value, limit, "It may not come home against this wind. Return now.")
    if speed_m_s >= WIND_NEAR * profile.max_speed_m_s:
        return HealthRow("wind", "near", value, limit, "The way home against it takes long.")
    return HealthRow("wind", "good", value, limit)


def _by_share(share: float, profile: VehicleProfile) -> Level:
    return "bad" if share <= profile.reserve_share / 2 else "near" if share <= profile.reserve_share else "good"


def _minutes(seconds: float) -> str:
    whole = int(seconds)
    return f"{whole // 60} min {whole % 60:02d} s" if whole >= 60 else f"{whole} s"
