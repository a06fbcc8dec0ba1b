"""A simulated radar from its samples on: the world's echoes as the converters get them, and the chain of processing.

What it leaves out of a real one: leakage from transmitter to receiver, converters that round and clip, antennas that
are not quite alike, echoes by way of several surfaces, other radars.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import C64
from mapping.radar.chain import RadarChain
from mapping.radar.detections import Detections
from mapping.sensor_frames import RadarFrame
from telemetry.simulation.simulator.scene.world import World
from telemetry.simulation.simulator.sensors.body import of_truth, radar_frame, rotation_enu_body
from telemetry.simulation.simulator.sensors.iq_model import AWR1843_IQ, IqModel
from telemetry.simulation.simulator.sensors.iq_synthesis import Returns, sampled, strongest
from telemetry.simulation.simulator.sensors.radar_echoes import echoes
from telemetry.topics.vehicle import SimTruth


class IqRadarSensor:
    """Looks forward along the body's y axis. The same seed and the same truths give the same frames."""

    def __init__(self, world: World, *, seed: int, model: IqModel = AWR1843_IQ) -> None:
        self.model = model
        self.chain = RadarChain(model.params, model.chain)
        self._world = world
        self._random = np.random.default_rng([seed, 5])
        self._body_radar = rotation_enu_body(0.0, model.tilt_rad, 0.0)
        self._mount_m = np.array([0.0, 0.0, model.beam.mount_m])
        self._published = 0

    def frame(self, truth: SimTruth) -> RadarFrame:
        """What the chain finds in the samples taken there, at that moment."""
        self._published += 1
        return self._told(truth, self.chain.process(self.cube(truth)))

    def cube(self, truth: SimTruth) -> C64:
        """(chirps, virtual antennas, samples): echoes, the strongest of too many, and noise."""
        loudest = strongest(self._returns(truth), self.model.most_echoes)
        return sampled(self.model.params, loudest) + noise(self.model.params.shape, self._random)

    def _returns(self, truth: SimTruth) -> Returns:
        """Echoes fade as Swerling's first case: each has a complex normal amplitude, another one at every frame."""
        model, random = self.model, self._random
        body_enu = of_truth(truth)
        radar_enu = body_enu @ self._body_radar
        position = np.array(truth.position_enu_m) + self._mount_m[2] * body_enu[:, 2]
        lit = echoes(self._world.at(truth.t_sim_s), model.beam, position, radar_enu, random)
        x, y, z = (lit.offset_enu @ radar_enu).T
        azimuth, elevation = np.arctan2(x, y), np.arctan2(z, np.hypot(x, y))
        speed = lit.radial_speed_m_s(truth.velocity_enu_m_s)
        snr = model.beam.snr(lit.cross_section_m2, lit.range_m, azimuth, elevation)
        snr[np.abs(azimuth) > model.beam.half_width_rad] = 0.0
        kicks = random.standard_normal((2, len(snr)))
        amplitude = np.sqrt(snr / model.gain / 2) * (kicks[0] + 1j * kicks[1])
        return Returns(lit.range_m, speed, azimuth, elevation, amplitude)

    def _told(self, truth: SimTruth, found: Detections) -> RadarFrame:
        xyz_m = found.xyz_m @ self._body_radar.T + self._mount_m
        return radar_frame(truth, self._published, xyz_m, found.radial_speed_m_s, found.snr_db)


def noise(shape: tuple[int, int, int], random: np.random.Generator) -> C64:
    """White, of variance 1, half of it in the real part."""
    pairs = random.standard_normal((*shape[:2], 2 * shape[2]), np.float32)
    pairs *= np.float32(math.sqrt(0.5))
    return pairs.view(np.complex64)
