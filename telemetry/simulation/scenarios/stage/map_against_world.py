"""A sensor's map, and a radar's returns, against the world as it truly is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from mapping.geometry.arrays import F64, I64
from telemetry.simulation.scenarios.stage.result import WITHIN_M, MapFigures
from telemetry.simulation.scenarios.stage.seen_flight import SeenFlight
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
    return float(np.mean(_missed_m(_holding(truth_enu, voxel_m), map_enu) <= within_m))


def _holding(truth_enu: F64, voxel_m: float) -> F64:
    """(M, 3) middles of the voxels that hold true surface."""
    keys = np.unique(np.floor(truth_enu / voxel_m).astype(np.int64), axis=0)
    return (keys.astype(np.float64) + 0.5) * voxel_m


def _missed_m(wanted_enu: F64, map_enu: F64) -> F64:
    """(M,) from each to the nearest occupied voxel of the map; infinite where that has none."""
    if len(map_enu) == 0:
        return np.full(len(wanted_enu), np.inf)
    away_m, _ = KDTree(map_enu).query(wanted_enu)
    return np.array(away_m, dtype=np.float64)


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


@dataclass(frozen=True, slots=True)
class MapComparison:
    """One sensor's map beside the true surfaces, voxel by voxel."""

    sensor: Sensor
    voxels_enu: F64
    """(N, 3) Occupied ones, in the world's frame."""
    away_m: F64
    """(N,) From each to the nearest true surface."""
    true_enu: F64
    """(M, 3) Voxels that hold true surface, of those that could have been seen."""
    missed_m: F64
    """(M,) From each to the nearest occupied one; infinite in an empty map."""

    @property
    def near_m(self) -> float:
        return NEAR_M[self.sensor]

    def precision(self, within_m: float) -> float:
        return float(np.mean(self.away_m <= within_m))

    def recall(self, within_m: float) -> float | None:
        return float(np.mean(self.missed_m <= within_m)) if len(self.missed_m) else None

    @property
    def figures(self) -> MapFigures:
        if len(self.voxels_enu) == 0:
            return MapFigures()
        return MapFigures(
            voxels=len(self.voxels_enu),
            within_m=within(self.away_m),
            vertical_spread_m=spread(self.voxels_enu[:, 2]),
            precision=self.precision(self.near_m),
            recall=self.recall(self.near_m),
        )


def radar_figures(flown: SeenFlight, setup: Setup) -> MapFigures:
    return radar_compared(flown, setup).figures


def vision_figures(flown: SeenFlight, setup: Setup) -> MapFigures:
    return vision_compared(flown, setup).figures


def radar_compared(flown: SeenFlight, setup: Setup) -> MapComparison:
    """What the global map believes in the end; known ground is not asked about."""
    return _compared("radar", flown.voxels("radar"), setup.settings.radar_resolution_m, flown, setup)


def vision_compared(flown: SeenFlight, setup: Setup) -> MapComparison:
    """Of all local maps together, as the flight went by."""
    edge = setup.settings.vision_resolution_m
    seen = np.concatenate(flown.vision) if flown.vision else np.empty((0, 3))
    keys = np.unique(np.floor(seen / edge).astype(np.int64), axis=0)
    return _compared("vision", (keys.astype(np.float64) + 0.5) * edge, edge, flown, setup)


def _compared(sensor: Sensor, voxels: F64, edge_m: float, flown: SeenFlight, setup: Setup) -> MapComparison:
    if len(voxels) == 0:
        return MapComparison(sensor, voxels, np.empty(0), np.empty((0, 3)), np.empty(0))
    wanted = _holding(level_slice(setup.world, flown.track, most_m=REACH_M[sensor]), edge_m)
    away_m = setup.world.surface_distance_m(voxels)
    return MapComparison(sensor, voxels, away_m, wanted, _missed_m(wanted, voxels))
