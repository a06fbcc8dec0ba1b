"""How fast and how exact objects are followed, beside Stone Soup's tracker on the same detections in the same run."""

from __future__ import annotations

import time

import numpy as np

from mapping.tracking.tracker import Tracker
from tests.mapping.tracks_compared import compared

ENOUGH, NO_WORSE = 30.0, 1.05
SEEDS, OBJECTS, FRAMES = (0, 1), 8, 80


def main() -> None:
    both = compared(SEEDS, objects=OBJECTS, count=FRAMES)
    ours_ms, theirs_ms = (1e3 * seconds / both.frames for seconds in both.seconds)
    print(
        f"{OBJECTS} objects, {both.frames} frames, against Stone Soup's GNN and extended Kalman filters: "
        f"{ours_ms:.3f} ms against {theirs_ms:.1f} ms a frame, {both.times_as_fast:.0f} times as fast "
        f"(at least {ENOUGH:g} times: {_yes(both.times_as_fast >= ENOUGH)})"
    )
    print(
        f"their places off by {both.error_m[0]:.3f} m against {both.error_m[1]:.3f} m, {both.error_ratio:.3f} times "
        f"(at most {NO_WORSE:g} times: {_yes(both.error_ratio <= NO_WORSE)}); in view and followed "
        f"{100 * both.covered[0]:.1f} % against {100 * both.covered[1]:.1f} %"
    )
    for count in (2, 100, 1000):
        print(f"{count} detections in every frame, all of noise: {1e3 * _of_noise(count):.2f} ms a frame")


def _of_noise(count: int) -> float:
    """Seconds a frame, the median of twenty after ten that fill it with candidates."""
    tracker, random, took = Tracker(), np.random.default_rng(0), []
    for k in range(30):
        found = random.uniform([2.0, -0.78, -10.0], [120.0, 0.78, 10.0], (count, 3))
        start_s = time.thread_time()
        tracker.step(0.1 * k, found, position_enu_m=(0, 0), velocity_enu_m_s=(0, 0), heading_rad=0.0)
        took.append(time.thread_time() - start_s)
    return float(np.median(took[10:]))


def _yes(reached: bool) -> str:
    return "yes" if reached else "NO"


if __name__ == "__main__":
    main()
