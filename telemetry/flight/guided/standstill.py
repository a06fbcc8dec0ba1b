"""A vehicle that was sent somewhere and comes no nearer: since when, and why that may be."""

from __future__ import annotations

from telemetry.flight.guided.handover import away_m
from telemetry.flight.guided.orders import Place
from telemetry.topics.vehicle import VehicleState

PATIENCE_S = 10.0
NEARER_M = 0.5
"""Less may be the vehicle's swaying."""
LEVEL_M = 0.5


class Standstill:
    """Of one vehicle on its way to one place after the other."""

    def __init__(self) -> None:
        self._place: Place | None = None
        self._nearest_m, self._since_s = 0.0, 0.0

    def words(self, state: VehicleState, place: Place, name: str, now_s: float) -> str:
        """What is to be said; empty while it comes nearer. ``name``: of the place."""
        left_m = away_m(state, place)
        if self._place != place or left_m < self._nearest_m - NEARER_M:
            self._place, self._nearest_m, self._since_s = place, left_m, now_s
        seconds = now_s - self._since_s
        if seconds < PATIENCE_S:
            return ""
        return f"The vehicle has come no nearer to {name} for {seconds:.0f} s. {_why(state, place)}"


def _why(state: VehicleState, place: Place) -> str:
    if state.alt_rel_home_m is None:
        return "Its height is not known."
    up_m = place.alt_rel_home_m - state.alt_rel_home_m
    if state.landed == "on_ground":
        below = " The way leads below its home, and it does not know what lies there." if up_m < -LEVEL_M else ""
        return f"It stands on the ground.{below} Take it over by remote control, or command the return."
    if abs(up_m) > LEVEL_M:
        side = "below" if up_m > 0 else "above"
        return f"It hovers {abs(up_m):.1f} m {side} it: something keeps it from going there, or its home has moved."
    return "Strong wind, a fence, or its own avoidance may hold it. Command the return if it does not go on."
