"""A guided way that is ordered or flown: how far along it the vehicle is, and what is left of it."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from server.heard.plan_follower import OFF_LINE_M, Ahead
from telemetry.topics.vehicle import VehicleState

Places = tuple[tuple[float, float, float], ...]
"""(K,) lat_deg, lon_deg, alt_rel_home_m"""
SOONER_SHARE, LATE_S = 0.1, 10.0
LATER_SHARE, TURNING_LATER_SHARE = 2.0, 6.0
"""Of the times that a way's lengths and speeds give: it comes to a place no sooner than so much less, and no later than
so much more; ``LATE_S`` besides. Gathering speed, stopping and what is kept back for a link that falls silent make a
straight way late, by up to 60 %; turns are far slower than that: orbits of 10 m to 20 m and zigzags take three to six
times as long as they are led (``telemetry.flight.guided``)."""
STRAIGHT_PLACES = 5
"""Of a way that climbs, goes there and comes down; one of more places turns."""
LOOK_M = 10.0
"""So far along the way it may have come since the last look, beside what it flies in that time."""
ON_IT_M = 1.0
"""Of several legs that are as near as that the first one is it."""


def later_share(places: int) -> float:
    """Of a whole way of so many places."""
    return LATER_SHARE if places <= STRAIGHT_PLACES else TURNING_LATER_SHARE


def led_ahead(places: F64, t_s: F64, later: float, off_m: float = 0.0) -> Ahead:
    """``places``: (N, 3) as ``Places``; ``t_s``: (N,) from now, as lengths and speeds give them; ``later``: the whole
    way's ``later_share``. Told are the middle of when it may be there, and how far from that."""
    middle, half = 1.0 + (later - SOONER_SHARE) / 2.0, (later + SOONER_SHARE) / 2.0
    return Ahead(
        places[:, :2],
        places[:, 2],
        middle * t_s,
        early_late_s=LATE_S,
        early_late_share=half / middle,
        off_m=off_m,
    )


def latest_s(t_s: float, later: float) -> float:
    """When it is there at the latest."""
    return (1.0 + later) * t_s + LATE_S


class LedWay:
    """Belongs to the event loop."""

    def __init__(self, places: Places, t_s: F64, speed_m_s: float, since_utc_s: float) -> None:
        """``t_s``: (K,) seconds until it is there, never falling; ``speed_m_s``: over ground, that they count on;
        ``since_utc_s``: when it was ordered."""
        self.since_utc_s, self.is_new = since_utc_s, True
        """``is_new``: nothing was told of its flight yet."""
        self._places = np.array(places, dtype=float)
        here_deg = places[0][:2]
        east_m, north_m = offset_m(here_deg, self._places[:, 0], self._places[:, 1])
        self._flat_m, self._legs_s = np.hypot(np.diff(east_m), np.diff(north_m)), np.diff(np.asarray(t_s, dtype=float))
        # What takes longer than its ground does is climbed or descended: at a rate of its own.
        self._upright_s = np.where(self._legs_s > (1.0 + 1e-6) * self._flat_m / speed_m_s, self._legs_s, 0.0)
        self._leg, self._share, self._found_s = 0, 0.0, None

    def at_speed(self, speed_m_s: float) -> None:
        """What is left of it is flown at another speed over ground."""
        self._legs_s = np.maximum(self._flat_m / speed_m_s, self._upright_s)

    def ahead(self, state: VehicleState) -> Ahead | None:
        """None where its place is not known, or it is beside the way."""
        if state.lat_deg is None or state.lon_deg is None or state.alt_rel_home_m is None:
            return None
        east_m, north_m = offset_m((state.lat_deg, state.lon_deg), self._places[:, 0], self._places[:, 1])
        points_m = np.column_stack([east_m, north_m, self._places[:, 2] - state.alt_rel_home_m])
        off_m = self._find(points_m, state.position_t_mono_s)
        if off_m > OFF_LINE_M:
            return None
        t_s = np.concatenate([[0.0], np.cumsum(self._legs_s)])
        here_s = t_s[self._leg] + self._share * self._legs_s[self._leg]
        rest, later = slice(self._leg + 1, None), later_share(len(self._places))
        return led_ahead(self._places[rest], t_s[rest] - here_s, later, off_m)

    def _find(self, points_m: F64, t_s: float | None) -> float:
        """Moves on to the place that it may have come to, and tells how far beside it the vehicle is."""
        legs_m = np.diff(points_m, axis=0)
        length_m, legs = np.linalg.norm(legs_m, axis=1), np.arange(len(legs_m))
        begins_m = np.concatenate([[0.0], np.cumsum(length_m)[:-1]])
        gone_m = begins_m[self._leg] + self._share * length_m[self._leg]
        along = np.einsum("ij,ij->i", -points_m[:-1], legs_m) / np.maximum(length_m**2, 1e-9)
        share = np.clip(along, np.where(legs == self._leg, self._share, 0.0), 1.0)
        off_m = np.linalg.norm(points_m[:-1] + share[:, None] * legs_m, axis=1)
        may_be = (legs >= self._leg) & (begins_m + share * length_m <= gone_m + self._may_have_come_m(length_m, t_s))
        may_be[self._leg] = True
        least_m = float(off_m[may_be].min())
        leg = int(np.argmax(may_be & (off_m <= least_m + ON_IT_M)))
        if least_m <= OFF_LINE_M:
            self._leg, self._share, self._found_s = leg, float(share[leg]), t_s
        return least_m

    def _may_have_come_m(self, length_m: F64, t_s: float | None) -> float:
        since_s = 1.0 if t_s is None or self._found_s is None else max(0.0, t_s - self._found_s)
        fastest_m_s = float(np.max(length_m / np.maximum(self._legs_s, 1e-9), initial=0.0))
        return LOOK_M + 1.5 * fastest_m_s * since_s
