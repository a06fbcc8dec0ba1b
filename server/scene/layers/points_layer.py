"""The cloud that a surface model was made of, as points in the model's place."""

from __future__ import annotations

import numpy as np

from server.scene.geometry.canvas import Node
from server.scene.geometry.payload import PointsScene
from server.scene.geometry.stage import Drawing

_SIZE_SHARE = 1.1
"""Of a voxel's edge: points of level ground nearly close up, those of a mast stand apart."""
_LEAST_M = 0.03


def points_nodes(drawing: Drawing) -> list[Node]:
    points = drawing.points
    if points is None:
        return []
    frame = drawing.frame
    # Stretched by the browser: another exaggeration sends no point again.
    origin_m = np.array([frame.centre_x_m, frame.centre_y_m, frame.reference_alt_dsm_m])
    props = {
        "points": (points.points_m - origin_m).astype(np.float32),
        "colors": points.rgb,
        "point_size": _size_m(points),
        "point_shape": "circle",
        "point_shading": "flat",
        "precision": "float32",
        "scale": (1.0, 1.0, frame.exaggeration),
    }
    return [Node("/points", "point_cloud", props)]


def _size_m(points: PointsScene) -> float:
    return max(_LEAST_M, _SIZE_SHARE * points.voxel_m)
