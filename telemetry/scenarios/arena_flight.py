"""One way through the arena: the vehicle flies to its goal and past what its radar's tracker follows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mapping.tracker import Tracker, TrackState
from planning.velocity_obstacles import Limits, Obstacles, propose
from telemetry.scenarios.arena_course import POLE_RADIUS_M, VEHICLE_RADIUS_M, Approach
from telemetry.scenarios.arena_radar import Position2Go
from telemetry.simulator.dynamics import Airframe, Demand, Multirotor

F64 = NDArray[np.float64]

CRUISE_M_S = 1.2
LIMITS = Limits(max_speed_m_s=1.8, max_turn_rad=math.radians(90.0), leave_m_s=0.3)
MARGIN_M = 0.35
"""Kept beyond the hulls: for the errors of the radar, and for the way that a change of velocity takes."""
RADIUS_M = POLE_RADIUS_M + VEHICLE_RADIUS_M + MARGIN_M
IMMINENT_M = 5.0
"""Farther poles are followed but not yet avoided."""
STEPS_PER_FRAME = 4
VELOCITY_PER_S, MOST_M_S2 = 3.0, 3.0
OWN_SPEED_SIGMA_M_S, OWN_PLACE_SIGMA_M = 0.05, 0.01
ARRIVED_M, LATEST_S = 0.5, 40.0
SAME_M = 1.5
"""A track this near to a pole is that pole's."""


@dataclass(slots=True)
class Flown:
    """What one way came to."""

    duration_s: float = 0.0
    nearest_gap_m: float = math.inf
    arrived: bool = False
    first_evasion_s: float | None = None
    errors: list[tuple[float, float, float]] = field(default_factory=list)
    """Of tracked poles in view: off the nose (rad), error of range (m), error of bearing (rad)."""


def fly(approach: Approach, random: np.random.Generator, *, nearest_only: bool) -> Flown:
    """From wall to wall; ``nearest_only`` as the paper's vehicle, which knew of no second obstacle."""
    radar, flown = Position2Go(), Flown()
    tracker, vehicle = Tracker(radar.tracker()), _at_start(approach)
    while flown.duration_s < LATEST_S and not flown.arrived:
        place, velocity = _flat(vehicle.p_neu), _flat(vehicle.v_neu)
        known = place + random.normal(0.0, OWN_PLACE_SIGMA_M, 2)
        known_m_s = velocity + random.normal(0.0, OWN_SPEED_SIGMA_M_S, 2)
        states = tracker.step(
            flown.duration_s,
            radar.frame(_true(approach, place, velocity, vehicle.heading_rad), random),
            position_enu_m=known,
            velocity_enu_m_s=known_m_s,
            heading_rad=vehicle.heading_rad,
        )
        objects = [state for state in states if state.confirmed]
        flown.errors += _errors(approach, radar, objects, place, vehicle.heading_rad)
        wanted = _wanted(flown, approach, objects, known, known_m_s, nearest_only=nearest_only)
        for _ in range(STEPS_PER_FRAME):
            _move(vehicle, wanted, approach.heading_rad, radar.every_s / STEPS_PER_FRAME)
            flown.nearest_gap_m = min(flown.nearest_gap_m, approach.gap_m(_flat(vehicle.p_neu)))
        flown.duration_s += radar.every_s
        flown.arrived = _is_through(approach, _flat(vehicle.p_neu))
    return flown


