"""What is known of each track beside its state: whether it really moves, and how near it will come."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.poses import Pose
from mapping.tracker import TrackState
from planning.velocity_obstacles import Obstacles, approaches
from telemetry.tracking.blobs import Blobs

F64 = NDArray[np.float64]

SIGNIFICANT = 13.8
"""Chi-square of two degrees of freedom that chance exceeds once in a thousand times."""
LEAST_M_S = 0.5
DOPPLER_SHARE, DOPPLER_MEMORY = 0.4, 0.85
"""Of the newest echoes, those that move by their radial speed; what a frame before counts."""
PLACE_S, PLACE_M, PLACE_SIGMAS, PLACE_HZ = 2.5, 7.0, 4.0, 5.0
"""What crosses the line of sight at right angles shows itself by its place alone: then it must have come so far, and
been seen so often. Echoes of a wall wander over it, too, but not for long."""
ENOUGH_UPDATES, UNSEEN_S = 5, 0.7
_ECHO_M = 3.0


@dataclass(frozen=True, slots=True)
class Keep:
    """How near things may come, and how soon that counts."""

    moving_m: float
    """Between middles, as the next one is."""
    moving_s: float
    stands_m: float
    stands_s: float

    def of(self, *, moving: bool) -> tuple[float, float]:
        return (self.moving_m, self.moving_s) if moving else (self.stands_m, self.stands_s)


@dataclass(frozen=True, slots=True)
class Followed:
    """One track at the time of the newest frame."""

    state: TrackState
    moving: bool
    offset_m: F64
    """(2,) from the vehicle, east and north."""
    closest_m: float
    """Between middles, if both go on as they do."""
    closest_in_s: float
    """0: it is not getting nearer."""
    unseen_s: float = 0.0
    """Since its last echo."""
    remembered: bool = False
    """It stands where nothing can see it now."""

    @property
    def id(self) -> int:
        return self.state.id

    @property
    def range_m(self) -> float:
        return math.hypot(*self.offset_m)

    @property
    def bearing_rad(self) -> float:
        """Clockwise from north."""
        return math.atan2(self.offset_m[0], self.offset_m[1])

    @property
    def velocity_enu_m_s(self) -> F64:
        """(2,) Zero where what was measured is not told from standing still: five seconds of it would be metres."""
        return velocity_of(self.state)

    @property
    def sigma_m(self) -> float:
        """Of its place, in the direction where it is known worst."""
        return math.sqrt(max(0.0, float(np.linalg.eigvalsh(self.state.covariance[:2, :2])[-1])))

    def is_dangerous(self, keep: Keep) -> bool:
        """Told of tracks that have been seen often enough. What moves must have been seen just now: what has turned
        away sharply is followed anew, and its old track goes on for a while where nothing is."""
        known = self.state.updates >= ENOUGH_UPDATES and (not self.moving or self.unseen_s <= UNSEEN_S)
        radius_m, within_s = keep.of(moving=self.moving)
        return known and self.closest_m < radius_m and self.closest_in_s <= within_s


@dataclass(slots=True)
class _Memory:
    born_m: F64
    seen_s: float
    doppler: float = 0.0


class Memory:
    """Of all tracks that live."""

    def __init__(self) -> None:
        self._of: dict[int, _Memory] = {}

    def observe(self, states: list[TrackState], blobs: Blobs, pose: Pose) -> list[Followed]:
        """After a frame; the nearest first, only what is confirmed."""
        self._of = {s.id: self._of.get(s.id) or _Memory(np.array(s.position_enu_m), pose.t_mono_s) for s in states}
        echoes = _places(blobs, pose)
        for state in states:
            self._note(state, self._of[state.id], blobs, echoes, pose.t_mono_s)
        return self._followed([state for state in states if state.confirmed], pose)

    def _note(self, state: TrackState, memory: _Memory, blobs: Blobs, echoes: F64, t_s: float) -> None:
        if not state.seen:
            return
        memory.seen_s = t_s
        away_m = np.hypot(*(echoes - state.position_enu_m).T)
        if not len(away_m) or away_m.min() > _ECHO_M:
            return
        moves = float(blobs.moving[int(np.argmin(away_m))])
        memory.doppler = (
            moves if state.updates <= 1 else memory.doppler + (1 - DOPPLER_MEMORY) * (moves - memory.doppler)
        )

    def _followed(self, states: list[TrackState], pose: Pose) -> list[Followed]:
        places = np.array([s.position_enu_m for s in states]).reshape(-1, 2)
        velocities = np.array([velocity_of(s) for s in states]).reshape(-1, 2)
        coming = approaches(
            Obstacles.of(pose.position_enu_m[:2], places, velocities, radius_m=0.0), pose.velocity_enu_m_s[:2]
        )
        return [
            Followed(
                s, _moves(s, self._of[s.id]), place - pose.position_enu_m[:2], closest_m, in_s, self._unseen_s(s, pose)
            )
            for s, place, closest_m, in_s in zip(
                states, places, coming.closest_m.tolist(), coming.after_s.tolist(), strict=True
            )
        ]

    def _unseen_s(self, state: TrackState, pose: Pose) -> float:
        return pose.t_mono_s - self._of[state.id].seen_s


def _places(blobs: Blobs, pose: Pose) -> F64:
    """(N, 2) east and north."""
    bearing = blobs.bearing_rad + pose.heading_rad
    return pose.position_enu_m[:2] + np.column_stack([np.sin(bearing), np.cos(bearing)]) * blobs.range_m[:, None]


def _moves(state: TrackState, memory: _Memory) -> bool:
    """Its speed is more than its uncertainty accounts for, and its echoes or its way bear it out."""
    if not _shows_speed(state):
        return False
    if memory.doppler >= DOPPLER_SHARE:
        return True
    if state.age_s < PLACE_S or state.updates < PLACE_HZ * state.age_s:
        return False
    way_m = math.hypot(*(np.asarray(state.position_enu_m) - memory.born_m))
    spread = np.asarray(state.covariance, np.float64)
    return way_m > max(PLACE_M, PLACE_SIGMAS * math.sqrt(np.trace(spread[:2, :2])))


def velocity_of(state: TrackState) -> F64:
    """(2,) Over ground; zero where it is not told from standing still."""
    return np.asarray(state.velocity_enu_m_s, np.float64) if _shows_speed(state) else np.zeros(2)


def _shows_speed(state: TrackState) -> bool:
    """Whether the track's speed is more than chance."""
    east, north = float(state.velocity_enu_m_s[0]), float(state.velocity_enu_m_s[1])
    if math.hypot(east, north) < LEAST_M_S:
        return False
    ee, en, nn = (float(state.covariance[at]) for at in ((2, 2), (2, 3), (3, 3)))
    return nn * east * east - 2 * en * east * north + ee * north * north >= SIGNIFICANT * (ee * nn - en * en)
