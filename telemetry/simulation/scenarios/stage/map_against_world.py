"""A sensor's map, and a radar's returns, against the world as it truly is."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import KDTree

from mapping.geometry.arrays import F64, I64
from telemetry.simulation.scenarios.stage.result import WITHIN_M, MapFigures
from telemetry.simulation.scenarios.stage.seen_flight import Flown
from telemetry.simulation.scenarios.stage.setup import Setup
from telemetry.simulation.simulator.scene import World
from telemetry.topics.obstacles import Sensor
from telemetry.topics.vehicle import SimTruth

LOOK_EVERY_S = 0.5
SLICE_RAYS = 361
SLICE_HALF_RAD = np.radians(45.0)
NEAR_M: dict[Sensor, float] = {"radar": 2.0, "vision": 1.0}
"""A voxel this near to a true surface is right, a surface this near to a voxel is found."""
REACH_M: dict[Sensor, float] = {"radar": 60.0, "vision": 20.0}
"""What is farther away need not have been found."""


def within(errors_m: F64, steps_m: Sequence[float] = WITHIN_M) -> dict[str, float]:
    """Share of the errors that are at most each step."""
    if len(errors_m) == 0:
        return {}
    return {f"{step:g}": float(np.mean(errors_m <= step)) for step in steps_m}


def spread(values_m: F64) -> float:
    """Between the 5th and the 95th percentile."""
    if len(values_m) == 0:
        return 0.0
    low, high = np.percentile(values_m, [5.0, 95.0])
    return float(high - low)


def level_slice(world: World, track: Sequence[SimTruth], *, most_m: float) -> F64:
    """(N, 3) What an ideal sensor would have met at the vehicle's own height, from where it really was.

    Rays go out level, +-45 degrees about the nose. The ground does not count: it is no obstacle.
    """
    found: list[F64] = []
    last_s = -np.inf
    for truth in track:
        if truth.t_sim_s - last_s < LOOK_EVERY_S:
            continue
        last_s = truth.t_sim_s
        origin = np.array(truth.position_enu_m)
        azimuth = truth.heading_rad + np.linspace(-SLICE_HALF_RAD, SLICE_HALF_RAD, SLICE_RAYS)
        rays = np.column_stack([np.sin(azimuth), np.cos(azimuth), np.zeros(SLICE_RAYS)])
        near = world.ahead(origin, rays[SLICE_RAYS // 2], within_m=most_m, half_angle_rad=2 * SLICE_HALF_RAD)
        hits = world.cast(origin, rays, np.full(SLICE_RAYS, 0.5), most_m=most_m, near=near)
        met = (hits.what >= 0) & np.isfinite(hits.distance_m)
        found.append(origin + rays[met] * hits.distance_m[met, None])
    return np.concatenate(found) if found else np.empty((0, 3))


def recall(truth_enu: F64, map_enu: F64, *, voxel_m: float, within_m: float) -> float | None:
    """Share of the voxels that hold true surface near which the map has an occupied one."""
    if len(truth_enu) == 0:
        return None
    wanted = (np.unique(np.floor(truth_enu / voxel_m).astype(np.int64), axis=0) + 0.5) * voxel_m
    if len(map_enu) == 0:
        return 0.0
    away_m, _ = KDTree(map_enu).query(wanted)
    return float(np.mean(away_m <= within_m))


def clusters_of(points_enu: F64, *, link_m: float) -> I64:
    """(N,) number of the cluster of each place; places nearer than ``link_m`` to each other are one."""
    if len(points_enu) == 0:
        return np.empty(0, np.int64)
    tree = KDTree(points_enu)
    label = np.full(len(points_enu), -1, np.int64)
    count = 0
    for first in range(len(points_enu)):
        if label[first] >= 0:
            continue
        waiting = [first]
        label[first] = count
        while waiting:
            for neighbour in tree.query_ball_point(points_enu[waiting.pop()], link_m):
                if label[neighbour] < 0:
                    label[neighbour] = count
                    waiting.append(neighbour)
        count += 1
    return label


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
