"""The simulated UWB radar beside what the paper measured with the real one: Table II and fig. 6."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from mapping.uwb.sensor_model import bin_ranges, power_scaler
from mapping.uwb.thresholds import Learning, Thresholds
from mapping.uwb.uwb_params import UwbParams
from telemetry.simulation.simulator.sensors.uwb import UwbModel, UwbRadar
from telemetry.simulation.simulator.sensors.uwb_scene import TABLE_II, Foliage, Target, screen, uwb_scene

PRINTED = {
    "Metal Jerry": 0.8000, "Large reflector": 0.8000, "Plastic Jerry": 0.7999, "Plywood": 0.7996, "3 bricks": 0.7950,
    "2 bricks": 0.5346, "Stone": 0.4606, "Cardboard box": 0.4606,
}  # fmt: skip
TABLE_M, BRICKS_M, LEAVES_M = 10.0, 9.0, 8.0
BRICKS_M2, BRICKS_WIDE_M, LEAVES_WIDE_M = 1.5, 0.33, 1.2
LEARNT_SCANS, EVERY_M = 3000, 0.1


@dataclass(frozen=True, slots=True)
class Layer:
    """One curve of fig. 6: counts over T_d of the foliage and of the bricks behind it."""

    layers: int
    leaves: float
    bricks: float
    leaves_limit: float
    """T_max - T_d where the foliage stands."""


def lawn_thresholds(seed: int) -> Thresholds:
    """Learnt on a drive over an empty lawn."""
    radar = UwbRadar(uwb_scene(()), seed)
    learning = Learning(radar.model.geometry.bins)
    for k in range(LEARNT_SCANS):
        learning.take(radar.scan(0.0, k * EVERY_M, 0.0))
    return learning.thresholds(UwbParams().least_headroom)


def table_ii(thresholds: Thresholds) -> dict[str, float]:
    """P(z|occ) of each thing 10 m straight ahead.

    The cardboard box reflects nothing, so that its row is what the ground under the paper's things returned: that
    much, 0.10 of T_max - T_d, stands under ours as well. All other rows follow from the printed cross sections.
    """
    params = UwbParams()
    at = _bin(TABLE_M)
    headroom = thresholds.highest - thresholds.detection
    share = PRINTED["Cardboard box"] / params.most_occupied
    ground = headroom * math.log(share / (1.0 - share)) / params.above_scale
    out: dict[str, float] = {}
    for name, (cross_section_m2, breadth_m, height_m) in TABLE_II.items():
        radius_m = breadth_m / 2.0
        thing = Target(name, (0.0, TABLE_M + radius_m), radius_m, height_m, cross_section_m2, solid=False)
        over = ground + _answers((thing,))
        out[name] = float(power_scaler(over, thresholds, params)[at]) * params.most_occupied
    return out


def fig_6(thresholds: Thresholds, most_layers: int = 5) -> list[Layer]:
    """Three bricks at 9 m, branches at 8 m, layer by layer."""
    radius_m = BRICKS_WIDE_M / 2.0
    bricks = Target("3 bricks", (0.0, BRICKS_M + radius_m), radius_m, 0.23, BRICKS_M2, solid=False)
    near_leaves, near_bricks = _around(LEAVES_M), _around(BRICKS_M)
    limit = float((thresholds.highest - thresholds.detection)[_bin(LEAVES_M)])
    out = []
    for layers in range(most_layers + 1):
        branches = screen((0.0, LEAVES_M), LEAVES_WIDE_M, 0.8, layers) if layers else ()
        over = _answers((bricks,), branches)
        out.append(Layer(layers, float(over[near_leaves].max()), float(over[near_bricks].max()), limit))
    return out


def _answers(things: Sequence[Target], branches: Sequence[Foliage] = ()) -> F64:
    """(bins,) Counts of a still scene, the faces toward the radar that were measured."""
    model = replace(UwbModel(), aspects=0)
    return model.answer(UwbRadar(uwb_scene(things, branches), 0, model).echoes(0.0, 0.0, 0.0))


def _bin(range_m: float) -> int:
    return int(np.argmin(np.abs(bin_ranges(UwbModel().geometry) - range_m)))


def _around(range_m: float) -> slice:
    return slice(_bin(range_m) - 1, _bin(range_m) + 2)
