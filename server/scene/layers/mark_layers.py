"""Layers of what the operator placed: points of interest, home, the look-at point, the survey polygon."""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from mapping.geometry.arrays import F64
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node, Ready
from server.scene.geometry.mark_shapes import BALL, CONE, Rgb, dots_node, label_node, line_node, many_node, shape_node
from server.scene.geometry.stage import Drawing

GIZMO = "/gizmo"
"""The selected point of interest hangs below it, so that browsers move it with the pointer themselves."""
_GIZMO_PX = 130.0
_MOST_LABELS = 150
_POINT_PX, _SELECTED_PX = 9.0, 11.0
_EDGE_POINTS = 48
_SAME_PLACE_M = 0.2
"""Beyond it home has a mark of its own."""


def poi_places(drawing: Drawing) -> tuple[list[str], F64]:
    """Ids and (P, 3) scene places of the points of interest that are drawn: none while a survey is planned."""
    document = drawing.state.document
    pois = document.pois if document.source == "pois" else []
    xy = drawing.places_xy_m(pois)
    ids = [poi.id for poi, place in zip(pois, xy, strict=True) if np.isfinite(place).all()]
    return ids, drawing.on_ground(xy)


def poi_nodes(drawing: Drawing, moved: Ready) -> list[Node]:
    """Balls with labels; the selected one in the accent colour, with handles that move it over the ground."""
    ids, places = poi_places(drawing)
    chosen = drawing.state.selection.poi_id
    others = [index for index, poi_id in enumerate(ids) if poi_id != chosen]
    nodes = points_nodes("/pois", places[others], drawing, palette.POI) if others else []
    for index, poi_id in enumerate(ids):
        if poi_id == chosen:
            nodes += selected_nodes(drawing, _label(drawing, poi_id), places[index], moved)
        elif len(ids) <= _MOST_LABELS:
            nodes.append(label_node(f"/poi_label/{poi_id}", _label(drawing, poi_id), places[index] + above(drawing)))
    return nodes


def points_nodes(name: str, places: F64, drawing: Drawing, color: Rgb) -> list[Node]:
    """Balls for who is near, dots for who is far."""
    return [
        many_node(name, BALL, places, drawing.body_m, color),
        dots_node(f"{name}_dots", places, color, size_px=_POINT_PX),
    ]


def selected_nodes(drawing: Drawing, text: str, at: F64, moved: Ready) -> list[Node]:
    """In the accent colour, with handles while nothing else is in hand."""
    origin = np.zeros(3)
    if drawing.state.selection.tool == "select":
        return [
            _gizmo(at, moved),
            shape_node(f"{GIZMO}/ball", BALL, origin, drawing.body_m, palette.ACCENT),
            dots_node(f"{GIZMO}/dot", origin[None], palette.ACCENT, size_px=_SELECTED_PX),
            label_node(f"{GIZMO}/label", text, 2 * above(drawing), size=1.15),
        ]
    return [
        shape_node("/selected", BALL, at, drawing.body_m, palette.ACCENT),
        dots_node("/selected_dot", at[None], palette.ACCENT, size_px=_SELECTED_PX),
        label_node("/selected_label", text, at + above(drawing), size=1.15),
    ]


def _gizmo(at: F64, moved: Ready) -> Node:
    far = (-1e6, 1e6)
    props = {
        "position": (float(at[0]), float(at[1]), float(at[2])),
        "scale": _GIZMO_PX,
        "fixed": True,
        "active_axes": (True, True, False),
        "disable_rotations": True,
        # Red and green arrows would speak of safety.
        "disable_axes": True,
        "translation_limits": (far, far, far),
        "depth_test": False,
    }
    return Node(GIZMO, "transform_controls", props, ready=moved)


def _label(drawing: Drawing, poi_id: str) -> str:
    """Number in flying order and name; the number alone where the name repeats it."""
    number, poi = next((n, p) for n, p in enumerate(drawing.state.document.pois, 1) if p.id == poi_id)
    text = f"{number}  {poi.name}" if poi.name not in ("", str(number), f"P{number}") else poi.name or str(number)
    return f"{text}  (home)" if number == 1 and is_first_home(drawing) else text


