"""Straight up over one place, a few metres at a time, until it is clear; then level as soon as that can be."""

from __future__ import annotations

from dataclasses import replace

from telemetry.flight.guided.helm import Helm, here_of
from telemetry.flight.guided.orders import CLIMB_SPEED
from telemetry.mavlink.actions import Action
from telemetry.topics.vehicle import VehicleState

AHEAD_M, AHEAD_AGAIN_M = 6.0, 4.0
"""The climb's target is never farther above the vehicle: without a link it climbs no farther than that."""
THERE_M = 0.3
LEVEL_M, LEVEL_M_S = 0.5, 0.3
DECEL_M_S2 = 1.0
"""ArduCopter's WPNAV_ACCEL_Z."""


class Climb:
    """Where the vehicle stands now, at ``speed_m_s``, to ``least_m`` at least and to ``ceiling_m`` at most.

    Heights are above home; a ceiling below the vehicle, or below the least height, gives way.
    """

    def __init__(
        self, helm: Helm, state: VehicleState, *, speed_m_s: float, latency_s: float, least_m: float, ceiling_m: float
    ) -> None:
        self._helm, self._column = helm, here_of(state)
        self._speed_m_s, self._latency_s, self._least_m = speed_m_s, latency_s, least_m
        self._ceiling_m = max(ceiling_m, least_m, self._column.alt_rel_home_m)

    @property
    def ordered_m(self) -> float:
        """The height that the vehicle was sent to last."""
        place = self._helm.place
        return self._column.alt_rel_home_m if place is None else place.alt_rel_home_m

    def is_high_enough(self, state: VehicleState) -> bool:
        return _height_m(state) >= self._least_m - THERE_M

    def is_at_ceiling(self, state: VehicleState) -> bool:
        return _height_m(state) >= self._ceiling_m - THERE_M

    def is_level(self, state: VehicleState) -> bool:
        return abs(_height_m(state) - self.ordered_m) <= LEVEL_M and abs(state.climb_m_s or 0.0) <= LEVEL_M_S

    def set_speed(self, now_s: float) -> list[Action]:
        return self._helm.set_speed(self._speed_m_s, now_s, CLIMB_SPEED)

    def rise(self, state: VehicleState, now_s: float) -> list[Action]:
        height_m = _height_m(state)
        if self._helm.place is not None:
            again_m = min(AHEAD_AGAIN_M, self._ceiling_m - height_m)
            if self.ordered_m - height_m >= again_m:
                return []
        return self._go_to(height_m + AHEAD_M, now_s)

    def level(self, state: VehicleState, now_s: float) -> list[Action]:
        """Ends it as soon as it can end without coming down again."""
        rising_m_s = max(0.0, state.climb_m_s or 0.0)
        room_m = rising_m_s * self._latency_s + rising_m_s**2 / (2 * DECEL_M_S2)
        return self._go_to(max(_height_m(state) + room_m, self._least_m), now_s)

    def _go_to(self, alt_rel_home_m: float, now_s: float) -> list[Action]:
        place = replace(self._column, alt_rel_home_m=min(alt_rel_home_m, self._ceiling_m))
        return self._helm.go_to(place, now_s, radius_m=THERE_M, holds=True)


def _height_m(state: VehicleState) -> float:
    return state.alt_rel_home_m or 0.0
