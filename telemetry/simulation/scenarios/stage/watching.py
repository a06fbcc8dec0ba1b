"""When a map first holds something in the region ahead, found apart from the search that is being tested."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.perception.perceiver import Perceiver
from telemetry.perception.status import Outcome


class RegionWatch:
    """Looks at one sensor's map from where the vehicle believes to be, many times a frame."""

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
