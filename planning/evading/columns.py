"""What a sensor has seen that does not tell how high things are: they stand on the ground, and may be higher than seen.

A forward-looking radar puts all it sees at its own height (Miccinesi 2022, eqs 4-5 and fig. 15): a thing is at least as
high as the vehicle was, and up to where the radar's gate ends when the vehicle still sees it at its present height.
"""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from planning.evading.keep_clear import Seen

REACH_UP = math.tan(math.radians(20.0))
"""Of the distance: the upper edge of the radar's usual gate in elevation."""
DEEP_M = 100.0
"""Below the vehicle and all voxels: deep enough for any ground."""


def standing(seen: Seen, position_enu_m: F64, *, reach_up: float = REACH_UP) -> Seen:
    """Voxels as columns from the ground up, one for each place; ``position_enu_m`` (3,) is where the vehicle is now.

    ``reach_up``: the upper edge of the gate that it was seen through, as a slope. A column that has no voxel at the
    vehicle's height or above was looked at from above its top, and ends there.
    """
    edge_m = seen.resolution_m
    centres = np.asarray(seen.centres_enu_m, np.float64).reshape(-1, 3)
    if not len(centres):
        return seen
    keys, column = np.unique(np.floor(centres[:, :2] / edge_m).astype(np.int64), axis=0, return_inverse=True)
    top_m = np.full(len(keys), -np.inf)
    np.maximum.at(top_m, column.ravel(), centres[:, 2])
    middles = (keys + 0.5) * edge_m
    is_open = top_m >= position_enu_m[2] - edge_m
    away_m = np.hypot(*(middles - position_enu_m[:2]).T)
    high_m = top_m + edge_m / 2 + np.where(is_open, reach_up * away_m, 0.0)
    low_m = min(float(centres[:, 2].min()), float(position_enu_m[2])) - DEEP_M
    solid = np.column_stack([middles, (low_m + high_m) / 2]).astype(np.float64)
    return Seen(solid, edge_m, half_up_m=(high_m - low_m) / 2, is_open=is_open)
