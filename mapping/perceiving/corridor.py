"""The corridor along the mission ahead: which occupied voxels the vehicle would touch if it went on."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import Polyline, along_m
from mapping.perceiving.braking import Braking

OFF_LINE_M = 15.0
"""A vehicle so far from the mission's line is not flying it."""
LOOK_AHEAD_M, LOOK_BACK_M = 60.0, 15.0
"""How far along the line from the last place the next one is looked for first."""
LOST_M = 3.0
"""A place elsewhere on the line is taken once it is this much nearer."""
SECONDS_AHEAD = 5.0


def length_m(speed_m_s: float, braking: Braking) -> float:
    """Stopping distance and five seconds of flight."""
    return braking.distance_m(speed_m_s) + SECONDS_AHEAD * speed_m_s


@dataclass(frozen=True, slots=True)
class Place:
    """On a line: how far along it, and how far from the position that it belongs to."""

    s_m: float
    distance_m: float


class MissionLine:
    """The line that is flown, (M, 3) map metres, and how far the vehicle has come on it.

    It may cross itself: what lies near the last place is preferred.
    """

    def __init__(self, points_enu: F64) -> None:
        points = np.array(np.asarray(points_enu, np.float64).reshape(-1, 3))
        if len(points) < 2 or not np.isfinite(points).all():
            raise ValueError(f"A mission's line needs two finite points or more, got {points.tolist()}.")
        self.points_enu = points
        self._line = Polyline(points)
        self._near_m: float | None = None

    def place(self, position_enu_m: F64) -> Place | None:
        """The place that belongs to the position; None when the vehicle is not on the line."""
        s, away = self._line.nearest(position_enu_m)
        if self._near_m is not None:
            near = self._line.nearest(position_enu_m, self._near_m - LOOK_BACK_M, self._near_m + LOOK_AHEAD_M)
            if near[1] <= away + LOST_M:
                s, away = near
        if away > OFF_LINE_M:
            return None
        self._near_m = s
        return Place(s, away)

    def ahead(self, s_m: float, length_m: float) -> F64:
        """(K, 3) the piece of the line from ``s_m`` on, its ends included."""
        return self._line.ahead(s_m, length_m)


def tube_points(line_enu: F64, *, radius_m: float, step_m: float, reach_down: float = 0.0) -> F64:
    """(N, 3) places of the tube around a line, the nearest to its begin first, spaced by ``step_m`` at most.

    With ``reach_down`` the tube also reaches down by that share of the distance from the line's begin: what a sensor
    that cannot tell heights has put lower may stand as high as the line.
    """
    line = np.asarray(line_enu, np.float64).reshape(-1, 3)
    s = along_m(line)
    along = np.linspace(0.0, s[-1], max(2, math.ceil(s[-1] / step_m) + 1))
    middle = np.column_stack([np.interp(along, s, line[:, k]) for k in range(3)])
    disc = _ball(radius_m, step_m)
    if reach_down == 0.0:
        return (middle[:, None, :] + disc[None, :, :]).reshape(-1, 3)
    flat = disc[disc[:, 2] == 0.0]
    pieces = [middle[:, None, :] + disc[None, :, :]]
    for depth_m in np.arange(step_m, reach_down * s[-1] + step_m, step_m):
        reached = middle[along * reach_down >= depth_m]
        pieces.append(reached[:, None, :] + (flat - [0.0, 0.0, depth_m])[None, :, :])
    return np.vstack([piece.reshape(-1, 3) for piece in pieces])


def _ball(radius_m: float, step_m: float) -> F64:
    """Places within ``radius_m`` of the origin, the origin and six on the surface among them."""
    count = max(1, math.ceil(radius_m / step_m))
    axis = np.linspace(-radius_m, radius_m, 2 * count + 1)
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return grid[np.linalg.norm(grid, axis=1) <= radius_m * (1 + 1e-9)]
