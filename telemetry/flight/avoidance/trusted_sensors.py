"""The sensors that saw what is avoided: it is clear when they say so, and without them nothing is known of it."""

from __future__ import annotations

import math

from telemetry.flight.avoidance.regions import OLD_S, SENSOR_WORDS, Regions, Sight
from telemetry.topics.obstacles import Sensor
from telemetry.topics.vehicle import VehicleState

SEEN_FROM_M = 1.5
"""Beyond what is too near to be seen: voxels are a metre wide, and the vehicle drifts."""


class TrustedSensors:
    def __init__(self, regions: Regions) -> None:
        self._regions = regions
        self.sensors: frozenset[Sensor] = frozenset()

    def join(self, now_s: float) -> None:
        """Whoever sees something now is counted on, too; not who is late and would keep it from ever being clear."""
        seen = self._regions.occupied(now_s)
        fresh: frozenset[Sensor] = frozenset(sight.sensor for sight in seen if sight.is_fresh(now_s))
        self.sensors |= fresh

    def say_clear(self, now_s: float) -> bool:
        return self._regions.is_clear(self.sensors, now_s)

    def hidden(self, now_s: float) -> str:
        """Why it cannot be told whether it is clear although frames come; empty while it can."""
        sight = self._regions.hidden(self.sensors, now_s)
        if sight is None:
            return ""
        who = SENSOR_WORDS[sight.sensor].capitalize()
        if sight.forgot:
            return f"{who}: its map began anew, what stood in the way is not in it any more. Return home or take over."
        return (
            f"{who}: it is {sight.hidden_m or 0.0:.1f} m away and cannot be seen from here, so nobody knows whether the"
            " way is clear. Return home or take over."
        )

    def back_m(self, now_s: float) -> float:
        """How far back everything that is in the way can be seen."""
        nearest_m = self._regions.nearest_m(self.sensors, now_s)
        if not math.isfinite(nearest_m):
            return 0.0
        return max(0.0, self._regions.blind_m(self.sensors, now_s) + SEEN_FROM_M - nearest_m)

    def blind(self, state: VehicleState, now_s: float) -> str:
        """Why nothing can be told about what is ahead now; empty while all is well."""
        sight, missing = self._regions.oldest(self.sensors, now_s), ""
        if sight is not None:
            missing = f"Nothing new from {SENSOR_WORDS[sight.sensor]}. It climbs on by itself once something comes."
        elif not self.sensors and not self._regions.counted(now_s):
            sight = next(iter(self._regions.eyes(now_s)), None)
            missing = "No sensor sees ahead. It climbs on by itself once something comes."
        if sight is not None and (late := _late(sight, now_s)):
            missing = f"{late} It climbs on by itself once they come in time."
        return _old_position(state, now_s) or (missing and f"{missing} Or return home.")

    def silent(self, state: VehicleState, now_s: float) -> str:
        """The same where a camera may see nothing, as in the open sky, but must look."""
        sight = self._regions.silent(self.sensors, now_s)
        return _old_position(state, now_s) or ("" if sight is None else _silence(sight, now_s))


def _silence(sight: Sight, now_s: float) -> str:
    """Its own words where it still speaks."""
    if sight.why and now_s - sight.t_mono_s <= OLD_S:
        return f"{sight.why} Resume goes on all the same."
    missing = _late(sight, now_s) or f"No frames from {SENSOR_WORDS[sight.sensor]}."
    return f"{missing} Resume goes on without them."


def _late(sight: Sight, now_s: float) -> str:
    is_late = sight.is_late and sight.is_eye(now_s)
    return f"Frames from {SENSOR_WORDS[sight.sensor]} come over {OLD_S:g} s late." if is_late else ""


def _old_position(state: VehicleState, now_s: float) -> str:
    at_s = state.position_t_mono_s
    is_old = at_s is None or now_s - at_s > OLD_S
    advice = "It goes on by itself with a new one. Or return home."
    return f"The vehicle's position is too old. {advice}" if is_old else ""
