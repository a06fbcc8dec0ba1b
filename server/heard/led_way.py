"""A guided way that is being flown: how far along it the vehicle is, and what is left of it."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import offset_m
from server.heard.plan_follower import OFF_LINE_M, Ahead
from telemetry.topics.vehicle import VehicleState

LOOK_M = 30.0
"""So far along the way it may have come since the last look: a way that crosses itself is not cut short."""


class LedWay:
    """Belongs to the event loop."""

    def __init__(self, places: tuple[tuple[float, float, float], ...], t_s: F64) -> None:
        """``places``: (K,) lat_deg, lon_deg, alt_rel_home_m; ``t_s``: (K,) seconds until it is there, never falling."""
        self._places, self._t_s = np.array(places), np.asarray(t_s, dtype=float)
        self._leg, self._share = 0, 0.0

    def slowed(self, factor: float) -> None:
        """It is flown at another speed: what is left takes so many times as long."""
        self._t_s = factor * self._t_s

    def ahead(self, state: VehicleState) -> Ahead | None:
        """None where its place is not known, or it is beside the way."""
        if state.lat_deg is None or state.lon_deg is None or state.alt_rel_home_m is None:
            return None
        lat_deg, lon_deg, alt_m = self._places.T
        east_m, north_m = offset_m((state.lat_deg, state.lon_deg), lat_deg, lon_deg)
        points_m = np.column_stack([east_m, north_m, alt_m - state.alt_rel_home_m])
        if not self._goes_on(points_m):
            return None
        rest = slice(self._leg + 1, None)
        here_s = np.interp(self._leg + self._share, np.arange(len(self._t_s)), self._t_s)
        return Ahead(self._places[rest, :2], alt_m[rest], np.maximum(self._t_s[rest] - here_s, 0.0))

    def _goes_on(self, points_m: F64) -> bool:
        """Moves on to the nearest place that it may have come to; false where it is beside all of them."""
        legs_m = np.diff(points_m, axis=0)
        length_m = np.linalg.norm(legs_m, axis=1)
        begins_m = np.concatenate([[0.0], np.cumsum(length_m)[:-1]])
        gone_m = begins_m[self._leg] + self._share * length_m[self._leg]
        least = np.where(np.arange(len(legs_m)) == self._leg, self._share, 0.0)
        along = np.einsum("ij,ij->i", -points_m[:-1], legs_m) / np.maximum(length_m**2, 1e-9)
        share = np.clip(along, least, 1.0)
        off_m = np.linalg.norm(points_m[:-1] + share[:, None] * legs_m, axis=1)
        may_be = (np.arange(len(legs_m)) >= self._leg) & (begins_m <= gone_m + LOOK_M)
        leg = int(np.argmin(np.where(may_be, off_m, np.inf)))
        if off_m[leg] > OFF_LINE_M:
            return False
        self._leg, self._share = leg, float(share[leg])
        return True
