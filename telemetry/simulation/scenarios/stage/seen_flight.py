"""What was seen of a flight from outside, and what its maps came to."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.poses import Pose
from mapping.sensor_frames import RadarFrame
from telemetry.perception.perceiver import Perceiver
from telemetry.simulation.scenarios.stage.result import AlertSeen
from telemetry.simulation.scenarios.stage.watching import RegionWatch
from telemetry.topics.obstacles import ObstacleAlert, Sensor
from telemetry.topics.vehicle import SimTruth


@dataclass(frozen=True, slots=True)
class SeenRadarFrame:
    frame: RadarFrame
    truth: SimTruth
    """When the frame was measured."""
    pose: Pose
    """As perception knew it."""


@dataclass(frozen=True, slots=True)
class Told:
    """An alert, and where its obstacle is in the world's frame."""

    alert: ObstacleAlert
    place_enu_m: F64 | None
    """The drift of the camera's own path, which perception knows, is taken off: the obstacle as the vehicle sees it."""


@dataclass(slots=True)
class Flown:
    """Times are those of the virtual monotonic clock."""

    began_s: float
    vehicle_radius_m: float
    ended_s: float = 0.0
    landed: bool = False
    track: list[SimTruth] = field(default_factory=list)
    """Ten a second, from arming to disarming."""
    way_m: float = 0.0
    """Flown, level."""
    nearest_m: float = math.inf
    """Between the vehicle's centre and the nearest object."""
    hit: str | None = None
    told: list[Told] = field(default_factory=list)
    radar: list[SeenRadarFrame] = field(default_factory=list)
    vision: list[F64] = field(default_factory=list)
    """Believed voxels of each local map, in the world's frame."""
    said: list[tuple[float, str]] = field(default_factory=list)
    """Each new state of a sensor or of the avoidance, in words."""
    perceivers: dict[Sensor, Perceiver] = field(default_factory=dict)
    watches: dict[Sensor, RegionWatch] = field(default_factory=dict)
    map_to_world: F64 = field(default_factory=lambda: np.zeros(3))
    """To be added to the map's places: home as the vehicle believed it when it armed."""
    new_while_frozen: int = 0
    """Changes of the radar's map while it said that it stands still."""

    @property
    def duration_s(self) -> float:
        return self.ended_s - self.began_s

    @property
    def armed_s(self) -> float:
        """For how long it has been armed, or was."""
        return self.track[-1].t_mono_s - self.track[0].t_mono_s if self.track else 0.0

    @property
    def contact(self) -> bool:
        """It crashed, or came nearer to an object than its own radius."""
        return self.hit is not None or self.nearest_m <= self.vehicle_radius_m

    def voxels(self, sensor: Sensor) -> F64:
        """(N, 3) centres of what the sensor's map believes to be obstacles now, in the world's frame."""
        if sensor not in self.perceivers:
            return np.empty((0, 3))
        return self.perceivers[sensor].perception.map.occupied(explained=False) + self.map_to_world

    def has_said(self, words: str) -> bool:
        return any(said.startswith(words) for _, said in self.said)

    def alerts_seen(self) -> tuple[AlertSeen, ...]:
        """The begin of each that is about an obstacle."""
        return tuple(
            AlertSeen(
                alert.done_t_mono_s - self.began_s, alert.sensor, alert.obstacle.distance_m if alert.obstacle else None
            )
            for alert in (told.alert for told in self.told)
            if alert.phase == "begins" and alert.kind == "obstacle"
        )
