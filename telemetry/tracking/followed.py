"""What is known of each track beside its state: whether it really moves, and how near it will come."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.poses import Pose
from mapping.tracking.blobs import Blobs
from mapping.tracking.tracker_params import TrackState
from planning.evading.velocity_obstacles import Obstacles, approaches

SIGNIFICANT = 13.8
"""Chi-square of two degrees of freedom that chance exceeds once in a thousand times."""
STILL_SIGNIFICANT = 4.6
"""The same, once in ten times: whose speed was told once is not taken for standing by the next frame's noise."""
LEAST_M_S = 0.5
DOPPLER_SHARE, DOPPLER_MEMORY = 0.4, 0.85
"""Of the newest echoes, those that move by their radial speed; what a frame before counts."""
PLACE_S, PLACE_M, PLACE_SIGMAS, PLACE_HZ = 2.5, 7.0, 4.0, 5.0
"""What crosses the line of sight at right angles shows itself by its place alone: then it must have come so far, and
been seen so often. Echoes of a wall wander over it, too, but not for long."""
DRIFT_S, DRIFT_M, DRIFT_M_S = 2.0, 1.0, 0.3
"""A slow walker's speed drowns in the noise of each frame; over seconds its way does not."""
ENOUGH_UPDATES, UNSEEN_S = 5, 0.7
AGAIN_ECHOES = 3
"""So many echoes tell again of what stood and was out of sight: by then one of anything near fits its wide gate, and
one alone would move it and give it a speed with which it leaves its place unseen."""
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
    """It is where nothing can see it now."""
    goes: bool = False
    """Its speed is told from standing still, or was when it was seen last; what moves goes."""

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
        goes = self.goes or self.moving
        return np.asarray(self.state.velocity_enu_m_s, np.float64) if goes else np.zeros(2)

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
    goes: bool = False
    moving: bool = False
    confirmed: TrackState | None = None
    """As it was when it was first sure of it."""
    drift_enu_m_s: F64 | None = None
    """Its mean velocity since then, where that is no chance."""
    stood: TrackState | None = None
    """As it was when it was last seen standing; None: it goes."""
    again: int = 0
    """Echoes since it was out of sight, while there are too few of them."""

    def known_by(self, state: TrackState) -> TrackState:
        """Where it stood while nobody sees it; with the mean velocity where the frames show none."""
        if self.stood is not None and (self.again or not state.seen):
            return replace(
                state,
                position_enu_m=self.stood.position_enu_m,
                velocity_enu_m_s=np.zeros(2),
                covariance=self.stood.covariance,
            )
        return state if self.drift_enu_m_s is None else replace(state, velocity_enu_m_s=self.drift_enu_m_s)

    def is_back(self, t_s: float) -> bool:
        """With this echo: whether enough of them tell again of what stood."""
        if self.stood is not None and t_s - self.seen_s > UNSEEN_S:
            self.again = 1
        elif self.again:
            self.again = (self.again + 1) % AGAIN_ECHOES
        self.seen_s = t_s
        return not self.again


class TrackMemory:
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
        """What nobody sees goes on as it went: its speed is no less for being known worse."""
        if not state.seen or not memory.is_back(t_s):
            return
        away_m = np.hypot(*(echoes - state.position_enu_m).T)
        if len(away_m) and away_m.min() <= _ECHO_M:
            moves = float(blobs.moving[int(np.argmin(away_m))])
            share = 1.0 if state.updates <= 1 else 1 - DOPPLER_MEMORY
            memory.doppler += share * (moves - memory.doppler)
        shows = _shows_speed(state, STILL_SIGNIFICANT if memory.goes else SIGNIFICANT)
        if state.confirmed and memory.confirmed is None:
            memory.confirmed = state
        memory.drift_enu_m_s = None if shows or memory.confirmed is None else _drift(memory.confirmed, state)
        memory.goes = shows or memory.drift_enu_m_s is not None
        memory.moving = shows and _is_borne_out(state, memory)
        memory.stood = None if memory.goes else state

    def _followed(self, states: list[TrackState], pose: Pose) -> list[Followed]:
        states = [self._of[s.id].known_by(s) for s in states]
        places = np.array([s.position_enu_m for s in states]).reshape(-1, 2)
        known = [self._of[s.id] for s in states]
        pairs = zip(states, known, strict=True)
        velocities = np.array([s.velocity_enu_m_s if m.goes else (0.0, 0.0) for s, m in pairs])
        coming = approaches(
            Obstacles.of(pose.position_enu_m[:2], places, velocities, radius_m=0.0), pose.velocity_enu_m_s[:2]
        )
        offsets, unseen_s = places - pose.position_enu_m[:2], [pose.t_mono_s - one.seen_s for one in known]
        closest = zip(coming.closest_m.tolist(), coming.after_s.tolist(), strict=True)
        return [
            Followed(s, m.moving, offset, closest_m, in_s, silent_s, goes=m.goes)
            for s, m, offset, (closest_m, in_s), silent_s in zip(states, known, offsets, closest, unseen_s, strict=True)
        ]


def _places(blobs: Blobs, pose: Pose) -> F64:
    """(N, 2) east and north."""
    bearing = blobs.bearing_rad + pose.heading_rad
    return pose.position_enu_m[:2] + np.column_stack([np.sin(bearing), np.cos(bearing)]) * blobs.range_m[:, None]


def _is_borne_out(state: TrackState, memory: _Memory) -> bool:
    """Whether the echoes of what shows a speed, or its way, say that it moves."""
    if memory.doppler >= DOPPLER_SHARE:
        return True
    if state.age_s < PLACE_S or state.updates < PLACE_HZ * state.age_s:
        return False
    way_m = math.hypot(*(np.asarray(state.position_enu_m) - memory.born_m))
    spread = np.asarray(state.covariance, np.float64)
    return way_m > max(PLACE_M, PLACE_SIGMAS * math.sqrt(np.trace(spread[:2, :2])))


def _drift(then: TrackState, now: TrackState) -> F64 | None:
    """(2,) Mean velocity between the two, where it is more than chance."""
    took_s = now.age_s - then.age_s
    way = np.asarray(now.position_enu_m, np.float64) - then.position_enu_m
    if took_s < DRIFT_S or math.hypot(*way) < max(DRIFT_M, DRIFT_M_S * took_s):
        return None
    spread = np.asarray(now.covariance, np.float64)[:2, :2] + then.covariance[:2, :2]
    return way / took_s if way @ np.linalg.solve(spread, way) >= SIGNIFICANT else None


def _shows_speed(state: TrackState, significant: float) -> bool:
    """Whether the track's speed is more than chance."""
    east, north = float(state.velocity_enu_m_s[0]), float(state.velocity_enu_m_s[1])
    if math.hypot(east, north) < LEAST_M_S:
        return False
    ee, en, nn = (float(state.covariance[at]) for at in ((2, 2), (2, 3), (3, 3)))
    return nn * east * east - 2 * en * east * north + ee * north * north >= significant * (ee * nn - en * en)
