"""A Position2Go as the paper describes it, before two poles: detections with its errors, gaps and false alarms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.perceiving.radar_evidence import EvidenceParams
from mapping.sensor_frames import RadarFrame, rows
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.sensors.body import radar_frame
from telemetry.simulation.simulator.sensors.iq import IqRadarSensor
from telemetry.simulation.simulator.sensors.iq_model import POSITION2GO_IQ
from telemetry.topics.track_settings import TrackerSettings
from telemetry.topics.vehicle import SimTruth

POLES_M = 6.0
"""High."""

ERRORS = TrackerSettings(
    range_sigma_m=0.15,
    bearing_sigma_deg=2.0,
    bearing_edge_deg=20.0,
    bearing_edge_sigma_deg=8.0,
    radial_speed_sigma_m_s=0.25,
    radial_speed_folded_m_s=0.0,
    extent_m=0.1,
    acceleration_m_s2=1.0,
    speed_m_s=1.0,
)
"""As the paper prints them, with cells of 0.78 m/s (16 chirps in 8 ms), for poles in a hall."""


@dataclass(frozen=True, slots=True)
class Position2GoModel:
    """Wessendorp 2021, III-D. What it prints as accuracies is taken as one sigma, the harder reading."""

    half_fov_rad: float = math.radians(38.0)
    """76 degrees; beyond its half-power beam nothing is seen. Poles reach through all of its 19 degrees of height."""
    nearest_m: float = 1.0
    farthest_m: float = 12.0
    every_s: float = 1 / 15
    errors: TrackerSettings = ERRORS
    """What it measures with, and what a tracker must be told of it."""
    range_bin_m: float = 0.75
    most_per_bin: int = 2
    """Two receivers tell no more apart."""
    detection_probability: float = 0.9
    false_alarms: float = 0.3
    """Per frame."""

    def told(self, truth: SimTruth, number: int, detections: F64) -> RadarFrame:
        """As a sensor's frame: on its axis' level, each as strong as 1 m2 is to the radar that flies live."""
        range_m, bearing_rad, speed_m_s = detections.T
        xyz_m = np.column_stack([range_m * np.sin(bearing_rad), range_m * np.cos(bearing_rad), np.zeros(len(range_m))])
        return radar_frame(truth, number, xyz_m, speed_m_s, _snr_db(np.ones(len(range_m)), range_m))

    def sees(self, range_m: F64, bearing_rad: F64) -> Bools:
        return (np.abs(bearing_rad) <= self.half_fov_rad) & (range_m >= self.nearest_m) & (range_m <= self.farthest_m)

    def frame(self, true: F64, random: np.random.Generator) -> F64:
        """(M, 3) detections of objects at ``true`` (N, 3): range, bearing from the nose, radial speed."""
        inside = self.sees(true[:, 0], true[:, 1]) & (random.random(len(true)) < self.detection_probability)
        known = self.errors.params()
        edge = np.abs(true[:, 1]) > known.bearing_edge_rad
        sigma = np.column_stack(
            [
                np.full(len(true), known.range_sigma_m),
                np.where(edge, known.bearing_edge_sigma_rad, known.bearing_sigma_rad),
                np.full(len(true), known.radial_speed_sigma_m_s),
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


class SampledPosition2Go:
    """The same radar from its samples on: echoes of the poles and the floor, and the live chain of processing."""

    def __init__(self, frame: NeuFrame, poles_enu_m: F64, radius_m: float, *, seed: int) -> None:
        poles = [
            {"type": "cylinder", "at_m": pole, "radius_m": radius_m, "height_m": POLES_M, "material": "plaster"}
            for pole in poles_enu_m.tolist()
        ]
        world = World.parse({"format": "hedgehop-world", "version": 1, "objects": poles}, frame=frame)
        self._sensor = IqRadarSensor(world, seed=seed, model=POSITION2GO_IQ)

    def frame(self, truth: SimTruth) -> RadarFrame:
        """Its strengths are told as the radar that flies live would hear the same cross sections."""
        found, beam = self._sensor.frame(truth), POSITION2GO_IQ.beam
        xyz_m, snr_db = rows(found.xyz_m, 3).astype(np.float64), rows(found.snr_db, 1)[:, 0]
        range_m = np.linalg.norm(xyz_m, axis=1)
        area_m2 = 10 ** (snr_db / 10) / beam.rated_snr * (range_m / beam.range_m) ** 4
        speed_m_s = rows(found.radial_speed_m_s, 1)[:, 0].astype(np.float64)
        return radar_frame(truth, found.number, xyz_m, speed_m_s, _snr_db(area_m2, range_m))


def _snr_db(area_m2: F64, range_m: F64) -> F64:
    rated = EvidenceParams()
    away = np.maximum(range_m, 0.1)
    return rated.rated_snr_db + 10 * np.log10(np.maximum(area_m2, 1e-9)) + 40 * np.log10(rated.rated_range_m / away)
