"""Recorded point clouds, and a synthetic one as a stereo camera sees it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F64


def car_clouds(shared_data: Path) -> list[tuple[F64, F64]]:
    """Two scans of a street by a car's laser: points (N, 3) in one frame, and the sensor's place (3,)."""
    folder = shared_data / "clouds" / "libpointmatcher"
    poses = np.loadtxt(folder / "carCloudList.csv", delimiter=",", skiprows=1, usecols=range(1, 17)).reshape(-1, 4, 4)
    first = np.loadtxt(folder / "car_cloud400.csv", delimiter=",", skiprows=1, usecols=(0, 1, 2))
    second = np.loadtxt(folder / "car_cloud401.csv", skiprows=1, usecols=(0, 1, 2))
    return [_placed(points, pose) for points, pose in zip((first, second), poses, strict=True)]


def gicp_clouds(shared_data: Path) -> list[tuple[F64, F64]]:
    """Two scans of a spinning laser that has moved between them."""
    folder = shared_data / "clouds" / "small_gicp"
    T_target_source = np.loadtxt(folder / "T_target_source.txt").reshape(4, 4)
    return [
        _placed(_ply_points(folder / "target.ply"), np.eye(4)),
        _placed(_ply_points(folder / "source.ply"), T_target_source),
    ]


def seen_by_camera(count: int, seed: int = 0) -> F64:
    """Ground, a slope and a wall, up to 33 m ahead, with a stereo camera's noise (body frame, y forward)."""
    rng = np.random.default_rng(seed)
    azimuth, elevation = rng.uniform(-0.95, 0.95, count), rng.uniform(-0.6, 0.6, count)
    wall_m = 25.0 + 6.0 * np.sin(3.0 * azimuth) + 2.0 * (azimuth > 0.3)
    range_m = np.minimum(15.0 / np.maximum(np.sin(-elevation), 1e-3), wall_m)
    range_m += rng.normal(0.0, 0.0005, count) * range_m**2
    level_m = range_m * np.cos(elevation)
    return np.column_stack([level_m * np.sin(azimuth), level_m * np.cos(azimuth), range_m * np.sin(elevation)])


def forest_clouds(count: int, seed: int = 0) -> list[tuple[F64, F64]]:
    """Scans of a laser with 64 beams, carried 1.8 m over the ground of a forest, 2 m between them.

    Trunks of 0.15-0.4 m, one on 25 m2; leaves stop a fifth of the rays anywhere.
    """
    rng = np.random.default_rng(seed)
    trunks = rng.uniform((-110.0, -80.0), (110.0, 80.0), (1_400, 2))
    radii_m = rng.uniform(0.15, 0.4, len(trunks))
    azimuth, elevation = np.linspace(-np.pi, np.pi, 900, endpoint=False), np.radians(np.linspace(-24.8, 15.0, 64))
    towards = np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    ground_m = np.where(elevation < 0.0, -1.8 / np.tan(np.minimum(elevation, -1e-6)), np.inf)
    scans = []
    for n in range(count):
        origin = np.array([2.0 * n - count + 0.013, 0.017, 1.8])
        apart = trunks - origin[:2]
        along, aside = towards @ apart.T, towards[:, :1] * apart[:, 1] - towards[:, 1:] * apart[:, 0]
        struck = (np.abs(aside) < radii_m) & (along > 0.5)
        trunk_m = np.where(struck, along - np.sqrt(np.maximum(radii_m**2 - aside**2, 0.0)), np.inf).min(axis=1)
        level_m = np.minimum(ground_m[:, None], trunk_m[None, :])
        leaf_m = np.where(rng.random(level_m.shape) < 0.2, rng.exponential(15.0, level_m.shape) + 1.0, np.inf)
        level_m = np.minimum(level_m, leaf_m)
        level_m += rng.normal(0.0, 0.02, level_m.shape)
        seen = level_m < 100.0
        up_m = level_m * np.tan(elevation)[:, None]
        x, y = level_m * towards[:, 0], level_m * towards[:, 1]
        scans.append((np.column_stack([x[seen], y[seen], up_m[seen]]) + origin, origin))
    return scans


def _placed(points: F64, pose: F64) -> tuple[F64, F64]:
    return points @ pose[:3, :3].T + pose[:3, 3], pose[:3, 3]


def _ply_points(path: Path) -> F64:
    """Of a PLY file whose vertices are four little-endian floats."""
    data = path.read_bytes()
    start = data.index(b"end_header\n") + len(b"end_header\n")
    return np.frombuffer(data, "<f4", offset=start).reshape(-1, 4)[:, :3].astype(np.float64)
