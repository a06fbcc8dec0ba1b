"""A simulated millimetre-wave radar: frames of targets as an AWR1843 would send them (Miccinesi 2022)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mapping.geometry.arrays import F64
from mapping.sensor_frames import RadarFrame
from telemetry.simulation.simulator.scene.world import World
from telemetry.simulation.simulator.sensors.body import of_truth, radar_frame
from telemetry.simulation.simulator.sensors.radar_cells import Scatterers, detect
from telemetry.simulation.simulator.sensors.radar_echoes import NEAREST_M, echoes
from telemetry.simulation.simulator.sensors.radar_model import RadarModel
from telemetry.simulation.simulator.sensors.radar_rays import unit
from telemetry.topics.vehicle import RadarKind, SimTruth


@dataclass(frozen=True, slots=True)
class _Targets:
    """As they are, before they are measured."""

    range_m: F64
    azimuth_rad: F64
    elevation_rad: F64
    speed_m_s: F64
    power: F64


class RadarSensor:
    """Looks forward along the body's y axis. The same seed and the same truths give the same frames."""

    def __init__(self, world: World, *, seed: int, model: RadarModel | None = None) -> None:
        self.model = model or RadarModel()
        self._world = world
        self._random = np.random.default_rng([seed, 1])
        self._published = 0

    def frame(self, truth: SimTruth) -> RadarFrame:
        """What is seen from there, at that moment."""
        real = self._real(truth)
        found = _joined([real, self._side_lobes(real), self._false_alarms()])
        xyz_m, speed_m_s = self._measured(found)
        self._published += 1
        return radar_frame(truth, self._published, xyz_m, speed_m_s, 10 * np.log10(found.power))

    def _real(self, truth: SimTruth) -> _Targets:
        body_enu = of_truth(truth)
        position = np.array(truth.position_enu_m) + self.model.mount_m * body_enu[:, 2]
        lit = echoes(self._world.at(truth.t_sim_s), self.model, position, body_enu, self._random)
        x, y, z = (lit.offset_enu @ body_enu).T
        azimuth, elevation = np.arctan2(x, y), np.arctan2(z, np.hypot(x, y))
        speed = lit.radial_speed_m_s(truth.velocity_enu_m_s)
        snr = self.model.snr(lit.cross_section_m2, lit.range_m, azimuth, elevation)
        seen = np.flatnonzero(np.abs(azimuth) <= self.model.half_width_rad)
        patches = Scatterers(lit.range_m[seen], azimuth[seen], elevation[seen], speed[seen], snr[seen])
        found = detect(patches, self.model, self._random)
        at = found.scatterer
        return _Targets(
            patches.range_m[at], patches.azimuth_rad[at], patches.elevation_rad[at], patches.speed_m_s[at], found.power
        )

    def _side_lobes(self, real: _Targets) -> _Targets:
        """Ghosts at a target's range and speed. A side lobe fades too, and is reported as any second peak would be."""
        model = self.model
        sides = np.repeat([-1.0, 1.0], len(real.power))
        level = 10 ** (model.side_lobe_db / 10) * self._random.standard_exponential(len(sides))
        power = np.tile(real.power, 2) * level
        sine = np.tile(np.sin(real.azimuth_rad), 2) + sides * model.side_lobe_sine
        seen = (level >= 10 ** (model.second_peak_db / 10)) & (power >= model.threshold)
        seen &= np.abs(sine) <= math.sin(model.half_width_rad)
        return _Targets(
            np.tile(real.range_m, 2)[seen],
            np.arcsin(sine[seen]),
            np.tile(real.elevation_rad, 2)[seen],
            np.tile(real.speed_m_s, 2)[seen],
            power[seen],
        )

    def _false_alarms(self) -> _Targets:
        """Noise above the threshold: anywhere, at any speed."""
        model, random = self.model, self._random
        count = random.poisson(model.false_alarms)
        sine = math.sin(model.half_width_rad)
        fastest = (model.speed_cells // 2) * model.speed_cell_m_s
        return _Targets(
            random.uniform(model.range_cell_m, model.range_m, count),
            np.arcsin(random.uniform(-sine, sine, count)),
            random.uniform(-model.elevation_6db_rad, model.elevation_6db_rad, count),
            random.uniform(-fastest, fastest, count),
            model.threshold + random.standard_exponential(count),
        )

    def _measured(self, targets: _Targets) -> tuple[F64, F64]:
        """(N, 3) in the body's frame and (N,) radial speeds: with errors, in cells."""
        model, random = self.model, self._random
        kicks = random.standard_normal((3, len(targets.range_m)))
        cell = np.floor((targets.range_m + model.range_sigma_m * kicks[0]) / model.range_cell_m)
        range_m = np.maximum((cell + 0.5) * model.range_cell_m, NEAREST_M)
        azimuth = targets.azimuth_rad + model.azimuth_sigma_rad / np.cos(targets.azimuth_rad) * kicks[1]
        elevation = targets.elevation_rad + model.elevation_sigma_rad * kicks[2]
        half = model.speed_cells // 2
        speed_cell = (np.round(targets.speed_m_s / model.speed_cell_m_s) + half) % model.speed_cells - half
        xyz_m = unit(azimuth, elevation) * range_m[:, None] + np.array([0.0, 0.0, model.mount_m])
        return xyz_m, speed_cell * model.speed_cell_m_s


def _joined(parts: list[_Targets]) -> _Targets:
    return _Targets(
        np.concatenate([part.range_m for part in parts]),
        np.concatenate([part.azimuth_rad for part in parts]),
        np.concatenate([part.elevation_rad for part in parts]),
        np.concatenate([part.speed_m_s for part in parts]),
        np.concatenate([part.power for part in parts]),
    )


class Radar(Protocol):
    def frame(self, truth: SimTruth) -> RadarFrame: ...


def radar_sensor(kind: RadarKind, world: World, *, seed: int) -> Radar:
    """An AWR1843 in a world."""
    if kind == "model":
        return RadarSensor(world, seed=seed)
    # The kernels of the whole chain take a moment to load.
    from telemetry.simulation.simulator.sensors.iq import IqRadarSensor

    return IqRadarSensor(world, seed=seed)
