"""The velocity to fly now: the wanted one while it leads into nothing, else the nearest that does not.

Velocity obstacles (Wessendorp 2021, III-C; Fiorini and Shiller 1998) at every frame anew. Ground that rises to the
vehicle's height is an obstacle that stands still, like any other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.evading.reachable import roomiest, shortfall
from planning.evading.velocity_obstacles import Limits, Obstacles, Proposal, approaches, proposal_of, propose

SHARES = (1.0, 0.85, 0.7)
"""Of what is to be kept: where the whole of it leaves no velocity, somewhat less is better than nothing."""
ONWARD_SHARE = 0.25
"""Slower than so much of the wanted speed there is no direction of its own to stay near to."""
ENOUGH = 0.05
"""So much of a radius may be cut on the way to a velocity that would keep it."""
DISC_WIDER = 1.3
"""Discs of neighbouring directions overlap."""
LEAST_DISC_M = 0.5
TOGETHER = 3
"""So many neighbouring directions share a disc, at the nearest ground of them: it bounds the time that it takes."""


def steer(
    obstacles: Obstacles,
    wanted_enu_m_s: F64,
    velocity_enu_m_s: F64,
    limits: Limits,
    *,
    nearest_only: bool = False,
    by_room: bool = False,
) -> Proposal | None:
    """Raises ParameterError for what is no number.

    It stays near to the present velocity, not to the wanted one: else it would change sides with every frame. None:
    every velocity within the limits leads into something. ``by_room``: where the nearest velocity outside of all cones
    cannot be reached in time, or there is none, it is the one that leaves the most room on the way to it; from all
    obstacles, also where only the nearest one chooses the velocity.
    """
    looked_at = _nearest_ahead(obstacles, wanted_enu_m_s, velocity_enu_m_s) if nearest_only else obstacles
    straight = propose(looked_at, wanted_enu_m_s, replace(limits, max_turn_rad=math.pi))
    if straight is not None and not straight.evades:
        passes_all = not (by_room and nearest_only)
        if passes_all or shortfall(obstacles, velocity_enu_m_s, wanted_enu_m_s[None])[0] <= ENOUGH:
            return straight
    speed, cruise = math.hypot(*velocity_enu_m_s), math.hypot(*wanted_enu_m_s)
    goes = speed > ONWARD_SHARE * cruise and speed > 0.0
    onward = velocity_enu_m_s * (cruise / speed) if goes else wanted_enu_m_s
    edge = _on_an_edge(looked_at, onward, limits)
    if not by_room:
        return edge
    also = None if edge is None else np.array([edge.velocity_enu_m_s])
    if also is not None and shortfall(obstacles, velocity_enu_m_s, also)[0] <= ENOUGH:
        return edge
    chosen = roomiest(obstacles, onward, velocity_enu_m_s, limits, also=also)
    return proposal_of(obstacles, onward, chosen)


def _nearest_ahead(obstacles: Obstacles, *velocities_enu_m_s: F64) -> Obstacles:
    """What is being left behind is remembered, and would hide what is met next: the paper's vehicle did not see it."""
    inside = obstacles.range_m < obstacles.radius_m
    nears = [approaches(obstacles, velocity).after_s > 0.0 for velocity in velocities_enu_m_s]
    return obstacles.some(np.logical_or.reduce([inside, *nears])).nearest()


def _on_an_edge(obstacles: Obstacles, onward: F64, limits: Limits) -> Proposal | None:
    for share in SHARES:
        smaller = replace(obstacles, radius_m=share * obstacles.radius_m)
        found = propose(smaller, onward, limits)
        if found is not None:
            return found
    return None


def with_ground(obstacles: Obstacles, room_m: Sequence[float], *, farthest_m: float) -> Obstacles:
    """And ground that rises to the vehicle's height: a disc in each direction in which it ends the room.

    ``room_m`` are even directions clockwise from north; nothing is added farther than ``farthest_m``.
    """
    together = TOGETHER if len(room_m) % TOGETHER == 0 else 1
    room = np.asarray(room_m, np.float64).reshape(-1, together).min(axis=1)
    near = room < farthest_m
    if not near.any():
        return obstacles
    bearing = (np.arange(len(room))[near] * together + (together - 1) / 2) * (2 * math.pi / len(room_m))
    radius = np.maximum(LEAST_DISC_M, DISC_WIDER * math.pi / len(room) * room[near])
    towards = np.column_stack([np.sin(bearing), np.cos(bearing)])
    places = obstacles.position_enu_m + towards * (room[near] + radius)[:, None]
    return Obstacles(
        obstacles.position_enu_m,
        np.concatenate([obstacles.obstacles_enu_m, places]),
        np.concatenate([obstacles.velocities_enu_m_s, np.zeros_like(places)]),
        np.concatenate([obstacles.radius_m, radius]),
    )
