"""Everything that a frame needs, used once before the first one comes: kernels are loaded, or compiled if they must."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from mapping.perceiving.ground import ground_grid
from mapping.sensor_frames import CloudFrame, RadarFrame, RangeFrame, SensorFrame, SlamPose, packed
from telemetry.perception.map_changes import ChangeTeller
from telemetry.perception.perceiver import Perceiver
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.topics.vehicle import VehicleState


def warm_up(kind: SensorKind) -> None:
    """Three frames of a made-up flight over made-up ground."""
    perceiver = Perceiver(kind, run="warm-up", utc_minus_mono_s=0.0)
    fly_past(perceiver, perceiver.work, partial(_frame, kind), frames=3)
    perceiver.tick(lambda: 101.0, feed=True)
    perceiver.perception.accumulate()
    ChangeTeller(kind.sensor, 0.0).changes(perceiver.perception.map, perceiver.where.origin, 101.0)


def fly_past(
    perceiver: Perceiver,
    work: Callable[[Any, Callable[[], float]], object],
    frame: Callable[[float, int], SensorFrame],
    *,
    frames: int,
) -> None:
    """So many frames, ten a second, from a vehicle that hovers over level ground."""
    for number in range(frames):
        t_s = 100.0 + 0.1 * number
        perceiver.on_state(hovering(t_s))
        if perceiver.kind.uses_camera:
            perceiver.on_camera(SlamPose(t_s, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)))
        work(frame(t_s, number), lambda t_s=t_s: t_s)
        perceiver.set_ground(ground_grid(np.zeros((40, 40), np.float32), [[-1.0, 0.0, 20.0], [0.0, 1.0, 20.0]]))


def hovering(t_s: float) -> VehicleState:
    """Over its home, with its nose to the north."""
    return VehicleState(
        1,
        1,
        t_utc_s=t_s,
        armed=True,
        position_t_mono_s=t_s,
        lat_deg=45.0,
        lon_deg=10.0,
        alt_rel_home_m=5.0,
        attitude_t_mono_s=t_s,
        roll_rad=0.0,
        pitch_rad=0.0,
        heading_rad=0.0,
        v_north_m_s=0.0,
        v_east_m_s=0.0,
        v_down_m_s=0.0,
        home_lat_deg=45.0,
        home_lon_deg=10.0,
        home_alt_amsl_m=100.0,
    )


def _frame(kind: SensorKind, t_s: float, number: int) -> SensorFrame:
    if kind.sensor == "ranges":
        return RangeFrame(t_s, t_s, number, "warm-up", (0.0, 0.1), (0.0, 0.0), (6.0, 6.0), (0.0, 0.1), 0.1, 0.2, 40.0)
    xyz = packed(np.repeat([[0.0, 6.0, 1.0], [0.5, 5.0, 0.2]], 50, axis=0))
    if kind.sensor == "vision":
        return CloudFrame(t_s, t_s, number, "warm-up", xyz)
    return RadarFrame(t_s, t_s, number, "warm-up", xyz, packed(np.zeros(100)), packed(np.full(100, 20.0)))
