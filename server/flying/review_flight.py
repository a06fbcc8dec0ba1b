"""A flight log placed on a surface model and beside its plan: the track, the reference line, and what was assumed.

Heights above home are placed on the model's height at the vehicle's ACTUAL home, wherever the plan put it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import apart_m
from planning.basics.plan_model import Home, Mission, MissionItem, VehicleProfile
from planning.certificate.commands import TAKEOFFS
from planning.errors import PlanningError
from planning.following.reference import Reference, level_model, reference_line
from planning.following.surface_distance import SurfaceDistance
from planning.following.track import Track
from planning.formats.wpl import read_wpl
from planning.missions.vehicle_profile import DEFAULT_PROFILE, load_profile, parse_profile
from planning.terrain.dsm import Dsm
from telemetry.flight.guided.remaining_mission import RETURNS
from telemetry.recording.flight_log import FlightLog
from telemetry.recording.flight_log import RecordedTrack as Columns
from telemetry.recording.frame_facts import SentTarget
from telemetry.topics.obstacles import AvoidanceStatus

MISSION_MODES = {"auto": ("AUTO", "MISSION"), "guided": ("GUIDED", "OFFBOARD")}
WAYS_HOME = (*RETURNS, "RETURN", "LAND")
HANDED_OVER_M = 0.5
"""A position that was sent is a waypoint of the mission when it lies this near to it."""
SAME_HOME_M = 1.0
SAME_PLACE_M = 10.0
"""A waypoint that the vehicle said it reached is one of this mission if it was this near to it then."""
SLOW_M_S, LONGEST_GAP_S, FEWEST_STEPS, CLOCK_TOLERANCE = 0.5, 1.0, 20, 0.25
"""Of comparing the vehicle's clock with the recording's."""
DETOUR_STATES = frozenset({"holding", "climbing", "offset", "manoeuvre", "ceiling"})
"""Of ``AvoidanceStatus``: it has taken the vehicle over."""

Spans = tuple[tuple[float, float], ...]
"""(begin, end) in seconds of one clock."""


@dataclass(slots=True)
class Flight:
    """A log, placed. ``notes`` grow while it is put together."""

    log: FlightLog
    dsm: Dsm
    """The surface model with small holes filled, or a level stand-in without one."""
    surface: SurfaceDistance | None
    mission: Mission | None
    reference: Reference | None
    track: Track
    """Times count from the log's start."""
    home_alt_dsm_m: float
    """What heights above home are counted from in the curves: the plan's home, else the vehicle's."""
    notes: list[str] = field(default_factory=list)


def placed_flight(
    log: FlightLog, *, dsm: Dsm | None, mission: Mission | None = None, truth: bool = False
) -> Flight | None:
    """The flight over ``dsm`` and against ``mission`` (its own when None); None when it has no position at all."""
    notes = list(log.faults)
    mission = mission or flown_mission(log, notes)
    columns = _columns(log, truth, notes)
    home = _home(log, mission, columns)
    if home is None or not len(columns):
        return None
    surface = SurfaceDistance(dsm) if dsm is not None else None
    model = surface.dsm if surface else level_model(Mission(home, ()))
    reference = _reference(log, mission, model, notes)
    home_alt_m = _height_at(model, home, reference, notes)
    if mission is not None:
        _compare_homes(home, mission, model, notes)
    xyz_m = _xyz(log, columns, model, home, home_alt_m, truth=truth)
    known = np.isfinite(xyz_m).all(axis=1)
    detours = detours_of(log)
    guided = _flown_one_by_one(log, detours)
    if reference is not None and guided and mission is not None:
        reference = _as_far_as_led(log, mission, reference, detours, notes)
    track = Track(
        t_s=columns.t_utc_s[known] - log.start_utc_s,
        xyz_m=xyz_m[known],
        reached=_reached(log, mission, notes),
        on_mission=_spans(log, "guided" if guided else "auto"),
        one_by_one=guided,
        clock_rate=_clock_rate(columns, xyz_m, notes),
        detours=tuple((begin - log.start_utc_s, end - log.start_utc_s) for begin, end in detours),
    )
    datum_m = home_alt_m if reference is None else reference.home_alt_dsm_m
    return Flight(log, model, surface, mission, reference, track, datum_m, notes)


def flown_mission(log: FlightLog, notes: list[str]) -> Mission | None:
    """The mission that the recording itself holds."""
    if log.plan is not None and log.plan.mission_wpl:
        try:
            return read_wpl(log.plan.mission_wpl, "the recording's mission")
        except PlanningError as error:
            notes.append(f"The recorded plan cannot be read: {error.what}")
    return log.mission


