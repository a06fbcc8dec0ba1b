"""The sensors that saw what is avoided: it is clear when they say so, and without them nothing is known of it."""

from __future__ import annotations

from telemetry.flight.regions import OLD_S, Regions
from telemetry.obstacles import Sensor
from telemetry.vehicle import VehicleState


class Witnesses:
    def __init__(self, regions: Regions) -> None:
        self._regions = regions
        self.sensors: frozenset[Sensor] = frozenset()

    def join(self, now_s: float) -> None:
        """Whoever sees something now is counted on, too."""
        self.sensors |= self._regions.seen_by(now_s)

    def say_clear(self, now_s: float) -> bool:
        return self._regions.is_clear(self.sensors, now_s)

    def blind(self, state: VehicleState, now_s: float) -> str:
        """Why nothing can be told about what is ahead now; empty while all is well."""
        sight = self._regions.oldest(self.sensors, now_s)
        return _old_position(state, now_s) or ("" if sight is None else f"Nothing new from {sight.sensor}.")

    def silent(self, state: VehicleState, now_s: float) -> str:
        """The same where a camera may see nothing, as in the open sky, but must look."""
        sight = self._regions.silent(self.sensors, now_s)
        missing = "" if sight is None else f"No frames from {sight.sensor}. Resume goes on without them."
        return _old_position(state, now_s) or missing


def _old_position(state: VehicleState, now_s: float) -> str:
    at_s = state.position_t_mono_s
    return "The vehicle's position is too old." if at_s is None or now_s - at_s > OLD_S else ""
