"""Past what the tracks say: what is around the vehicle, and the velocity nearest to the wanted one that keeps clear."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from planning.errors import ParameterError
from planning.evading.reachable import shortfall
from planning.evading.steering import steer, with_ground
from planning.evading.velocity_obstacles import Limits, Obstacles, Proposal
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.tracks import Track, TracksStatus
from telemetry.topics.vehicle import VehicleState

LATENCY_S = 0.3
"""From measuring a frame to what is flown because of it."""
SPARE, SIGMAS = 1.25, 2.0
"""Of the safety radius of what moves, where its place is known well; and of the uncertainty of a place."""
SAME_M_S = 1e-6
MOST = 24


@dataclass(frozen=True, slots=True)
class Scene:
    """What is around the vehicle, which is at (0, 0)."""

    obstacles: Obstacles
    limits: Limits
    nearest_only: bool
    by_room: bool
    horizon_m: float
    room_m: tuple[float, ...]
    """In even directions clockwise from north until known ground."""


def scene_of(
    state: VehicleState, tracks: TracksStatus, settings: PerceptionSettings, *, speed_m_s: float, now_s: float
) -> Scene:
    """``speed_m_s``: of the flight as it is planned."""
    velocities = settings.velocities
    at_s = state.position_t_mono_s or now_s
    later_s = max(0.0, at_s - tracks.t_mono_s) + LATENCY_S
    horizon_m = max(speed_m_s, math.hypot(*velocity_of(state))) * velocities.stands_s + velocities.stands_m
    near = [t for t in tracks.tracks if _goes(t) or t.range_m < horizon_m][:MOST]
    assert state.lat_deg is not None
    assert state.lon_deg is not None
    here = (state.lat_deg, state.lon_deg)
    ahead = velocity_of(state) * LATENCY_S
    places = [
        np.array(offset_m(here, t.lat_deg, t.lon_deg)) + later_s * np.array(t.velocity_enu_m_s) - ahead for t in near
    ]
    obstacles = Obstacles.of(
        [0.0, 0.0],
        np.array(places).reshape(-1, 2),
        np.array([t.velocity_enu_m_s for t in near]).reshape(-1, 2),
        radius_m=np.array([_radius_m(t, settings) for t in near]),
    )
    limits = velocities.limits(Limits(max_speed_m_s=max(tracks.max_speed_m_s, speed_m_s)))
    return Scene(obstacles, limits, velocities.nearest_only, velocities.choice == "room", horizon_m, tracks.room_m)


def velocity_past(scene: Scene, wanted: F64, velocity: F64) -> Proposal | None:
    """The line itself is certified: ground is looked at only where it is left."""
    choice = {"nearest_only": scene.nearest_only, "by_room": scene.by_room}
    try:
        straight = steer(scene.obstacles, wanted, velocity, scene.limits, **choice)
        if straight is None or is_wanted(straight, wanted):
            return straight
        everything = with_ground(scene.obstacles, scene.room_m, farthest_m=scene.horizon_m)
        return steer(everything, wanted, velocity, scene.limits, **choice)
    except ParameterError:
        return None


def is_last_moment(scene: Scene, velocity: F64) -> bool:
    """Whether who stops now comes too near all the same."""
    return scene.by_room and float(shortfall(scene.obstacles, velocity, np.zeros((1, 2)))[0]) > 0.0


def is_wanted(found: Proposal, wanted: F64) -> bool:
    """What is found may evade nothing and be another velocity all the same: the present one, where that is free."""
    return math.dist(found.velocity_enu_m_s, wanted) < SAME_M_S


def _goes(track: Track) -> bool:
    """Its echoes may not bear out yet that it moves; its place does."""
    return track.moving or any(track.velocity_enu_m_s)


def _radius_m(track: Track, settings: PerceptionSettings) -> float:
    """What is known badly, because nobody sees it any more, is kept farther away from."""
    ee, en, nn = track.covariance_m2
    worst_m2 = (ee + nn) / 2 + math.hypot((ee - nn) / 2, en)
    unsure_m = SIGMAS * math.sqrt(max(0.0, worst_m2))
    if _goes(track):
        safe_m = settings.safety_radius_m
        return safe_m + min(max((SPARE - 1.0) * safe_m, unsure_m), safe_m)
    stands_m = settings.velocities.stands_m
    return stands_m + min(unsure_m, stands_m / 4)


def velocity_of(state: VehicleState) -> F64:
    """(2,) East and north."""
    return np.array([state.v_east_m_s or 0.0, state.v_north_m_s or 0.0])
