"""A thinned cloud as the arrays that the 3D view draws: in its own colours, else by height."""

from __future__ import annotations

import numpy as np

from mapping.geometry.arrays import F64, U8
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.hillshade import scale_rgb
from server.scene.geometry.payload import PointsScene

_SHADES = 256
_DARKEST, _DARKEST_BELOW_M = 0.45, 10.0
"""What is left of a colour so far below the top of its cell: trunks stand out from crowns, and ground from both."""


def build_points_scene(terrain_id: str, dsm: Dsm, cloud: ThinnedCloud, *, low_m: float, high_m: float) -> PointsScene:
    """``low_m`` and ``high_m``: the heights that the ends of the colour scale mean, as on the model beside it."""
    rgb = cloud.rgb if cloud.rgb is not None else _by_height(dsm, cloud.xyz_m, low_m, high_m)
    return PointsScene(terrain_id, np.asarray(cloud.xyz_m), np.asarray(rgb), cloud.voxel_m)


def _by_height(dsm: Dsm, xyz_m: F64, low_m: float, high_m: float) -> U8:
    """(N, 3) the scale's colour of each height, the darker the farther it is below the model there."""
    share = np.clip((xyz_m[:, 2] - low_m) / max(high_m - low_m, 1e-6), 0.0, 1.0)
    colors = scale_rgb(_SHADES)[np.round(share * (_SHADES - 1)).astype(np.intp)]
    below_m = np.nan_to_num(dsm.elevation_at(xyz_m[:, :2]) - xyz_m[:, 2])
    light = 1.0 - (1.0 - _DARKEST) * np.clip(below_m / _DARKEST_BELOW_M, 0.0, 1.0)
    return np.round(colors * light[:, None]).astype(np.uint8)
