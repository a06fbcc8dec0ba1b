"""The sensors that saw what is avoided: it is clear when they say so, and without them nothing is known of it."""

from __future__ import annotations

from telemetry.flight.avoiding_words import SENSOR_WORDS
from telemetry.flight.regions import OLD_S, Regions, Sight
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
        advice = "It climbs on by itself once something comes. Or return home."
        missing = "" if sight is None else f"Nothing new from {SENSOR_WORDS[sight.sensor]}. {advice}"
        return _old_position(state, now_s) or missing

    def silent(self, state: VehicleState, now_s: float) -> str:
        """The same where a camera may see nothing, as in the open sky, but must look."""
        sight = self._regions.silent(self.sensors, now_s)
        return _old_position(state, now_s) or ("" if sight is None else _silence(sight, now_s))


def _silence(sight: Sight, now_s: float) -> str:
    """Its own words where it still speaks."""
    if sight.why and now_s - sight.t_mono_s <= OLD_S:
        return f"{sight.why} Resume goes on all the same."
    return f"No frames from {SENSOR_WORDS[sight.sensor]}. Resume goes on without them."


def _old_position(state: VehicleState, now_s: float) -> str:
    at_s = state.position_t_mono_s
    is_old = at_s is None or now_s - at_s > OLD_S
    advice = "It goes on by itself with a new one. Or return home."
    return f"The vehicle's position is too old. {advice}" if is_old else ""
