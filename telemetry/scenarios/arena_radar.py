"""A Position2Go as the paper describes it, before two poles: detections with its errors, gaps and false alarms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.tracker import TrackerParams

F64 = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Position2Go:
    """Wessendorp 2021, III-D. What it prints as accuracies is taken as one sigma, the harder reading."""

    half_fov_rad: float = math.radians(38.0)
    """76 degrees; beyond its half-power beam nothing is seen. Poles reach through all of its 19 degrees of height."""
    nearest_m: float = 1.0
    farthest_m: float = 12.0
    every_s: float = 1 / 15
    range_sigma_m: float = 0.15
    bearing_sigma_rad: float = math.radians(2.0)
    bearing_edge_rad: float = math.radians(20.0)
    bearing_edge_sigma_rad: float = math.radians(8.0)
    radial_speed_sigma_m_s: float = 0.25
    """Of cells of 0.78 m/s: 16 chirps in 8 ms."""
    range_bin_m: float = 0.75
    most_per_bin: int = 2
    """Two receivers tell no more apart."""
    detection_probability: float = 0.9
    false_alarms: float = 0.3
    """Per frame."""

    def tracker(self) -> TrackerParams:
        """As it must be told of this radar, and of a hall."""
        return TrackerParams(
            range_sigma_m=self.range_sigma_m,
            bearing_sigma_rad=self.bearing_sigma_rad,
            bearing_edge_rad=self.bearing_edge_rad,
            bearing_edge_sigma_rad=self.bearing_edge_sigma_rad,
            radial_speed_sigma_m_s=self.radial_speed_sigma_m_s,
            extent_m=0.1,
            acceleration_m_s2=1.0,
            speed_m_s=1.0,
        )

    def sees(self, range_m: F64, bearing_rad: F64) -> NDArray[np.bool_]:
        return (np.abs(bearing_rad) <= self.half_fov_rad) & (range_m >= self.nearest_m) & (range_m <= self.farthest_m)

    def frame(self, true: F64, random: np.random.Generator) -> F64:
        """(M, 3) detections of objects at ``true`` (N, 3): range, bearing from the nose, radial speed."""
        inside = self.sees(true[:, 0], true[:, 1]) & (random.random(len(true)) < self.detection_probability)
        edge = np.abs(true[:, 1]) > self.bearing_edge_rad
        sigma = np.column_stack(
            [
                np.full(len(true), self.range_sigma_m),
                np.where(edge, self.bearing_edge_sigma_rad, self.bearing_sigma_rad),
                np.full(len(true), self.radial_speed_sigma_m_s),
            ]
        )
        echoes = (true + random.normal(size=true.shape) * sigma)[inside]
        return self._told_apart(np.concatenate([echoes, self._false(random)]))

    def _told_apart(self, echoes: F64) -> F64:
        """Of each range bin the first ones: objects come before false alarms."""
        bins = np.floor(echoes[:, 0] / self.range_bin_m)
        kept = [k for k in range(len(echoes)) if np.sum(bins[:k] == bins[k]) < self.most_per_bin]
        return echoes[kept]

    def _false(self, random: np.random.Generator) -> F64:
        n = random.poisson(self.false_alarms)
        return np.column_stack(
            [
                random.uniform(self.nearest_m, self.farthest_m, n),
                random.uniform(-self.half_fov_rad, self.half_fov_rad, n),
                random.uniform(-3.0, 3.0, n),
            ]
        )