def profile_of(log: FlightLog) -> VehicleProfile:
    """The profile that was planned with; the default one for other logs."""
    if log.plan is not None and log.plan.profile_toml:
        try:
            return parse_profile(log.plan.profile_toml.encode(), where="the recording's profile")
        except PlanningError:
            return load_profile(DEFAULT_PROFILE)
    return load_profile(DEFAULT_PROFILE)


def _columns(log: FlightLog, truth: bool, notes: list[str]) -> Columns:
    if not truth:
        return log.track
    if log.truth is None:
        notes.append("The recording holds no true positions: only simulators send them. The vehicle's own were taken.")
        return log.track
    notes.append("These are the simulator's true positions, not what the vehicle took itself to be at.")
    return log.truth


def _home(log: FlightLog, mission: Mission | None, columns: Columns) -> Home | None:
    if log.home is not None:
        alt_m = log.home.alt_amsl_m
        return Home(log.home.lat_deg, log.home.lon_deg, math.nan if alt_m is None else alt_m)
    if mission is not None and math.isfinite(mission.home.lat_deg):
        return mission.home
    if len(columns):
        return Home(float(columns.lat_deg[0]), float(columns.lon_deg[0]), math.nan)
    return None


def _reference(log: FlightLog, mission: Mission | None, model: Dsm, notes: list[str]) -> Reference | None:
    if mission is None:
        notes.append("There is no mission to hold the flight against: choose one to see its errors.")
        return None
    try:
        taken_up = log.plan is not None and log.plan.taken_up and _has_no_take_off(mission)
        reference = reference_line(mission, model, profile_of(log), begins_in_air=taken_up)
    except PlanningError as error:
        notes.append(f"The flight cannot be held against the mission: {error.what}")
        return None
    notes += reference.notes
    return reference


def _has_no_take_off(mission: Mission) -> bool:
    return all(item.command not in TAKEOFFS for item in mission.items)


def _height_at(model: Dsm, home: Home, reference: Reference | None, notes: list[str]) -> float:
    """The model's height at the vehicle's home; the plan's home where the model does not know it."""
    height_m = float(model.elevation_at(model.xy_from_lat_lon(np.array([[home.lat_deg, home.lon_deg]])))[0])
    if math.isfinite(height_m):
        return height_m
    notes.append("The surface model does not know the vehicle's home: heights may be off by its height difference.")
    return reference.home_alt_dsm_m if reference else 0.0


def _compare_homes(home: Home, mission: Mission, model: Dsm, notes: list[str]) -> None:
    places = np.array([[home.lat_deg, home.lon_deg], [mission.home.lat_deg, mission.home.lon_deg]])
    if not np.isfinite(places).all():
        return
    xy_m = model.xy_from_lat_lon(places)
    away_m = float(np.hypot(*(xy_m[0] - xy_m[1])))
    if away_m < SAME_HOME_M:
        return
    higher_m = float(np.diff(model.elevation_at(xy_m[::-1]))[0])
    text = f"The vehicle's home was {away_m:.1f} m from the plan's"
    if math.isfinite(higher_m):
        text += f", where the surface is {abs(higher_m):.2f} m {'higher' if higher_m >= 0 else 'lower'}"
    notes.append(f"{text}. Heights count from the vehicle's.")


def _xyz(log: FlightLog, columns: Columns, model: Dsm, home: Home, home_alt_m: float, *, truth: bool) -> F64:
    xy_m = model.xy_from_lat_lon(np.column_stack([columns.lat_deg, columns.lon_deg]))
    alt_m = home_alt_m + columns.alt_rel_home_m
    if truth and log.truth is not None and abs(home.alt_dsm_m - home_alt_m) <= SAME_HOME_M:
        alt_m = columns.alt_amsl_m  # a simulator set up in the model's own heights
    return np.column_stack([xy_m, alt_m])


def _clock_rate(columns: Columns, xyz_m: F64, notes: list[str]) -> float:
    """How much faster than the recording's clock the vehicle's ran: the way that it made over its speed times time."""
    speed_m_s = np.hypot(columns.v_north_m_s, columns.v_east_m_s)
    steps_m, steps_s = np.hypot(*np.diff(xyz_m[:, :2], axis=0).T), np.diff(columns.t_utc_s)
    moving = (speed_m_s[1:] > SLOW_M_S) & np.isfinite(steps_m) & (steps_s < LONGEST_GAP_S)
    if moving.sum() < FEWEST_STEPS:
        return 1.0
    rate = float(steps_m[moving].sum() / (speed_m_s[1:] * steps_s)[moving].sum())
    if abs(rate - 1.0) < CLOCK_TOLERANCE:
        return 1.0
    rate = round(rate) if abs(rate - round(rate)) < 0.02 * rate and rate > 1.5 else rate
    notes.append(
        f"The vehicle's clock ran {rate:.3g} times as fast as the recording's, as in simulations:"
        " the flight's duration and lag are by the vehicle's."
    )
    return rate


