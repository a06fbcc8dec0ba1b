"""What was seen of a flight from outside, and what its maps came to."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.poses import Pose
from mapping.sensor_frames import RadarFrame
from telemetry.perception.perceiver import Perceiver
from telemetry.perception.status import Outcome
from telemetry.simulation.scenarios.stage.result import AlertSeen, FlightResult
from telemetry.topics.obstacles import ObstacleAlert, Sensor
from telemetry.topics.vehicle import SimTruth


class RegionWatch:
    """When a map first holds something in the region ahead, found apart from the search that is being tested.

    Looks at one sensor's map from where the vehicle believes to be, many times a frame.
    """

    def __init__(self, perceiver: Perceiver) -> None:
        self._perceiver = perceiver
        self._seen: tuple[object, int] = (None, -1)
        self._believed: F64 = np.empty((0, 3))
        self.first_s: float | None = None
        """When a believed, occupied voxel first lay in the region."""
        self._alerted_s = math.inf
        self._told_s = math.inf

    @property
    def delay_s(self) -> float | None:
        """From the first voxel until there was an alert and the region was said to be occupied; None without a voxel.

        An alert may well be earlier: the corridor along the mission reaches farther than the region.
        """
        if self.first_s is None:
            return None
        return max(0.0, max(self._alerted_s, self._told_s) - self.first_s)

    def take(self, outcome: Outcome, now_s: float) -> None:
        """What perception has told."""
        if any(alert.kind == "obstacle" and alert.phase == "begins" for alert in outcome.alerts):
            self._alerted_s = min(self._alerted_s, now_s)
        if outcome.status.region is not None and outcome.status.region.occupied:
            self._told_s = min(self._told_s, now_s)

    def look(self, p_map: F64, heading_rad: float, now_s: float) -> None:
        """``p_map``: the vehicle in the map's frame, as it believes."""
        if self.first_s is not None:
            return
        the_map = self._perceiver.perception.map
        if self._seen != (the_map, the_map.revision):
            self._seen = the_map, the_map.revision
            self._believed = the_map.occupied(explained=None if self._perceiver.settings.paper_bare else False)
        if self._any_inside(p_map + self._perceiver.perception.offset_enu_m, heading_rad):
            self.first_s = now_s

    def _any_inside(self, p: F64, heading_rad: float) -> bool:
        """Geometry instead of eq. A1: centres in the cylindrical sector."""
        settings = self._perceiver.perception.settings
        away = self._believed - p
        near = np.hypot(away[:, 0], away[:, 1])
        off = np.arctan2(away[:, 0], away[:, 1]) - heading_rad
        off = np.abs((off + np.pi) % (2 * np.pi) - np.pi)
        inside = (near <= settings.depth_m) & (off <= settings.fov_rad / 2)
        return bool((inside & (np.abs(away[:, 2]) <= settings.height_m / 2)).any())


@dataclass(frozen=True, slots=True)
class SeenRadarFrame:
    frame: RadarFrame
    truth: SimTruth
    """When the frame was measured."""
    pose: Pose
    """As perception knew it."""


@dataclass(frozen=True, slots=True)
class SeenAlert:
    """An alert, and where its obstacle is in the world's frame."""

    alert: ObstacleAlert
    place_enu_m: F64 | None
    """The drift of the camera's own path, which perception knows, is taken off: the obstacle as the vehicle sees it."""


@dataclass(slots=True)
class SeenFlight:
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
    told: list[SeenAlert] = field(default_factory=list)
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

    def result(self, title: str, **found: Any) -> FlightResult:
        """``found``: the other fields of the result."""
        return FlightResult(title, self.duration_s, self.contact, self.nearest_m, self.alerts_seen(), **found)

    def alerts_seen(self) -> tuple[AlertSeen, ...]:
        """The begin of each that is about an obstacle."""
        return tuple(
            AlertSeen(
                alert.done_t_mono_s - self.began_s, alert.sensor, alert.obstacle.distance_m if alert.obstacle else None
            )
            for alert in (told.alert for told in self.told)
            if alert.phase == "begins" and alert.kind == "obstacle"
        )
