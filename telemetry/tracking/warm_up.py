"""Everything that a frame needs, used once before the first one comes: kernels are loaded, or compiled if they must."""

from __future__ import annotations

import numpy as np

from mapping.ground import ground_grid
from telemetry.perception.warm_up import hovering
from telemetry.sensing import RadarFrame, packed
from telemetry.tracking.following import Following


def warm_up() -> None:
    """An object flies past a vehicle that hovers, over made-up ground: seen, followed, dangerous."""
    following = Following(run="warm-up", utc_minus_mono_s=0.0)
    ground = ground_grid(np.zeros((40, 40), np.float32), [[-1.0, 0.0, 20.0], [0.0, 1.0, 20.0]])
    for number in range(8):
        t_s = 100.0 + 0.1 * number
        following.perceiver.on_state(hovering(t_s))
        following.work(_frame(t_s, number), lambda t_s=t_s: t_s)
        following.perceiver.set_ground(ground)
    following.tick(lambda: 101.0)


def _frame(t_s: float, number: int) -> RadarFrame:
    xyz, speed = [[0.0, 20.0 - 0.4 * number, 0.5], [5.0, 12.0, 0.5]], [-4.0, 0.0]
    columns = (packed(np.array(xyz)), packed(np.array(speed)), packed(np.full(2, 45.0)))
    return RadarFrame(t_s, t_s, number, "warm-up", *columns)