def detours_of(log: FlightLog) -> Spans:
    """When avoidance flew the rest of a mission; what it did on the way home is not of the mission."""
    edges = [*log.avoidance, (log.end_utc_s, AvoidanceStatus())]
    spans: list[tuple[float, float]] = []
    for (begin, status), (end, _) in itertools.pairwise(edges):
        if status.state not in DETOUR_STATES:
            continue
        if spans and spans[-1][1] == begin:
            spans[-1] = (spans[-1][0], end)
        elif not _goes_home(log, begin):
            spans.append((begin, end))
    return tuple(spans)


def _goes_home(log: FlightLog, t_utc_s: float) -> bool:
    ways = (mode for t, mode in reversed(log.modes) if t <= t_utc_s)
    return next((mode in WAYS_HOME for mode in ways if mode in (*MISSION_MODES["auto"], *WAYS_HOME)), False)


def _is_in(spans: Spans, t_utc_s: float) -> bool:
    return any(begin <= t_utc_s <= end for begin, end in spans)


def _flown_one_by_one(log: FlightLog, detours: Spans) -> bool:
    """Whether a ground station handed over positions, and the vehicle was in a mode that flies to them.

    Those of avoidance take over a mission that may have been flown on board.
    """
    led = any(not _is_in(detours, target.t_utc_s) for target in log.targets)
    return led and any(mode in MISSION_MODES["guided"] for _, mode in log.modes)


def _spans(log: FlightLog, way: str) -> tuple[tuple[float, float], ...] | None:
    """Seconds since the start in which the vehicle, armed, was in a mode that flies this way; None if it never was."""
    edges = sorted({t for t, _ in (*log.modes, *log.armed)} | {log.end_utc_s})
    spans: list[tuple[float, float]] = []
    for begin, end in itertools.pairwise(edges):
        if _value_at(log.modes, begin) in MISSION_MODES[way] and _value_at(log.armed, begin):
            begin_s, end_s = begin - log.start_utc_s, end - log.start_utc_s
            joins = spans and spans[-1][1] == begin_s
            spans[-1:] = [(spans[-1][0], end_s)] if joins else [*spans[-1:], (begin_s, end_s)]
    return tuple(spans) or None


def _value_at(changes: tuple[tuple[float, object], ...], t_utc_s: float) -> object:
    return next((value for t, value in reversed(changes) if t <= t_utc_s), None)


def _reached(log: FlightLog, mission: Mission | None, notes: list[str]) -> tuple[tuple[float, int], ...]:
    """What the vehicle said it reached, as indices of the mission's items; none when it was another mission."""
    if mission is None or not len(log.track):
        return ()
    first = 1 if log.vehicle.autopilot == "ardupilot" else 0
    told = [(t, seq - first) for t, seq in log.reached if 0 <= seq - first < len(mission.items)]
    placed = [(t, k) for t, k in told if mission.items[k].lat_deg or mission.items[k].lon_deg]
    near = sum(_away_m(log, t, mission, k) <= SAME_PLACE_M for t, k in placed)
    if 2 * near < len(placed):
        notes.append("The vehicle reported waypoints of another mission: they were not used.")
        return ()
    return tuple((t - log.start_utc_s, k) for t, k in told)


def _away_m(log: FlightLog, t_utc_s: float, mission: Mission, item: int) -> float:
    row = min(int(np.searchsorted(log.track.t_utc_s, t_utc_s)), len(log.track) - 1)
    place = mission.items[item]
    at_deg = float(log.track.lat_deg[row]), float(log.track.lon_deg[row])
    return apart_m(at_deg, (place.lat_deg, place.lon_deg))


def _is_at(item: MissionItem, target: SentTarget) -> bool:
    return apart_m((target.lat_deg, target.lon_deg), (item.lat_deg, item.lon_deg)) <= HANDED_OVER_M


def _as_far_as_led(
    log: FlightLog, mission: Mission, reference: Reference, detours: Spans, notes: list[str]
) -> Reference:
    """The line up to the last waypoint that was handed over: nothing led the vehicle on from there."""
    item, strays = -1, 0
    for target in log.targets:
        led_to = next(
            (
                k
                for k in range(max(item + 1, reference.first_item), len(mission.items))
                if _is_at(mission.items[k], target)
            ),
            -1,
        )
        strays += led_to < 0 and not _is_in(detours, target.t_utc_s)
        item = max(item, led_to)
    if 2 * strays > sum(not _is_in(detours, target.t_utc_s) for target in log.targets):
        notes.append("The positions that were sent to the vehicle are not those of the mission.")
        return reference
    led = reference.ending_at(item)
    if not led.whole:
        notes.append(f"Waypoints were handed over up to item {item + 1} of {len(mission.items)}: the line ends there.")
    return led
