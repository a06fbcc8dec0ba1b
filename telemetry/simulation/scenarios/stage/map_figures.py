"""A sensor's map against the true surfaces of the world that it was made in."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.simulation.scenarios.stage.map_against_world import level_slice, recall, spread, within
from telemetry.simulation.scenarios.stage.result import MapFigures
from telemetry.simulation.scenarios.stage.seen_flight import Flown
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.topics.obstacles import Sensor

NEAR_M: dict[Sensor, float] = {"radar": 2.0, "vision": 1.0}
"""A voxel this near to a true surface is right, a surface this near to a voxel is found."""
REACH_M: dict[Sensor, float] = {"radar": 60.0, "vision": 20.0}
"""What is farther away need not have been found."""


def radar_figures(flown: Flown, setup: Setup) -> MapFigures:
    """What the global map believes in the end; known ground is not asked about."""
    return _figures("radar", flown.voxels("radar"), flown, setup)


def vision_figures(flown: Flown, setup: Setup) -> MapFigures:
    """Of all local maps together, as the flight went by."""
    if not flown.vision:
        return MapFigures()
    edge = setup.settings.vision_resolution_m
    keys = np.unique(np.floor(np.concatenate(flown.vision) / edge).astype(np.int64), axis=0)
    return _figures("vision", (keys.astype(np.float64) + 0.5) * edge, flown, setup)


def _figures(sensor: Sensor, voxels: F64, flown: Flown, setup: Setup) -> MapFigures:
    if len(voxels) == 0:
        return MapFigures()
    away_m = setup.world.surface_distance_m(voxels)
    truth = level_slice(setup.world, flown.track, most_m=REACH_M[sensor])
    edge = setup.settings.radar_resolution_m if sensor == "radar" else setup.settings.vision_resolution_m
    return MapFigures(
        voxels=len(voxels),
        within_m=within(away_m),
        vertical_spread_m=spread(voxels[:, 2]),
        precision=float(np.mean(away_m <= NEAR_M[sensor])),
        recall=recall(truth, voxels, voxel_m=edge, within_m=NEAR_M[sensor]),
    )