def _wanted(
    flown: Flown, approach: Approach, objects: Sequence[TrackState], place: F64, velocity: F64, *, nearest_only: bool
) -> F64:
    """Towards the goal where that leads into nothing, else the nearest velocity to the present one that does not."""
    near = [state for state in objects if np.hypot(*(state.position_enu_m - place)) <= IMMINENT_M]
    obstacles = Obstacles.of(
        place,
        np.array([state.position_enu_m for state in near]).reshape(-1, 2),
        np.array([state.velocity_enu_m_s for state in near]).reshape(-1, 2),
        radius_m=RADIUS_M,
    )
    to_goal = approach.goal_enu_m - place
    to_goal *= CRUISE_M_S / max(float(np.hypot(*to_goal)), 1e-3)
    straight = propose(obstacles, to_goal, LIMITS, nearest_only=nearest_only)
    if straight is not None and not straight.evades:
        return to_goal
    if flown.first_evasion_s is None:
        flown.first_evasion_s = flown.duration_s
    speed = float(np.hypot(*velocity))
    onward = velocity * (CRUISE_M_S / speed) if speed > CRUISE_M_S / 4 else to_goal
    evasion = propose(obstacles, onward, LIMITS, nearest_only=nearest_only)
    return np.zeros(2) if evasion is None else np.array(evasion.velocity_enu_m_s)


def _errors(
    approach: Approach, radar: Position2Go, objects: Sequence[TrackState], place: F64, heading_rad: float
) -> list[tuple[float, float, float]]:
    """Of the track nearest to each pole in view: an echo comes from the side of a pole that faces the radar."""
    out = []
    for pole in approach.poles_enu_m:
        true = _polar(pole - place, heading_rad)
        found = [state.position_enu_m - place for state in objects]
        near = [xy for xy in found if np.hypot(*(xy + place - pole)) <= SAME_M]
        if not near or not radar.sees(np.array([true[0] - POLE_RADIUS_M]), np.array([true[1]]))[0]:
            continue
        tracked = _polar(min(near, key=lambda xy: np.hypot(*(xy + place - pole))), heading_rad)
        off_m = abs(tracked[0] - (true[0] - POLE_RADIUS_M))
        out.append((abs(true[1]), off_m, abs(math.remainder(tracked[1] - true[1], 2 * math.pi))))
    return out


def _true(approach: Approach, place: F64, velocity: F64, heading_rad: float) -> F64:
    """(2, 3) What a radar without errors would measure of the poles."""
    rows = []
    for pole in approach.poles_enu_m:
        range_m, bearing_rad = _polar(pole - place, heading_rad)
        rows.append((range_m - POLE_RADIUS_M, bearing_rad, -float((pole - place) @ velocity) / range_m))
    return np.array(rows)


def _polar(offset_enu_m: F64, heading_rad: float) -> tuple[float, float]:
    bearing = math.remainder(math.atan2(*offset_enu_m) - heading_rad, 2 * math.pi)
    return float(np.hypot(*offset_enu_m)), bearing


def _at_start(approach: Approach) -> Multirotor:
    """Already at its speed."""
    vehicle, heading = Multirotor(Airframe(), approach.heading_rad), approach.heading_rad
    vehicle.p_neu = (float(approach.start_enu_m[1]), float(approach.start_enu_m[0]), 1.5)
    vehicle.v_neu = (CRUISE_M_S * math.cos(heading), CRUISE_M_S * math.sin(heading), 0.0)
    return vehicle


def _move(vehicle: Multirotor, wanted_enu_m_s: F64, heading_rad: float, dt_s: float) -> None:
    """A controller of velocity alone, as the paper's: the nose stays on the goal."""
    drag = vehicle.airframe.drag_per_s
    change = VELOCITY_PER_S * (wanted_enu_m_s - _flat(vehicle.v_neu))
    change *= min(1.0, MOST_M_S2 / max(float(np.hypot(*change)), 1e-9))
    east, north = change + drag * _flat(vehicle.v_neu)
    up = VELOCITY_PER_S * (1.5 - vehicle.p_neu[2]) - VELOCITY_PER_S * vehicle.v_neu[2]
    vehicle.step(Demand((float(north), float(east), up), heading_rad), (0.0, 0.0, 0.0), dt_s)


def _flat(neu: tuple[float, float, float]) -> F64:
    """East and north."""
    return np.array([neu[1], neu[0]])


def _is_through(approach: Approach, place: F64) -> bool:
    """At the far wall, however far aside."""
    along = (place - approach.start_enu_m) @ (approach.goal_enu_m - approach.start_enu_m) / approach.length_m
    return float(along) >= approach.length_m - ARRIVED_M
