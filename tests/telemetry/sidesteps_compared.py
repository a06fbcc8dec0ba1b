"""Encounters with one moving object, flown by velocity obstacles and by BlueSky's MVP on the very same measurements.

Neither knows the truth: both act on the live tracker's estimate of noisy detections, through the same delay and the
same limits of speed and acceleration.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg
from mapping.geometry.poses import Pose
from mapping.tracking.blobs import Blobs
from mapping.tracking.tracker import Tracker
from planning.evading.velocity_obstacles import Obstacles, approaches
from telemetry.flight.avoidance.passing_tracks import scene_of, velocity_past
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.track_settings import TrackerSettings, VelocitySettings
from telemetry.topics.tracks import Track, TracksStatus
from telemetry.topics.vehicle import VehicleState
from telemetry.tracking.followed import Followed, TrackMemory
from telemetry.tracking.object_tracking import keep_of, track_of
from telemetry.tracking.out_of_view import Remembered
from tests.telemetry.bluesky_mvp import Mvp

COUNT, SEED = 1000, 7
KEEP_M, WITHIN_S = 3.0, 8.0
MVP_RADIUS_M = 1.25 * KEEP_M
"""It keeps to more than what counts as an intrusion, as ours does."""
CRUISE_M_S, MAX_M_S, ACCEL_M_S2 = 4.0, 5.0, 2.5
STEP_S, ORDER_STEPS = 0.1, 2
SIGHT_RAD, DETECTED, MOVES_M_S = math.radians(45.0), 0.9, 0.6
SIGMAS = np.array([0.15, math.radians(1.0), 0.2])
OWN_SIGMA_M, OWN_SIGMA_M_S = 0.03, 0.1
NORTH = np.array([0.0, CRUISE_M_S])
LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
LIVE = PerceptionSettings(safety_radius_m=KEEP_M, velocities=VelocitySettings(max_speed_m_s=MAX_M_S))

Policy = Callable[[Pose, Sequence[Followed]], F64]
"""Where the vehicle believes to be, and what is followed -> the velocity to order."""


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


def velocity_obstacles(settings: PerceptionSettings = LIVE) -> Policy:
    """What steps aside by itself in flight."""

    def decide(pose: Pose, followed: Sequence[Followed]) -> F64:
        east_m_s, north_m_s, _ = pose.velocity_enu_m_s.tolist()
        here = VehicleState(
            1,
            1,
            position_t_mono_s=pose.t_mono_s,
            lat_deg=_lat_lon(pose.position_enu_m)[0],
            lon_deg=_lat_lon(pose.position_enu_m)[1],
            v_east_m_s=east_m_s,
            v_north_m_s=north_m_s,
        )
        status = _status(pose, tuple(_track(one, settings) for one in followed))
        scene = scene_of(here, status, settings, speed_m_s=CRUISE_M_S, now_s=pose.t_mono_s)
        found = velocity_past(scene, NORTH, pose.velocity_enu_m_s[:2])
        return np.zeros(2) if found is None else np.array(found.velocity_enu_m_s)

    return decide


def modified_voltage_potential() -> Policy:
    """Resolves while there is a conflict, keeps that until the closest approach is over, then goes on (BlueSky)."""
    method, kept = Mvp(), list[F64]()

    def decide(pose: Pose, followed: Sequence[Followed]) -> F64:
        if not followed:
            return kept[-1] if kept else NORTH
        nearest, velocity = followed[0], pose.velocity_enu_m_s[:2]
        offset, other_m_s = nearest.offset_m, nearest.velocity_enu_m_s
        coming = approaches(Obstacles.of([0.0, 0.0], [offset], [other_m_s], radius_m=MVP_RADIUS_M), velocity)
        closest_m, after_s = float(coming.closest_m[0]), float(coming.after_s[0])
        if closest_m < MVP_RADIUS_M and 0.0 < after_s <= WITHIN_S:
            change = method.change(
                offset, velocity, other_m_s, radius_m=MVP_RADIUS_M, within_s=WITHIN_S, after_s=max(after_s, STEP_S)
            )
            kept[:] = [_capped(velocity + change)]
            return kept[0]
        is_past = offset @ (other_m_s - velocity) > 0.0 and np.hypot(*offset) > MVP_RADIUS_M
        if is_past:
            kept.clear()
        return kept[0] if kept else NORTH

    return decide


def nearest_m(one: Encounter, policy: Policy) -> float:
    """Between middles, the least of the whole encounter."""
    random, tracker = np.random.default_rng(one.seed), Tracker(TrackerSettings().params())
    memory, remembered = TrackMemory(), Remembered()
    place, velocity, least_m = np.zeros(2), NORTH.copy(), math.inf
    orders = deque([NORTH] * ORDER_STEPS)
    for k in range(round((one.meets_s + 6.0) / STEP_S)):
        other = one.place_enu_m + k * STEP_S * one.velocity_enu_m_s
        least_m = min(least_m, float(np.hypot(*(other - place))))
        pose = _pose(k * STEP_S, place, velocity, random)
        found = _seen(other - place, one.velocity_enu_m_s - velocity, random)
        states = tracker.step(
            pose.t_mono_s,
            found,
            position_enu_m=pose.position_enu_m[:2],
            velocity_enu_m_s=pose.velocity_enu_m_s[:2],
            heading_rad=0.0,
        )
        orders.append(policy(pose, remembered.observe(memory.observe(states, _blobs(found, pose), pose), pose)))
        change = orders.popleft() - velocity
        most = ACCEL_M_S2 * STEP_S
        velocity = velocity + change * min(1.0, most / max(float(np.hypot(*change)), 1e-9))
        place = place + STEP_S * velocity
    return least_m


def _pose(t_s: float, place: F64, velocity: F64, random: np.random.Generator) -> Pose:
    known = place + OWN_SIGMA_M * random.standard_normal(2)
    known_m_s = velocity + OWN_SIGMA_M_S * random.standard_normal(2)
    return Pose(t_s, np.array([*known, 10.0]), np.array([*known_m_s, 0.0]), LEVEL)


def _blobs(found: F64, pose: Pose) -> Blobs:
    """Its own motion taken off, as the tracks node does, what is left of the radial speed shows what moves."""
    range_m, bearing_rad, rate_m_s = found.T
    own_m_s = np.column_stack([np.sin(bearing_rad), np.cos(bearing_rad)]) @ pose.velocity_enu_m_s[:2]
    return Blobs(range_m, bearing_rad, rate_m_s, np.abs(rate_m_s + own_m_s) > MOVES_M_S)


def _status(pose: Pose, tracks: tuple[Track, ...]) -> TracksStatus:
    now_s = pose.t_mono_s
    return TracksStatus("running", "", now_s, now_s, now_s, tracks=tracks, max_speed_m_s=MAX_M_S)


def _track(one: Followed, settings: PerceptionSettings) -> Track:
    place = [*one.state.position_enu_m.tolist(), 10.0]
    return track_of(one, place, _lat_lon(np.array(place)), keep_of(settings))


def _lat_lon(place_enu_m: F64) -> tuple[float, float]:
    """At the equator, where both degrees are as long."""
    return moved_deg((0.0, 0.0), float(place_enu_m[0]), float(place_enu_m[1]))


def _seen(offset: F64, rate: F64, random: np.random.Generator) -> F64:
    """(0 or 1, 3) range, bearing from the nose, radial speed. The same random numbers for whoever flies."""
    errors, luck = SIGMAS * random.standard_normal(3), random.random()
    range_m = max(float(np.hypot(*offset)), 0.1)
    bearing_rad = math.atan2(*offset)
    if abs(bearing_rad) > SIGHT_RAD or luck > DETECTED or range_m < 1.5:
        return np.empty((0, 3))
    return np.array([[range_m, bearing_rad, float(offset @ rate) / range_m]]) + errors


def _capped(velocity: F64) -> F64:
    speed = float(np.hypot(*velocity))
    return velocity * min(1.0, MAX_M_S / max(speed, 1e-9))
