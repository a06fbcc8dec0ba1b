"""The two ways to simulate the radar: by what it would report, or by the samples that it would take."""

from __future__ import annotations

from typing import Protocol

from telemetry.sensing import RadarFrame, RadarKind, SimTruth
from telemetry.simulator.scene.world import World
from telemetry.simulator.sensors.radar import RadarSensor


class Radar(Protocol):
    def frame(self, truth: SimTruth) -> RadarFrame: ...


def radar_sensor(kind: RadarKind, world: World, *, seed: int) -> Radar:
    """An AWR1843 in a world."""
    if kind == "model":
        return RadarSensor(world, seed=seed)
    # The kernels of the whole chain take a moment to load.
    from telemetry.simulator.sensors.iq import IqRadarSensor

    return IqRadarSensor(world, seed=seed)
