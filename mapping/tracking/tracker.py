"""The tracker: frames of detections in, objects with place, velocity and uncertainty out."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linear_sum_assignment

from mapping.errors import ParameterError
from mapping.geometry.arrays import F64, I64, Bools
from mapping.tracking import cartesian, polar
from mapping.tracking.kalman import FULL_TURN, distances, spreads, update, variances
from mapping.tracking.tracker_params import TrackerParams, TrackState

FARTHEST_M, FASTEST_M_S = 1e6, 1e4
"""Beyond these nothing is a detection."""
BELIEVED_SIGMAS = 6.0
"""Of an object's speed over ground, where the radar leaves several open: with 3, which 5 m/s makes 15, a small plane
that came at 16 was never followed, for its only candidates flew elsewhere."""
STANDS_SIGMAS = 3.0
"""Of a radial speed. What seems so slow over ground stands, and is not taken for something as fast as the folding."""


class Tracker:
    """Multi-target tracker of one radar (Wessendorp 2021, III-B). Not for several threads at once."""

    def __init__(self, params: TrackerParams | None = None) -> None:
        self.params = params or TrackerParams()
        self._noise = self.params.noise()
        self._last_id = 0
        self.clear()

    def tune(self, params: TrackerParams) -> None:
        """Go on with other parameters, from nothing: what was followed by the old ones is forgotten, but the ids."""
        self.params, self._noise = params, params.noise()
        self.clear()

    def clear(self) -> None:
        """Forget everything but the ids that were given."""
        self._t_s = -math.inf
        self._own = np.zeros(4)
        self._x, self._P = np.empty((0, 4)), np.empty((0, 4, 4))
        self._id, self._updates = np.empty(0, np.int64), np.empty(0, np.int64)
        self._born_s = np.empty(0)
        self._seen, self._confirmed = np.empty(0, np.bool_), np.empty(0, np.bool_)

    def step(
        self,
        t_s: float,
        detections: ArrayLike,
        *,
        position_enu_m: ArrayLike,
        velocity_enu_m_s: ArrayLike,
        heading_rad: float,
    ) -> list[TrackState]:
        """One frame -> all objects and candidates, nearest first.

        ``detections`` (N, 3): range in metres, bearing clockwise from the nose, radial speed (positive: moving away;
        NaN: not measured). ``position_enu_m`` and ``velocity_enu_m_s`` (2,) are the vehicle's own, over ground; the
        radial speed is relative to it. Raises ParameterError for a frame that is no later than the last one, for
        detections of another shape and for a vehicle that is nowhere; nothing has changed then.
        """
        own = self._checked(t_s, position_enu_m, velocity_enu_m_s, heading_rad)
        heading_rad = math.remainder(heading_rad, FULL_TURN)
        found = self._usable(detections, heading_rad)
        self._predict(t_s, own)
        free = self._follow(found, heading_rad)
        self._judge(heading_rad)
        self._begin(found[free], heading_rad)
        return self._states()

    def _checked(self, t_s: float, position_enu_m: ArrayLike, velocity_enu_m_s: ArrayLike, heading_rad: float) -> F64:
        own = np.concatenate([np.asarray(position_enu_m, np.float64), np.asarray(velocity_enu_m_s, np.float64)])
        if own.shape != (4,) or not (np.isfinite(own).all() and math.isfinite(heading_rad) and math.isfinite(t_s)):
            raise ParameterError(
                f"At {t_s} s the vehicle's place and velocity are {own.tolist()}, its heading {heading_rad}.",
                where="position_enu_m",
                advice="Leave out frames without a known pose.",
            )
        if not t_s > self._t_s:
            raise ParameterError(
                f"The frame at {t_s:.3f} s is not later than the last one at {self._t_s:.3f} s.",
                where="t_s",
                advice="Leave it out, or clear the tracker when the clock was set back.",
            )
        return own

    def _usable(self, detections: ArrayLike, heading_rad: float) -> F64:
        """(M, 3) those with a range, a bearing and no absurd speed; bearings from north."""
        given = np.asarray(detections, np.float64)
        if given.size == 0:
            return np.empty((0, 3))
        if given.ndim != 2 or given.shape[1] != 3:
            raise ParameterError(
                f"Detections of shape {given.shape}.",
                where="detections",
                advice="Give one row each: range, bearing, radial speed.",
            )
        range_m, bearing_rad, speed_m_s = given.T
        good = (range_m > 0.0) & (range_m < FARTHEST_M) & np.isfinite(bearing_rad)
        good &= np.isnan(speed_m_s) | (np.abs(speed_m_s) < FASTEST_M_S)
        found = given[good]
        found[:, 1] = np.remainder(found[:, 1] + heading_rad + math.pi, FULL_TURN) - math.pi
        return found

    def _predict(self, t_s: float, own: F64) -> None:
        dt_s = t_s - self._t_s
        if dt_s > self.params.longest_gap_s:
            self._keep(np.empty(0, np.int64))
        if self.params.coordinates == "polar":
            polar.predict(self._x, self._P, dt_s, self.params.acceleration_m_s2, own[2:] - self._own[2:])
        else:
            cartesian.predict(self._x, self._P, dt_s, self.params.acceleration_m_s2)
        self._t_s, self._own = t_s, own

    def _expected(self, x: F64) -> tuple[F64, F64]:
        return polar.expected(x) if self.params.coordinates == "polar" else cartesian.expected(x, self._own)

    def _follow(self, found: F64, heading_rad: float) -> Bools:
        """Gives each object its detection, then each candidate one of the rest -> (M,) those that nobody took."""
        free = np.ones(len(found), np.bool_)
        self._seen[:] = False
        if not (len(found) and len(self._x)):
            return free
        z, H = self._expected(self._x)
        R = variances(z, heading_rad, self._noise)
        folded = self.params.radial_speed_folded_m_s
        apart = distances(z, self._P, H, R, found, folded, self.params.gate)
        for group in (self._confirmed.nonzero()[0], (~self._confirmed).nonzero()[0]):
            left = free.nonzero()[0]
            if not (len(group) and len(left)):
                continue
            chosen, taken = assign(apart[group[:, None], left], gate=self.params.gate, miss_cost=self.params.miss_cost)
            which, by = group[chosen], left[taken]
            update(self._x, self._P, z, H, R, found, which, by, folded)
            self._seen[which] = True
            self._updates[which] += 1
            free[by] = False
        return free

    def _judge(self, heading_rad: float) -> None:
        """Births and deaths, by covariance."""
        if not len(self._x):
            return
        z, H = self._expected(self._x)
        spread = spreads(self._P, H, variances(z, heading_rad, self._noise))
        self._confirmed |= (spread < self.params.birth) & (self._updates >= self.params.birth_updates)
        self._keep((spread <= self.params.death).nonzero()[0])

    def _keep(self, kept: I64) -> None:
        if len(kept) == len(self._x):
            return
        self._x, self._P = self._x[kept], self._P[kept]
        self._id, self._updates, self._born_s = self._id[kept], self._updates[kept], self._born_s[kept]
        self._seen, self._confirmed = self._seen[kept], self._confirmed[kept]

    def _begin(self, found: F64, heading_rad: float) -> None:
        """Candidates from detections that are nobody's, the nearest ones if there are too many."""
        found = self._unfolded(found[self._stands_alone(found)])
        room = self.params.most - len(self._x)
        if len(found) > room:
            found = found[np.argsort(found[:, 0], kind="stable")[:room]]
        n = len(found)
        if n == 0:
            return
        R = variances(found, heading_rad, self._noise)
        start = polar.begin if self.params.coordinates == "polar" else cartesian.begin
        x, P = start(found, R, self._own, self.params.speed_m_s)
        self._x, self._P = np.concatenate([self._x, x]), np.concatenate([self._P, P])
        self._id = np.concatenate([self._id, np.arange(self._last_id + 1, self._last_id + 1 + n)])
        self._last_id += n
        self._updates = np.concatenate([self._updates, np.ones(n, np.int64)])
        self._born_s = np.concatenate([self._born_s, np.full(n, self._t_s)])
        self._seen = np.concatenate([self._seen, np.ones(n, np.bool_)])
        self._confirmed = np.concatenate([self._confirmed, np.zeros(n, np.bool_)])

    def _stands_alone(self, found: F64) -> Bools:
        """(M,) Whether a detection is not just another part of an object that was seen in this frame."""
        objects = self._x[self._confirmed & self._seen]
        if not (len(found) and len(objects)):
            return np.ones(len(found), np.bool_)
        z = self._expected(objects)[0]
        e = found[:, 0] * np.sin(found[:, 1]) - (z[:, 0] * np.sin(z[:, 1]))[:, None]
        n = found[:, 0] * np.cos(found[:, 1]) - (z[:, 0] * np.cos(z[:, 1]))[:, None]
        return np.asarray(np.hypot(e, n).min(axis=0) > self.params.apart_m)

    def _unfolded(self, found: F64) -> F64:
        """Radial speeds as near to those of things that stand still as the folding leaves open; and, as rows of their
        own, others that something fast may have: the next frames show which was right."""
        folded = self.params.radial_speed_folded_m_s
        if not math.isfinite(folded):
            return found
        still = -(self._own[2] * np.sin(found[:, 1]) + self._own[3] * np.cos(found[:, 1]))
        slow = np.remainder(found[:, 2] - still + folded / 2, folded) - folded / 2
        moves = np.abs(slow) > STANDS_SIGMAS * self.params.radial_speed_sigma_m_s
        rows = []
        for over_ground in (slow, slow - folded, slow + folded):
            row = np.column_stack([found[:, :2], still + over_ground])
            believed = moves & (np.abs(over_ground) <= BELIEVED_SIGMAS * self.params.speed_m_s)
            rows.append(row if over_ground is slow else row[believed])
        return np.concatenate(rows)

    def _states(self) -> list[TrackState]:
        x, P = self._x.copy(), self._P.copy()
        if self.params.coordinates == "polar":
            x, P = polar.to_enu(x, P, self._own)
        order = np.argsort(np.hypot(x[:, 0] - self._own[0], x[:, 1] - self._own[1]), kind="stable")
        ages, updates = (self._t_s - self._born_s).tolist(), self._updates.tolist()
        ids, seen, confirmed = self._id.tolist(), self._seen.tolist(), self._confirmed.tolist()
        return [
            TrackState(ids[i], x[i, :2], x[i, 2:], P[i], ages[i], updates[i], seen[i], confirmed[i])
            for i in order.tolist()
        ]


def assign(distances: F64, *, gate: float, miss_cost: float) -> tuple[I64, I64]:
    """Squared distances (N objects, M detections) -> which objects, and each one's detection; the rest go without.

    Eq. 4 puts beside the costs a square one with the price of a miss on its diagonal. An object and a detection that
    cost more than the miss are never matched; so costs less that price, no more than 0, have the same answer in the
    N x M matrix alone: a pair that comes to 0 is a miss.
    """
    likely = distances < min(gate, 2.0 * miss_cost)
    rows, columns = np.flatnonzero(likely.any(axis=1)), np.flatnonzero(likely.any(axis=0))
    if not len(rows):
        return rows, columns
    near = distances[rows[:, None], columns]
    gain = np.where(near < gate, np.minimum(0.5 * near - miss_cost, 0.0), 0.0)  # Wessendorp 2021, eq. 6
    chosen, taken = linear_sum_assignment(gain)  # Wessendorp 2021, eq. 4
    real = gain[chosen, taken] < 0.0
    return rows[chosen[real]], columns[taken[real]]
