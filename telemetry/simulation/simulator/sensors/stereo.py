"""A simulated stereo camera: point clouds as a ZED 2 would give them (Bigazzi 2022)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.sensor_frames import CloudFrame, packed
from telemetry.simulation.simulator.scene.world import World
from telemetry.simulation.simulator.sensors.body import of_truth
from telemetry.topics.vehicle import SimTruth

_PRIMES = np.array([73_856_093, 19_349_663, 83_492_791], dtype=np.int64)


@dataclass(frozen=True, slots=True)
class StereoModel:
    columns: int = 192
    rows: int = 108
    width_rad: float = math.radians(110.0)
    height_rad: float = math.radians(70.0)
    nearest_m: float = 0.5
    best_m: float = 20.0
    """Beyond it matches fail more and more often."""
    farthest_m: float = 40.0
    far_loss: float = 0.5
    """Share of the points that are lost at the end of the range."""
    depth_sigma_per_m: float = 0.002
    """sigma = this times depth squared"""
    loss: float = 0.02
    """Share of points lost anywhere."""
    patch_m: float = 0.4
    """Size of the patches on a surface that have texture or none."""
    mount_m: float = 0.2
    """Above the vehicle's feet, in the body's frame; what it says counts from the feet."""


class StereoSensor:
    """Looks forward along the body's y axis. The same seed and the same truths give the same frames."""

    def __init__(self, world: World, *, seed: int, dark: bool = False, model: StereoModel | None = None) -> None:
        self.model = model or StereoModel()
        self.dark = dark
        """At night a camera sees nothing."""
        self.share_seen = 1.0
        """Of the newest frame's rays, those that gave a point: what SLAM holds on to. 1 until there is a frame."""
        self._world = world
        self._random = np.random.default_rng([seed, 2])
        self._rays = _pinhole(self.model)
        self._patches = int(np.random.default_rng([seed, 3]).integers(1 << 31))
        self._made = 0

    def frame(self, truth: SimTruth) -> CloudFrame:
        """What is seen from there, at that moment; in darkness an empty cloud."""
        xyz_m = np.empty((0, 3)) if self.dark else self._points(truth)
        self.share_seen = len(xyz_m) / len(self._rays)
        self._made += 1
        return CloudFrame(
            t_mono_s=truth.t_mono_s,
            t_utc_s=truth.t_utc_s,
            number=self._made,
            source="simulated",
            xyz_m=packed(xyz_m),
        )

    def _points(self, truth: SimTruth) -> F64:
        model, random = self.model, self._random
        body_enu = of_truth(truth)
        position = np.array(truth.position_enu_m) + model.mount_m * body_enu[:, 2]
        directions = self._rays @ body_enu.T
        luck = 1.0 - random.random(len(directions))
        world = self._world.at(truth.t_sim_s)
        near = world.ahead(
            position, body_enu[:, 1], within_m=model.farthest_m, half_angle_rad=math.acos(self._rays[0, 1])
        )
        hits = world.cast(position, directions, luck, most_m=model.farthest_m, near=near)
        met = np.flatnonzero(hits.distance_m < math.inf)
        range_m = hits.distance_m[met]
        depth_m = range_m * self._rays[met, 1]
        places = position + directions[met] * range_m[:, None]
        kept = self._matched(range_m, places, world.texture(hits.what[met]))
        kept &= depth_m >= model.nearest_m
        depth_m, rays = depth_m[kept], self._rays[met[kept]]
        noisy = depth_m + model.depth_sigma_per_m * depth_m**2 * random.standard_normal(len(depth_m))
        # An error of depth moves a point along its ray.
        return rays * (np.maximum(noisy, 0.05) / rays[:, 1])[:, None] + np.array([0.0, 0.0, model.mount_m])

    def _matched(self, range_m: F64, places_enu: F64, texture: F64) -> Bools:
        """Which points the two pictures agree on. A patch without texture has none from any side, and tomorrow."""
        model = self.model
        far = np.clip((range_m - model.best_m) / (model.farthest_m - model.best_m), 0.0, 1.0)
        lost = self._random.random(len(range_m)) < model.loss + model.far_loss * far
        cell = np.floor(places_enu / model.patch_m).astype(np.int64)
        mixed = (cell * _PRIMES).sum(axis=1) ^ self._patches
        mixed = (mixed ^ (mixed >> 13)) * 1_274_126_177
        share = ((mixed ^ (mixed >> 16)) & 0xFFFF) / 65_536.0
        return ~lost & (share < texture)


def _pinhole(model: StereoModel) -> F64:
    """(rows * columns, 3) unit rays in the body's frame, row by row from above."""
    across = math.tan(model.width_rad / 2) * ((np.arange(model.columns) + 0.5) / model.columns * 2 - 1)
    upwards = math.tan(model.height_rad / 2) * (1 - (np.arange(model.rows) + 0.5) / model.rows * 2)
    x, z = np.meshgrid(across, upwards)
    rays = np.column_stack([x.ravel(), np.ones(x.size), z.ravel()])
    return rays / np.linalg.norm(rays, axis=1, keepdims=True)
