"""Targets handed over one at a time in flight: the next when the last is reached and its loiter time has passed."""

from __future__ import annotations

import math
from dataclasses import replace

from telemetry.flight.guided.handover import is_fresh
from telemetry.flight.guided.helm import Helm, here_of
from telemetry.flight.guided.orders import Place
from telemetry.flight.guided.script_targets import bearing_rad
from telemetry.mavlink.actions import Action
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.vehicle import VehicleState

RADIUS_M = 0.7
"""Corners are cut by less than this."""
TURNED_RAD, TURN_S = math.radians(20.0), 8.0
"""The nose points where it will fly; and how long that is waited for."""


class Legs:
    """``go`` hands over the present target; ``on_look`` goes on to the next ones and says when all are flown.

    ``turns_first``: the nose turns before it goes anywhere, for who looks ahead has not looked there yet.
    """

    def __init__(self, helm: Helm, targets: tuple[GuidedTarget, ...], *, turns_first: bool = False) -> None:
        self._helm, self.targets, self._turns_first = helm, targets, turns_first
        self._index = 0
        self._reached_s: float | None = None
        self._turning: tuple[float, float] | None = None
        """To which heading, and since when."""

    @property
    def is_over(self) -> bool:
        return self._index >= len(self.targets)

    @property
    def left(self) -> tuple[GuidedTarget, ...]:
        """From the one that is flown to."""
        return self.targets[self._index :]

    @property
    def target(self) -> GuidedTarget | None:
        """That is flown to, or was last."""
        return self.targets[min(self._index, len(self.targets) - 1)] if self.targets else None

    def go(self, state: VehicleState, now_s: float) -> list[Action]:
        self._reached_s = None
        if self.is_over:
            return []
        target = self.targets[self._index]
        place = _place(target, state)
        if self._turns_first and self._turning is None and _is_aside(state, place.heading_rad):
            assert place.heading_rad is not None
            self._turning = place.heading_rad, now_s
            return self._helm.go_to(replace(here_of(state), heading_rad=place.heading_rad), now_s, radius_m=RADIUS_M)
        self._turning = None
        there = self._helm.go_to(place, now_s, radius_m=RADIUS_M)
        return [*there, *self._helm.set_speed(target.speed_m_s, now_s)]

    def on_look(self, state: VehicleState, now_s: float) -> list[Action]:
        if self.is_over:
            return []
        if self._turning is not None:
            heading_rad, since_s = self._turning
            turns = _is_aside(state, heading_rad) and now_s - since_s < TURN_S
            return [] if turns else self.go(state, now_s)
        if self._reached_s is None and self._helm.has_arrived(state, now_s):
            self._reached_s = now_s
        waited = self._reached_s is not None and now_s - self._reached_s >= self.targets[self._index].loiter_s
        if not waited or not is_fresh(state, now_s):
            return []
        self._index += 1
        return self.go(state, now_s)


def _is_aside(state: VehicleState, heading_rad: float | None) -> bool:
    if heading_rad is None or state.heading_rad is None:
        return False
    return abs(math.remainder(heading_rad - state.heading_rad, math.tau)) > TURNED_RAD


def _place(target: GuidedTarget, state: VehicleState) -> Place:
    """The nose turns to where the vehicle goes, if nothing else is asked for: the sensors look that way."""
    heading_rad = target.heading_rad
    if heading_rad is None and state.lat_deg is not None and state.lon_deg is not None:
        ahead_rad = bearing_rad((state.lat_deg, state.lon_deg), (target.lat_deg, target.lon_deg))
        heading_rad = state.heading_rad if ahead_rad is None else ahead_rad
    home_alt_m = math.nan
    if state.alt_amsl_m is not None and state.alt_rel_home_m is not None:
        home_alt_m = state.alt_amsl_m - state.alt_rel_home_m
    return Place(target.lat_deg, target.lon_deg, target.alt_rel_home_m, home_alt_m, heading_rad)
