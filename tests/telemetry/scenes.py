"""Small worlds and truths for tests of the simulated sensors."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mapping.sensor_frames import RadarFrame, rows
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import SceneTerrain, World
from telemetry.topics.vehicle import SimTruth

FRAME = NeuFrame(37.72902, 14.99262, 1712.0)
BELOW = -1000.0


def world(*objects: dict[str, Any], terrain: SceneTerrain | None = None) -> World:
    document = {"format": "hedgehop-world", "version": 1, "objects": list(objects)}
    return World.parse(document, frame=FRAME, terrain=terrain)


def in_the_air(*objects: dict[str, Any]) -> World:
    """The ground is out of every sensor's reach; heights count from the origin."""
    level = SceneTerrain.level()
    deep = SceneTerrain(level.up, level.to_cells, BELOW)
    return world(*({"above": "origin", **item} for item in objects), terrain=deep)


def truth(
    east: float = 0.0,
    north: float = 0.0,
    up: float = 10.0,
    *,
    heading_deg: float = 0.0,
    roll_deg: float = 0.0,
    pitch_deg: float = 0.0,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    t_s: float = 0.0,
) -> SimTruth:
    return SimTruth(
        t_mono_s=100.0 + t_s,
        t_utc_s=1e9 + t_s,
        t_sim_s=t_s,
        home_lat_deg=FRAME.lat_deg,
        home_lon_deg=FRAME.lon_deg,
        home_alt_amsl_m=FRAME.alt_amsl_m,
        position_enu_m=(east, north, up),
        velocity_enu_m_s=velocity,
        roll_rad=math.radians(roll_deg),
        pitch_rad=math.radians(pitch_deg),
        heading_rad=math.radians(heading_deg),
        armed=True,
    )


def polar(found: list[RadarFrame]) -> np.ndarray:
    """(N, 5) range, azimuth deg, elevation deg, radial speed, SNR dB of all targets."""
    xyz = np.concatenate([rows(f.xyz_m, 3) for f in found]).astype(float)
    more = [np.concatenate([np.frombuffer(getattr(f, key), "<f4") for f in found]).astype(float)
            for key in ("radial_speed_m_s", "snr_db")]  # fmt: skip
    flat = np.hypot(xyz[:, 0], xyz[:, 1])
    azimuth = np.degrees(np.arctan2(xyz[:, 0], xyz[:, 1]))
    return np.column_stack([np.hypot(flat, xyz[:, 2]), azimuth, np.degrees(np.arctan2(xyz[:, 2], flat)), *more])
