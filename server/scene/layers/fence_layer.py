"""The layer of the plan's fence and rally points: outlines over the terrain, with what each is in words."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.frames import moved_deg
from server.scene.geometry import palette
from server.scene.geometry.canvas import Node, Ready
from server.scene.geometry.mark_shapes import CONE, dots_node, label_node, line_node, shape_node
from server.scene.geometry.stage import Drawing
from server.scene.layers.mark_layers import above, outline, points_nodes, selected_nodes, smoothed
from server.schemas import FenceCircleDoc, PlaceDoc, PlanDoc

_LINE_PX, _DOT_PX = 4.0, 8.0
_ROUND = 24
"""Corners of a circle as it is drawn."""


def mark_places(drawing: Drawing) -> tuple[list[str], F64]:
    """Marks and (N, 3) scene places of all that can be dragged."""
    marks = _marks(drawing.state.document)
    xy = drawing.places_xy_m([place for _, place in marks])
    names = [mark for (mark, _), at in zip(marks, xy, strict=True) if np.isfinite(at).all()]
    return names, drawing.on_ground(xy)


def fence_nodes(drawing: Drawing, moved: Ready) -> list[Node]:
    """The selected corner, centre or rally point has handles."""
    nodes = [node for shape in _shapes(drawing) for node in shape]
    marks, places = mark_places(drawing)
    chosen = drawing.state.selection.fence_mark
    others = [index for index, mark in enumerate(marks) if mark != chosen]
    if others:
        nodes += points_nodes("/fence_corners", places[others], drawing, palette.FENCE)
    if chosen in marks:
        nodes += selected_nodes(drawing, "", places[marks.index(chosen)], moved)
    return [*nodes, *_rally(drawing), *_draft(drawing)]


def _marks(document: PlanDoc) -> list[tuple[str, PlaceDoc]]:
    """All that can be dragged."""
    corners = [(f"{p.id}.{k}", corner) for p in document.fence.polygons for k, corner in enumerate(p.corners)]
    centres = [(each.id, each.centre) for each in document.fence.circles]
    return [*corners, *centres, *((r.id, PlaceDoc(lat_deg=r.lat_deg, lon_deg=r.lon_deg)) for r in document.rally)]


def _shapes(drawing: Drawing) -> Iterator[list[Node]]:
    fence = drawing.state.document.fence
    for number, polygon in enumerate(fence.polygons, start=1):
        yield _outlined(drawing, polygon.id, polygon.corners, _words(polygon.inclusion, "polygon", number))
    for number, circle in enumerate(fence.circles, start=1):
        yield _outlined(drawing, circle.id, _round(circle), _words(circle.inclusion, "circle", number))


def _words(inclusion: bool, kind: str, number: int) -> str:
    return f"{'Stay inside' if inclusion else 'Keep out'}: {kind} {number}"


def _outlined(drawing: Drawing, shape_id: str, corners: list[PlaceDoc], words: str) -> list[Node]:
    places = drawing.places_xy_m(corners)
    places = places[np.isfinite(places).all(axis=1)]
    if len(places) < 3:
        return []
    is_chosen = (drawing.state.selection.fence_mark or "").partition(".")[0] == shape_id
    color = palette.ACCENT if is_chosen else palette.FENCE
    line = smoothed(drawing.on_ground(outline(places)), 0.4 * drawing.mark_m)
    northern = line[int(np.argmax(line[:, 1]))]
    return [
        line_node(f"/fence/{shape_id}", line, color, width_px=_LINE_PX),
        label_node(f"/fence_label/{shape_id}", words, northern + above(drawing)),
    ]


def _round(circle: FenceCircleDoc) -> list[PlaceDoc]:
    """Corners on the circle, near enough for drawing."""
    turns = np.linspace(0.0, 2 * np.pi, _ROUND, endpoint=False)
    offsets_m = circle.radius_m * np.column_stack([np.sin(turns), np.cos(turns)])
    centre = circle.centre.lat_deg, circle.centre.lon_deg
    places = [moved_deg(centre, east_m, north_m) for east_m, north_m in offsets_m.tolist()]
    # Not checked: a circle at a pole may reach beyond it.
    return [PlaceDoc.model_construct(lat_deg=lat_deg, lon_deg=lon_deg) for lat_deg, lon_deg in places]


def _rally(drawing: Drawing) -> Iterator[Node]:
    for number, point in enumerate(drawing.state.document.rally, start=1):
        at = drawing.ground_of(point)
        if at is not None:
            yield shape_node(f"/rally/{point.id}", CONE, at, drawing.body_m, palette.FENCE)
            yield label_node(f"/rally_label/{point.id}", f"Rally point {number}", at + 2.4 * above(drawing))


def _draft(drawing: Drawing) -> list[Node]:
    """Corners that are no polygon yet."""
    places = drawing.on_ground(drawing.places_xy_m(drawing.state.selection.draft))
    if not len(places):
        return []
    nodes = [dots_node("/fence_draft", places, palette.ACCENT, size_px=_DOT_PX)]
    return nodes if len(places) < 2 else [*nodes, line_node("/fence_draft_line", places, palette.ACCENT, width_px=3.0)]
