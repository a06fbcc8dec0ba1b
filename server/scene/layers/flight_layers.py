"""Layer of the flight: the sampled path, the legs as they will be flown, take-off, and the place nearest to terrain."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64, U8
from mapping.geometry.polyline import along_m
from planning.report.words import metres
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node
from server.scene.geometry.mark_shapes import GEM, dots_node, label_node, line_node, raised, shape_node
from server.scene.geometry.payload import PlanScene
from server.scene.geometry.stage import Drawing

_PLANNED_PX, _FLOWN_PX = 3.0, 3.0
_MOST_WAYPOINT_MARKS = 1500
_WAYPOINT_PX, _WORST_PX = 6.0, 13.0
_CURTAIN_OPACITY = 0.42
_MOST_AROUND = 50
_WORST_POLE = 6.0
"""In radii of a mark: lifts the words above those of the points of interest."""


def flight_nodes(drawing: Drawing) -> list[Node]:
    plan = drawing.state.plan
    if plan is None or not drawing.state.view.show_path or len(plan.path_m) < 2:
        return []
    parts = (_path, _flown, _around, _takeoff, _worst)
    return [node for part in parts for node in part(drawing, plan)]


def path_clearance_m(plan: PlanScene) -> F64:
    """(N - 1,) of each piece of the path, as the certificate would put it: the smaller of its height above the
    cell below and the distance of the leg that is flown there. A piece never looks safer than its leg."""
    above_m = plan.path_m[:, 2] - plan.path_ground_alt_dsm_m
    above_m = np.where(np.isnan(above_m), -np.inf, above_m)
    piece_m = np.minimum(above_m[:-1], above_m[1:])
    if not len(plan.flown_distance_m):
        return piece_m
    leg_end_s_m = along_m(plan.flown_m[:, :2])[1:]
    middle_s_m = (plan.path_s_m[:-1] + plan.path_s_m[1:]) / 2
    leg = np.minimum(np.searchsorted(leg_end_s_m, middle_s_m), len(leg_end_s_m) - 1)
    return np.minimum(piece_m, plan.flown_distance_m[leg])


def _colors(drawing: Drawing, clearance_m: F64, plan: PlanScene) -> U8:
    rgb = palette.clearance_rgb(clearance_m, plan.required_clearance_m)
    return palette.dimmed(rgb, stale=drawing.state.plan_is_stale)


def _path(drawing: Drawing, plan: PlanScene) -> list[Node]:
    points = drawing.frame.scene_from_model(plan.path_m)
    colors = _colors(drawing, path_clearance_m(plan), plan)
    return [line_node("/path", points, colors, width_px=6.0), *_curtain(drawing, plan, points)]


def _curtain(drawing: Drawing, plan: PlanScene, points: F64) -> list[Node]:
    """A dark veil from the path to the ground: it shows how high the path is, and sets the line off."""
    foot = drawing.on_ground(plan.path_m[:, :2])
    if len(foot) != len(points):
        return []
    foot[:, 2] = np.minimum(foot[:, 2], points[:, 2]) - 4 * drawing.mark_m
    # Browsers draw see-through things in the order of their middles, farthest first. The veil must come before the
    # safe surface that hangs over it, so one vertex without a face drags its middle deep down.
    anchor = np.array([[0.0, 0.0, -4.0 * drawing.frame.half_diagonal_m]])
    vertices = np.concatenate([points, foot, anchor]).astype(np.float32)
    a = np.arange(len(points) - 1)
    b = a + len(points)
    props = {
        "vertices": vertices,
        "faces": np.concatenate([np.column_stack([a, b, a + 1]), np.column_stack([a + 1, b, b + 1])]).astype(np.uint32),
        "color": palette.CURTAIN,
        "opacity": _CURTAIN_OPACITY,
        "side": "double",
        "flat_shading": True,
        "cast_shadow": False,
        "receive_shadow": False,
    }
    return [Node("/curtain", "mesh_simple", props)]


def _flown(drawing: Drawing, plan: PlanScene) -> list[Node]:
    if len(plan.flown_m) < 2:
        return []
    points = drawing.frame.scene_from_model(plan.flown_m)
    nodes = [line_node("/flown", points, _colors(drawing, plan.flown_distance_m, plan), width_px=2.0)]
    if len(points) <= _MOST_WAYPOINT_MARKS:
        rgb = tuple(palette.dimmed(palette.POI, stale=drawing.state.plan_is_stale).tolist())
        nodes.append(dots_node("/waypoints", points, rgb, size_px=_WAYPOINT_PX))
    return nodes


def _around(drawing: Drawing, plan: PlanScene) -> list[Node]:
    """Words where the path begins to turn around a shape of the fence."""
    begins = [k for k, shape in enumerate(plan.around) if k == 0 or plan.around[k - 1] != shape]
    places = drawing.frame.scene_from_model(plan.around_m)
    return [
        label_node(f"/around/{k}", f"around {plan.around[k]}", raised(places[k], 1.6 * drawing.mark_m))
        for k in begins[:_MOST_AROUND]
    ]


def _takeoff(drawing: Drawing, plan: PlanScene) -> list[Node]:
    foot, top = plan.home_m, np.array([plan.home_m[0], plan.home_m[1], plan.takeoff_alt_dsm_m])
    if not np.isfinite([foot, top]).all():
        return []
    column = drawing.frame.scene_from_model(np.stack([foot, top]))
    return [line_node("/takeoff", column, palette.HOME, width_px=3.0)]


def _worst(drawing: Drawing, plan: PlanScene) -> list[Node]:
    if not np.isfinite(plan.worst_m).all() or not len(plan.flown_distance_m):
        return []
    at = drawing.frame.scene_from_model(plan.worst_m)
    top = raised(at, _WORST_POLE * drawing.mark_m)
    nearest_m = float(np.min(plan.flown_distance_m))
    color = tuple(_colors(drawing, np.array([nearest_m]), plan)[0].tolist())
    return [
        line_node("/worst_pole", np.stack([at, top]), color, width_px=4.0),
        shape_node("/worst", GEM, at, drawing.body_m, color),
        dots_node("/worst_dot", at[None], color, size_px=_WORST_PX),
        # To the right of its pole: seen from above the label of a point of interest may stand on the same place.
        label_node("/worst_label", _distance_words(nearest_m), top, anchor="center-left"),
    ]


def _distance_words(nearest_m: float) -> str:
    if not math.isfinite(nearest_m):
        return "Unknown terrain"
    return f"Nearest {metres(nearest_m)}" if nearest_m > 0 else "Inside terrain"


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