def is_first_home(drawing: Drawing) -> bool:
    """Whether the plan begins at its first point: a plan without a home may have put it beside."""
    document, plan = drawing.state.document, drawing.state.plan
    if document.home is not None or document.source != "pois":
        return False
    if plan is None or not document.pois:
        return True
    first = drawing.places_xy_m(document.pois[:1])[0]
    return bool(np.hypot(*(first - plan.home_m[:2])) < _SAME_PLACE_M)


def above(drawing: Drawing) -> F64:
    return np.array([0.0, 0.0, 1.6 * drawing.mark_m])


def place_nodes(drawing: Drawing) -> list[Node]:
    return [*_home(drawing), *_look_at(drawing), *_polygon(drawing)]


def _home(drawing: Drawing) -> list[Node]:
    """Home as set, or where the computed plan begins; a first point that is home says so in its label."""
    home, plan = drawing.state.document.home, drawing.state.plan
    if home is not None:
        at = drawing.ground_of(home)
    elif plan is not None and not is_first_home(drawing):
        at = drawing.on_ground(plan.home_m[None, :2])[0]
    else:
        at = None
    if at is None:
        return []
    return [
        shape_node("/home", CONE, at, 1.2 * drawing.body_m, palette.HOME),
        dots_node("/home_dot", at[None], palette.HOME, size_px=_POINT_PX),
        label_node("/home_label", "Home", at + 2.4 * above(drawing)),
    ]


def _look_at(drawing: Drawing) -> list[Node]:
    mission = drawing.state.document.mission
    at = None if mission.look_at is None or mission.heading != "point" else drawing.ground_of(mission.look_at)
    if at is None:
        return []
    post = np.stack([at, at + 4 * above(drawing)])
    return [
        line_node("/look_at", post, palette.LOOK_AT, width_px=3.0),
        shape_node("/look_at_ball", BALL, post[1], 0.8 * drawing.mark_m, palette.LOOK_AT),
        label_node("/look_at_label", "Look at", post[1] + above(drawing)),
    ]


def _polygon(drawing: Drawing) -> list[Node]:
    """The survey's outline laid over the terrain."""
    document = drawing.state.document
    corners = drawing.places_xy_m(document.survey.polygon)
    corners = corners[np.isfinite(corners).all(axis=1)]
    if document.source != "survey" or not len(corners):
        return []
    nodes = points_nodes("/polygon_corners", drawing.on_ground(corners), drawing, palette.SURVEY)
    if len(corners) > 1:
        line = smoothed(drawing.on_ground(outline(corners)), 0.3 * drawing.mark_m)
        nodes.append(line_node("/polygon", line, palette.SURVEY, width_px=4.0))
    return nodes


def outline(corners: F64) -> F64:
    """(N, 2) a ring through the corners, fine enough to follow the terrain."""
    ring = np.vstack([corners, corners[:1]]) if len(corners) > 2 else corners
    share = np.linspace(0.0, 1.0, _EDGE_POINTS, endpoint=False)[None, :, None]
    pieces = ring[:-1, None] + share * (ring[1:] - ring[:-1])[:, None]
    return np.vstack([pieces.reshape(-1, 2), ring[-1:]])


def smoothed(line: F64, lift: float) -> F64:
    """A line over the terrain that jumps over its roughness instead of tracing it."""
    above = ndimage.maximum_filter1d(line[:, 2], 7, mode="nearest")
    return np.column_stack([line[:, :2], ndimage.uniform_filter1d(above, 5, mode="nearest") + lift])


def cursor_nodes(drawing: Drawing, at_m: F64) -> list[Node]:
    """The hovered place, (3,) x, y, alt_dsm, with a plumb line to the ground."""
    at = drawing.frame.scene_from_model(at_m)
    foot = drawing.on_ground(at_m[None, :2])[0]
    return [
        shape_node("/cursor", BALL, at, 0.8 * drawing.mark_m, palette.ACCENT),
        line_node("/cursor_plumb", np.stack([foot, at]), palette.ACCENT, width_px=2.0),
    ]
