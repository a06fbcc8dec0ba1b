"""Where the vehicle and its home are, as it told last: targets above home become places by it."""

from __future__ import annotations

import math

from telemetry.flight.guided.orders import Place
from telemetry.flight.guided.script_targets import bearing_rad
from telemetry.topics.messages import GuidedTarget
from telemetry.topics.vehicle import VehicleState


class Whereabouts:
    def __init__(self, state: VehicleState) -> None:
        self.home_alt_amsl_m = math.nan
        """Where heights above home begin; NaN: not known yet. What was known once stays known."""
        self.came_from: Place | None = None
        """The place that was reached last; nowhere after a take-off or a pause."""
        self.note(state)

    def note(self, state: VehicleState) -> None:
        self._state = state
        if state.alt_amsl_m is not None and state.alt_rel_home_m is not None:
            self.home_alt_amsl_m = state.alt_amsl_m - state.alt_rel_home_m

    def here(self, unknown: GuidedTarget) -> Place:
        """Where the vehicle is; it has come that way, so it is clear. ``unknown``: where it counts as being then."""
        at = self._state
        if at.lat_deg is None or at.lon_deg is None or at.alt_rel_home_m is None:
            return Place(unknown.lat_deg, unknown.lon_deg, unknown.alt_rel_home_m, self.home_alt_amsl_m)
        return Place(at.lat_deg, at.lon_deg, at.alt_rel_home_m, self.home_alt_amsl_m)

    def start(self, target: GuidedTarget) -> Place:
        """Of the leg to this target."""
        return self.came_from or self.here(target)

    def place(self, target: GuidedTarget, *, along_leg: bool) -> Place:
        """``along_leg``: a target that asks for no heading is flown to nose ahead: what looks ahead looks there."""
        heading_rad = target.heading_rad
        if heading_rad is None and along_leg:
            start = self.start(target)
            heading_rad = bearing_rad((start.lat_deg, start.lon_deg), (target.lat_deg, target.lon_deg))
        return Place(target.lat_deg, target.lon_deg, target.alt_rel_home_m, self.home_alt_amsl_m, heading_rad)
