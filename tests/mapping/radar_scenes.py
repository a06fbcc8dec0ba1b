"""Radar frames of objects that fly straight, for tests of the tracker: detections with noise, gaps and false alarms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F64, Bools
from mapping.tracking.tracker import Tracker
from mapping.tracking.tracker_params import TrackState


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame, and the truth behind it."""

    t_s: float
    detections: F64
    """(M, 3) range, bearing from the nose, radial speed."""
    position_enu_m: F64
    velocity_enu_m_s: F64
    heading_rad: float
    truth: F64
    """(N, 4) places and velocities of all objects, seen or not."""
    visible: Bools
    """(N,)"""


@dataclass(frozen=True, slots=True)
class Radar:
    """An AWR1843 as the tracker's own defaults describe it."""

    range_sigma_m: float = 0.15
    bearing_sigma_rad: float = math.radians(1.0)
    radial_speed_sigma_m_s: float = 0.2
    half_fov_rad: float = math.radians(45.0)
    farthest_m: float = 120.0
    detection_probability: float = 0.9
    false_alarms: float = 0.5
    every_s: float = 0.1


def stepped(tracker: Tracker, frame: Frame) -> list[TrackState]:
    return tracker.step(
        frame.t_s,
        frame.detections,
        position_enu_m=frame.position_enu_m,
        velocity_enu_m_s=frame.velocity_enu_m_s,
        heading_rad=frame.heading_rad,
    )


def frames(
    objects: F64,
    *,
    seed: int,
    count: int,
    radar: Radar | None = None,
    velocity_enu_m_s: tuple[float, float] = (0.0, 3.0),
    turn_rad_s: float = 0.05,
) -> list[Frame]:
    """``objects`` (N, 4) at the beginning. The radar starts at the origin, nose to the north, and swings about."""
    radar, rng = radar or Radar(), np.random.default_rng(seed)
    own_m_s = np.array(velocity_enu_m_s)
    out = []
    for k in range(count):
        t_s = k * radar.every_s
        heading_rad = 4 * turn_rad_s * math.sin(t_s / 4)
        place = own_m_s * t_s
        now = objects + t_s * np.column_stack([objects[:, 2:], np.zeros((len(objects), 2))])
        true = _polar(now, place, own_m_s, heading_rad)
        visible = (np.abs(true[:, 1]) <= radar.half_fov_rad) & (true[:, 0] <= radar.farthest_m) & (true[:, 0] > 1.0)
        seen = true[visible & (rng.random(len(true)) < radar.detection_probability)]
        noise = rng.normal(size=seen.shape)
        sigma = [radar.range_sigma_m, radar.bearing_sigma_rad, radar.radial_speed_sigma_m_s]
        found = np.concatenate([seen + noise * sigma, _false(rng, radar)])
        out.append(Frame(t_s, rng.permutation(found), place, own_m_s, heading_rad, now, visible))
    return out


def movers(count: int, seed: int) -> F64:
    """(N, 4) Objects ahead of the radar that fly through each other's ways at up to 5 m/s or so."""
    rng = np.random.default_rng(seed)
    distance, bearing = rng.uniform(15.0, 90.0, count), rng.uniform(-0.6, 0.6, count)
    places = np.column_stack([distance * np.sin(bearing), distance * np.cos(bearing)])
    return np.column_stack([places, rng.normal(0.0, 2.5, (count, 2))])


def _polar(objects: F64, place: F64, own_m_s: F64, heading_rad: float) -> F64:
    off, rate = objects[:, :2] - place, objects[:, 2:] - own_m_s
    distance = np.hypot(*off.T)
    bearing = np.remainder(np.arctan2(*off.T) - heading_rad + math.pi, 2 * math.pi) - math.pi
    return np.column_stack([distance, bearing, (off * rate).sum(axis=1) / distance])


def _false(rng: np.random.Generator, radar: Radar) -> F64:
    n = rng.poisson(radar.false_alarms)
    return np.column_stack(
        [
            rng.uniform(2.0, radar.farthest_m, n),
            rng.uniform(-radar.half_fov_rad, radar.half_fov_rad, n),
            rng.uniform(-8.0, 8.0, n),
        ]
    )
