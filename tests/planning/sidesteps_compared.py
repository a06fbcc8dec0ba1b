"""Encounters with one moving object, flown by velocity obstacles and by BlueSky's MVP on the very same measurements.

Neither knows the truth: both act on the live tracker's estimate of noisy detections, through the same delay and the
same limits of speed and acceleration.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.tracker import Tracker, TrackState
from planning.steering import steer
from planning.velocity_obstacles import Limits, Obstacles, approaches
from telemetry.flight.aside import LATENCY_S, SPARE
from telemetry.track_settings import TrackerSettings
from telemetry.tracking.followed import velocity_of
from tests.planning.bluesky_mvp import Mvp

F64 = NDArray[np.float64]

KEEP_M, WITHIN_S = 3.0, 8.0
RADIUS_M = SPARE * KEEP_M
"""Both keep to more than what counts as an intrusion."""
CRUISE_M_S, MAX_M_S, ACCEL_M_S2 = 4.0, 5.0, 2.5
STEP_S, ORDER_STEPS = 0.1, 2
SIGHT_RAD, DETECTED = math.radians(45.0), 0.9
SIGMAS = np.array([0.15, math.radians(1.0), 0.2])
OWN_SIGMA_M, OWN_SIGMA_M_S = 0.03, 0.1
LIMITS = Limits(max_speed_m_s=MAX_M_S)
NORTH = np.array([0.0, CRUISE_M_S])

Policy = Callable[[F64, F64, TrackState | None], F64]
"""Own place and velocity as measured, and the track -> the velocity to order."""


@dataclass(frozen=True, slots=True)
class Encounter:
    """The own vehicle begins at (0, 0) and would fly north."""

    place_enu_m: F64
    velocity_enu_m_s: F64
    meets_s: float
    seed: int


def encounters(count: int, seed: int) -> list[Encounter]:
    """In sight at first, and within the radius at their closest if nobody does anything."""
    random, out = np.random.default_rng(seed), list[Encounter]()
    while len(out) < count:
        meets_s, speed = random.uniform(6.0, 10.0), random.uniform(0.5, 6.0)
        heading = random.uniform(-math.pi, math.pi)
        velocity = speed * np.array([math.sin(heading), math.cos(heading)])
        miss = random.uniform(-0.8, 0.8) * KEEP_M
        rate = velocity - NORTH
        if np.hypot(*rate) < 0.5:
            continue
        across = np.array([rate[1], -rate[0]]) / np.hypot(*rate)
        place = across * miss - rate * meets_s
        if abs(math.atan2(*place)) <= SIGHT_RAD and 12.0 < np.hypot(*place) < 90.0:
            out.append(Encounter(place, velocity, meets_s, int(random.integers(2**31))))
    return out


def velocity_obstacles() -> Policy:
    def decide(place: F64, velocity: F64, track: TrackState | None) -> F64:
        if track is None:
            return NORTH
        other_m_s = velocity_of(track)
        later = track.position_enu_m + LATENCY_S * other_m_s - LATENCY_S * velocity
        obstacles = Obstacles.of(place, [later], [other_m_s], radius_m=RADIUS_M)
        found = steer(obstacles, NORTH, velocity, LIMITS)
        return np.zeros(2) if found is None else np.array(found.velocity_enu_m_s)

    return decide


def modified_voltage_potential() -> Policy:
    """Resolves while there is a conflict, keeps that until the closest approach is over, then goes on (BlueSky)."""
    method, kept = Mvp(), list[F64]()

    def decide(place: F64, velocity: F64, track: TrackState | None) -> F64:
        if track is None:
            return kept[-1] if kept else NORTH
        other_m_s = velocity_of(track)
        offset = track.position_enu_m - place
        coming = approaches(Obstacles.of(place, [track.position_enu_m], [other_m_s], radius_m=RADIUS_M), velocity)
        closest_m, after_s = float(coming.closest_m[0]), float(coming.after_s[0])
        if closest_m < RADIUS_M and 0.0 < after_s <= WITHIN_S:
            change = method.change(
                offset, velocity, other_m_s, radius_m=RADIUS_M, within_s=WITHIN_S, after_s=max(after_s, STEP_S)
            )
            kept[:] = [_capped(velocity + change)]
            return kept[0]
        is_past = offset @ (other_m_s - velocity) > 0.0 and np.hypot(*offset) > RADIUS_M
        if is_past:
            kept.clear()
        return kept[0] if kept else NORTH

    return decide


def nearest_m(one: Encounter, policy: Policy) -> float:
    """Between middles, the least of the whole encounter."""
    random, tracker = np.random.default_rng(one.seed), Tracker(TrackerSettings().params())
    place, velocity, least_m = np.zeros(2), NORTH.copy(), math.inf
    orders = deque([NORTH] * ORDER_STEPS)
    heading_rad = 0.0
    for k in range(round((one.meets_s + 6.0) / STEP_S)):
        other = one.place_enu_m + k * STEP_S * one.velocity_enu_m_s
        least_m = min(least_m, float(np.hypot(*(other - place))))
        known = place + OWN_SIGMA_M * random.standard_normal(2)
        known_m_s = velocity + OWN_SIGMA_M_S * random.standard_normal(2)
        states = tracker.step(
            k * STEP_S,
            _seen(other - place, one.velocity_enu_m_s - velocity, heading_rad, random),
            position_enu_m=known,
            velocity_enu_m_s=known_m_s,
            heading_rad=heading_rad,
        )
        confirmed = [state for state in states if state.confirmed]
        orders.append(policy(known, known_m_s, confirmed[0] if confirmed else None))
        change = orders.popleft() - velocity
        most = ACCEL_M_S2 * STEP_S
        velocity = velocity + change * min(1.0, most / max(float(np.hypot(*change)), 1e-9))
        place = place + STEP_S * velocity
    return least_m


def _seen(offset: F64, rate: F64, heading_rad: float, random: np.random.Generator) -> F64:
    """(0 or 1, 3) range, bearing from the nose, radial speed. The same random numbers for whoever flies."""
    errors, luck = SIGMAS * random.standard_normal(3), random.random()
    range_m = max(float(np.hypot(*offset)), 0.1)
    bearing_rad = math.remainder(math.atan2(*offset) - heading_rad, math.tau)
    if abs(bearing_rad) > SIGHT_RAD or luck > DETECTED or range_m < 1.5:
        return np.empty((0, 3))
    return np.array([[range_m, bearing_rad, float(offset @ rate) / range_m]]) + errors


def _capped(velocity: F64) -> F64:
    speed = float(np.hypot(*velocity))
    return velocity * min(1.0, MAX_M_S / max(speed, 1e-9))
