"""Back on the way that the vehicle came, which is free: it flew there a moment ago."""

from __future__ import annotations

import math
from collections import deque

from mapping.geometry.frames import apart_m
from telemetry.flight.guided.handover import away_m
from telemetry.flight.guided.helm import Helm, here_of
from telemetry.flight.guided.orders import Place
from telemetry.mavlink.actions import Action
from telemetry.topics.vehicle import VehicleState

SPACED_M, KEPT = 0.25, 200
SPEED_M_S = 1.0
THERE_M = 0.3
PATIENCE_S = 30.0


class Trail:
    """Where the vehicle was, the newest last."""

    def __init__(self) -> None:
        self._places: deque[Place] = deque(maxlen=KEPT)

    def on_state(self, state: VehicleState) -> None:
        if state.lat_deg is None or state.lon_deg is None or state.alt_rel_home_m is None:
            return
        if not self._places or away_m(state, self._places[-1]) >= SPACED_M:
            self._places.append(here_of(state))

    def back(self, state: VehicleState, distance_m: float) -> list[Place]:
        """Places on the way back to the first so far away; all there are where none is."""
        out: list[Place] = []
        for place in reversed(self._places):
            out.append(place)
            if _apart_m(here_of(state), place) >= distance_m:
                break
        return out


class Backing:
    """To the place that is ``distance_m`` away, slowly, with the nose where it is."""

    def __init__(self, helm: Helm, trail: Trail, state: VehicleState, distance_m: float) -> None:
        self._helm, self._heading_rad = helm, state.heading_rad
        self._way = trail.back(state, distance_m)
        self._since_s = math.inf

    def go(self, now_s: float) -> list[Action]:
        self._since_s = now_s
        if not self._way:
            return []
        end = self._way[-1]
        place = Place(end.lat_deg, end.lon_deg, end.alt_rel_home_m, end.home_alt_amsl_m, self._heading_rad)
        speed = self._helm.set_speed(SPEED_M_S, now_s)
        return [*speed, *self._helm.go_to(place, now_s, radius_m=THERE_M, holds=True)]

    def is_over(self, state: VehicleState, now_s: float) -> bool:
        stands = (state.ground_speed_m_s or 0.0) <= THERE_M and self._helm.has_arrived(state, now_s)
        return not self._way or stands or now_s - self._since_s > PATIENCE_S


def _apart_m(a: Place, b: Place) -> float:
    """As seen from above."""
    return apart_m((a.lat_deg, a.lon_deg), (b.lat_deg, b.lon_deg))
