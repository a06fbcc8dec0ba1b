"""Points as a binary PCD file, which the Point Cloud Library and ROS open."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from mapping.errors import ParameterError
from mapping.voxels.checks import checked_points


def pcd(points_m: ArrayLike, *, probability: ArrayLike) -> bytes:
    """``points_m`` (N, 3), east, north, up of a map's origin, and ``probability`` (N,) of each.

    Both in 32 bits, as the library's own kinds of points are: at 10 km from the origin that is 1 mm. Raises
    ParameterError where the lengths differ.
    """
    points, values = checked_points(points_m), np.asarray(probability)
    if values.shape != (len(points),):
        raise ParameterError(f"{values.shape} where {(len(points),)} belongs.", where="probability")
    header = [
        "# .PCD v0.7 - Point Cloud Data file format",
        "VERSION 0.7",
        "FIELDS x y z probability",
        "SIZE 4 4 4 4",
        "TYPE F F F F",
        "COUNT 1 1 1 1",
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(points)}",
        "DATA binary",
        "",
    ]
    return "\n".join(header).encode() + np.column_stack([points, values]).astype("<f4").tobytes()
