"""Radar targets that are one thing: a body gives several echoes, and each would else be followed by itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.radar.targets import Polar

SAME_M, SAME_STANDS_M, SAME_M_S = 2.5, 1.0, 0.8
"""Echoes nearer to the strongest one, and as fast as it, are of the same thing. Of what stands still only those that
are nearer still: the middle between two poles is the way between them."""
MOST_BLOBS = 150
"""The nearest are kept: what is bounded here bounds the tracker's work on a frame."""


@dataclass(frozen=True, slots=True)
class Blobs:
    range_m: F64
    bearing_rad: F64
    """Clockwise from the nose."""
    radial_speed_m_s: F64
    """Positive: moving away."""
    moving: Bools
    """By their radial speed."""

    @property
    def detections(self) -> F64:
        """(N, 3) as the tracker takes them."""
        return np.column_stack([self.range_m, self.bearing_rad, self.radial_speed_m_s])

    def __len__(self) -> int:
        return len(self.range_m)


def blobs(targets: Polar, radial_speed_m_s: F64, snr_db: F64, moving: Bools) -> Blobs:
    """Targets (N,) -> blobs, those that move first, then the nearest; places and speeds are means by power."""
    x, y = targets.range_m * np.sin(targets.azimuth_rad), targets.range_m * np.cos(targets.azimuth_rad)
    power = 10 ** (np.clip(snr_db, -100.0, 100.0) / 10)
    free = np.ones(len(x), np.bool_)
    found: list[tuple[float, float, float, bool]] = []
    for k in np.argsort(-snr_db, kind="stable"):
        if not free[k]:
            continue
        same = (
            free
            & (np.hypot(x - x[k], y - y[k]) <= (SAME_M if moving[k] else SAME_STANDS_M))
            & (np.abs(radial_speed_m_s - radial_speed_m_s[k]) <= SAME_M_S)
        )
        free &= ~same
        share = power[same] / power[same].sum()
        east, north = float(share @ x[same]), float(share @ y[same])
        found.append((east, north, float(share @ radial_speed_m_s[same]), bool(moving[k])))
    return _nearest(np.array(found, np.float64).reshape(-1, 4))


def _nearest(found: F64) -> Blobs:
    x, y, speed, moving = found.T
    range_m, moves = np.hypot(x, y), moving > 0.5
    order = np.lexsort((range_m, ~moves))[:MOST_BLOBS]
    return Blobs(range_m[order], np.arctan2(x, y)[order], speed[order], moves[order])
