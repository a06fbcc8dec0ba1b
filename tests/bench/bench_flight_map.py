"""What the camera's map of the whole flight costs its frames: each is told before it goes into that map.

Run alone: ``python -m tests.bench.bench_flight_map [FRAMES] [POINTS]``. One flight of made-up clouds over a floor with
walls; every frame once as it is told, and what comes after. Prints, fails for nothing.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from mapping.perceiving.frame_result import Settings
from mapping.perceiving.vision_perception import VisionPerception
from tests.mapping.flights import Flight, flat_ground


def main(frames: float = 600, points: float = 8_000) -> None:
    flight = Flight(VisionPerception(Settings(depth_m=7.0, resolution_m=0.5)))
    flight.perception.set_ground(flat_ground())
    rng = np.random.default_rng(1)
    told_s, put_in_s = [], []
    for _ in range(round(frames)):
        flight.move()
        cloud = _view(rng, flight.north_m, round(points))
        begun = time.perf_counter()
        flight.camera(cloud, voxel_m=0.25)
        told = time.perf_counter()
        flight.perception.accumulate()
        told_s.append(told - begun)
        put_in_s.append(time.perf_counter() - told)
    whole = flight.perception.flight
    assert whole is not None
    print(f"{frames:.0f} frames of {points:.0f} points, {flight.north_m:.0f} m flown")
    print(f"  until a frame is told: {_spread(told_s[20:])}")
    print(f"  then into the map of the flight: {_spread(put_in_s[20:])}")
    print(f"  that map: {whole.map.occupied_count:,} voxels, {whole.map.size_bytes / 1e6:.1f} MB, part {whole.part}")


def _view(rng: np.random.Generator, north_m: float, count: int) -> np.ndarray:
    """Half floor, half a wall 15 m ahead and to both sides."""
    floor = np.column_stack(
        [rng.uniform(-15, 15, count // 2), north_m + rng.uniform(3, 35, count // 2), np.full(count // 2, -5.0)]
    )
    wall = np.column_stack(
        [rng.choice([-12.0, 12.0], count - count // 2), north_m + rng.uniform(3, 35, count - count // 2), floor[:, 0]]
    )
    return np.concatenate([floor, wall])


def _spread(seconds: list[float]) -> str:
    p50, p99 = np.percentile(seconds, [50, 99])
    return f"p50 {1e3 * p50:.2f} ms, p99 {1e3 * p99:.2f} ms"


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
