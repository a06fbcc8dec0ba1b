"""Layer of the camera's newest points, where they lie in its map."""

from __future__ import annotations

import math

import numpy as np

from server.scene import palette
from server.scene.drawing import Drawing
from server.scene.enu import EnuPlacing
from server.scene.nodes import Node
from telemetry.looks import CloudLook, points_enu_m
from telemetry.perception.showing import MOST_POINTS

POINT_M = 0.12


def cloud_nodes(drawing: Drawing, placing: EnuPlacing, look: CloudLook | None, *, prefix: str) -> list[Node]:
    """Always as long: only places travel, 6 bytes a point."""
    if look is None or not drawing.state.view.show_cloud or not look.points_cm:
        return []
    points = drawing.frame.scene_from_model(placing.model_from_enu(points_enu_m(look)))[:MOST_POINTS]
    middle = points.mean(axis=0)
    at = np.concatenate([points, np.broadcast_to(points[:1], (MOST_POINTS - len(points), 3))]) - middle
    x, y, z = (float(value) for value in middle)
    props = {
        "points": at.astype(np.float16),
        "colors": palette.VISION,
        "point_size": POINT_M * math.sqrt(drawing.frame.exaggeration),
        "point_shape": "circle",
        "position": (x, y, z),
    }
    return [Node(f"{prefix}/cloud", "point_cloud", props)]
