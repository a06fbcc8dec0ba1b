"""Layer of a recorded flight: the line that was planned, and the one that was flown."""

from __future__ import annotations

from server.scene import palette
from server.scene.drawing import Drawing
from server.scene.nodes import Node
from server.scene.shapes import line_node

_PLANNED_PX, _FLOWN_PX = 3.0, 3.0


def review_nodes(drawing: Drawing) -> list[Node]:
    review = drawing.state.review
    if review is None:
        return []
    lines = (
        ("/recorded_plan", review.planned_m, palette.RECORDED_PLAN, _PLANNED_PX),
        ("/recorded_flight", review.flown_m, palette.REPLAY_NOSE, _FLOWN_PX),
    )
    return [
        line_node(name, drawing.frame.scene_from_model(points_m), color, width_px=width_px)
        for name, points_m, color, width_px in lines
        if len(points_m) >= 2
    ]
