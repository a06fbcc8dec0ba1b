"""Our tracker and Stone Soup's on the same frames: how far off, how many, how long."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64
from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackerParams
from tests.mapping.radar_scenes import Frame, frames, movers, stepped
from tests.reference.stonesoup_gnn import follow

FOUND_M = 5.0
"""A track this near to an object is its own."""
PARAMS = TrackerParams(apart_m=0.0)
"""Stone Soup knows of no parts of objects."""


@dataclass(frozen=True, slots=True)
class Compared:
    error_m: tuple[float, float]
    """Root mean square over objects and frames in which both have a track: ours, theirs."""
    covered: tuple[float, float]
    """Share of the objects in view that have one."""
    seconds: tuple[float, float]
    """Of the thread's processor."""
    frames: int

    @property
    def error_ratio(self) -> float:
        return self.error_m[0] / self.error_m[1]

    @property
    def times_as_fast(self) -> float:
        return self.seconds[1] / self.seconds[0]


def compared(seeds: Sequence[int], *, objects: int, count: int) -> Compared:
    """Ours ran once before, so that nothing is compiled meanwhile."""
    _ours(frames(movers(objects, 0), seed=0, count=5))
    off: list[F64] = []
    seconds = np.zeros(2)
    in_view = 0
    for seed in seeds:
        scene = frames(movers(objects, seed), seed=seed, count=count)
        in_view += sum(int(frame.visible.sum()) for frame in scene)
        start_s = time.thread_time()
        ours = _ours(scene)
        middle_s = time.thread_time()
        theirs = list(follow(scene, PARAMS))
        seconds += [middle_s - start_s, time.thread_time() - middle_s]
        off.append(np.stack([_errors(scene, ours), _errors(scene, theirs)]))
    errors = np.concatenate([one.reshape(2, -1) for one in off], axis=1)
    both = np.isfinite(errors).all(axis=0)
    rms = np.sqrt((errors[:, both] ** 2).mean(axis=1))
    covered = np.isfinite(errors).sum(axis=1) / in_view
    return Compared(_two(rms), _two(covered), _two(seconds), len(seeds) * count)


def _ours(scene: Sequence[Frame]) -> list[F64]:
    tracker, out = Tracker(PARAMS), []
    for frame in scene:
        states = stepped(tracker, frame)
        out.append(np.array([state.position_enu_m for state in states if state.confirmed]).reshape(-1, 2))
    return out


def _errors(scene: Sequence[Frame], tracks: Sequence[F64]) -> F64:
    """(frames, objects) metres; NaN where an object is out of view or has no track."""
    out = np.full((len(scene), len(scene[0].truth)), np.nan)
    for k, (frame, found) in enumerate(zip(scene, tracks, strict=True)):
        if len(found):
            away = np.hypot(*(frame.truth[:, None, :2] - found[None, :, :2]).transpose(2, 0, 1)).min(axis=1)
            out[k] = np.where((away < FOUND_M) & frame.visible, away, np.nan)
    return out


def _two(values: F64) -> tuple[float, float]:
    return float(values[0]), float(values[1])
