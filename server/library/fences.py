"""Fence and rally points of a plan document: to planning's own types and back, and what clicks and drags make of them.

A mark is a shape or a rally point by its id, or a polygon's corner: its number, counted from 0, after a dot.
"""

from __future__ import annotations

from collections.abc import Sequence

from planning.fence.fence_model import NO_FENCE, Fence, LatLon, RallyPoint, circle, fence, polygon
from planning.formats.fence_files import write_fence
from planning.formats.fence_items import rally_point
from server.errors import NotReadyError
from server.library.whole_files import new_id
from server.schemas import (
    FenceCircleDoc,
    FenceDoc,
    FencePolygonDoc,
    PlaceDoc,
    PlanDoc,
    RallyDoc,
    SelectionDoc,
)

WHERE = "The plan's fence"
FIRST_RADIUS_M = 20.0
Made = tuple[str, PlanDoc, SelectionDoc]
"""(undo label, new document, new selection)"""


def fence_from_doc(document: PlanDoc) -> tuple[Fence, tuple[RallyPoint, ...]]:
    """Raises FormatError for a shape that encloses nothing or crosses itself, and for a floor above the ceiling."""
    doc = document.fence
    polygons = [
        polygon([_lat_lon(c) for c in each.corners], inclusion=each.inclusion, where=f"{WHERE}, polygon {number}")
        for number, each in enumerate(doc.polygons, start=1)
    ]
    circles = [
        circle(*_lat_lon(each.centre), each.radius_m, inclusion=each.inclusion, where=f"{WHERE}, circle {number}")
        for number, each in enumerate(doc.circles, start=1)
    ]
    shapes = fence(
        polygons,
        circles,
        floor_rel_home_m=doc.floor_rel_home_m,
        ceiling_rel_home_m=doc.ceiling_rel_home_m,
        where=WHERE,
    )
    rally = (
        rally_point(each.lat_deg, each.lon_deg, each.alt_rel_home_m, f"Rally point {number}")
        for number, each in enumerate(document.rally, start=1)
    )
    return shapes, tuple(rally)


def with_fence(document: PlanDoc, shapes: Fence, rally: Sequence[RallyPoint]) -> PlanDoc:
    """The document with these in place of its own."""
    polygons = [
        FencePolygonDoc(id=new_id(), inclusion=p.inclusion, corners=[_place(c) for c in p.corners_lat_lon_deg])
        for p in shapes.polygons
    ]
    circles = [
        FenceCircleDoc(id=new_id(), inclusion=c.inclusion, centre=_place(c.centre_lat_lon_deg), radius_m=c.radius_m)
        for c in shapes.circles
    ]
    doc = FenceDoc(
        polygons=polygons,
        circles=circles,
        floor_rel_home_m=shapes.floor_rel_home_m,
        ceiling_rel_home_m=shapes.ceiling_rel_home_m,
    )
    points = [
        RallyDoc(id=new_id(), lat_deg=p.lat_deg, lon_deg=p.lon_deg, alt_rel_home_m=p.alt_rel_home_m) for p in rally
    ]
    return document.model_copy(update={"fence": doc, "rally": points})


def clicked_polygon(document: PlanDoc, selection: SelectionDoc, place: PlaceDoc) -> Made | None:
    """One more corner, after the selected one of a selected polygon; three make a new one, which is kept out of.

    None: the corner before stands there already.
    """
    for number, shape in enumerate(document.fence.polygons, start=1):
        shape_id, _, corner = (selection.fence_mark or "").partition(".")
        if shape.id != shape_id:
            continue
        at = min(int(corner) + 1 if corner.isdecimal() else len(shape.corners), len(shape.corners))
        if shape.corners[:at][-1:] == [place]:
            return None
        corners = [*shape.corners[:at], place, *shape.corners[at:]]
        label, chosen = f"Add corner to polygon {number}", f"{shape_id}.{at}"
        return label, _with_corners(document, shape_id, corners), _chosen(selection, chosen)
    if selection.draft[-1:] == [place]:
        return None
    corners = [*selection.draft, place]
    if len(corners) < 3:
        return "", document, _chosen(selection, None).model_copy(update={"draft": corners})
    shape = FencePolygonDoc(id=new_id(), inclusion=False, corners=corners)
    label = f"Add polygon {len(document.fence.polygons) + 1}"
    polygons = [*document.fence.polygons, shape]
    return label, _with(document, polygons=polygons), _chosen(selection, f"{shape.id}.2")


def clicked_circle(document: PlanDoc, selection: SelectionDoc, place: PlaceDoc) -> Made:
    shape = FenceCircleDoc(id=new_id(), inclusion=False, centre=place, radius_m=FIRST_RADIUS_M)
    label = f"Add circle {len(document.fence.circles) + 1}"
    chosen = _chosen(selection, shape.id).model_copy(update={"tool": "select"})
    return label, _with(document, circles=[*document.fence.circles, shape]), chosen


def clicked_rally(document: PlanDoc, selection: SelectionDoc, place: PlaceDoc) -> Made:
    """As high as the vehicle returns."""
    height_m = document.profile.rtl_height_m
    point = RallyDoc(id=new_id(), lat_deg=place.lat_deg, lon_deg=place.lon_deg, alt_rel_home_m=height_m)
    label = f"Add rally point {len(document.rally) + 1}"
    chosen = _chosen(selection, point.id).model_copy(update={"tool": "select"})
    return label, document.model_copy(update={"rally": [*document.rally, point]}), chosen


def moved_mark(document: PlanDoc, mark: str, place: PlaceDoc) -> tuple[str, PlanDoc] | None:
    """None when there is no such mark any more; a whole polygon moves by its corners."""
    mark_id, _, corner = mark.partition(".")
    for number, shape in enumerate(document.fence.polygons, start=1):
        if shape.id == mark_id and corner.isdecimal() and int(corner) < len(shape.corners):
            corners = [place if at == int(corner) else each for at, each in enumerate(shape.corners)]
            return f"Move corner of polygon {number}", _with_corners(document, mark_id, corners)
    for number, round_ in enumerate(document.fence.circles, start=1):
        if round_.id == mark_id:
            there = round_.model_copy(update={"centre": place})
            circles = [there if each is round_ else each for each in document.fence.circles]
            return f"Move circle {number}", _with(document, circles=circles)
    for number, point in enumerate(document.rally, start=1):
        if point.id == mark_id:
            there = point.model_copy(update={"lat_deg": place.lat_deg, "lon_deg": place.lon_deg})
            rally = [there if each is point else each for each in document.rally]
            return f"Move rally point {number}", document.model_copy(update={"rally": rally})
    return None


def written_fence(document: PlanDoc, file: str) -> bytes:
    """Raises NotReadyError without a fence, FormatError for one that is none."""
    shapes, rally = fence_from_doc(document)
    if file == "fence.waypoints":
        rally = ()
    if file == "rally.waypoints":
        shapes = NO_FENCE
    if not shapes and not rally:
        what = "rally points" if file == "rally.waypoints" else "fence"
        raise NotReadyError(f"The plan has no {what} to export.", advice="Draw some under Fence, or import a file.")
    return write_fence(file, shapes, rally, firmware=document.profile.firmware).encode()


def _with(document: PlanDoc, **fields: object) -> PlanDoc:
    return document.model_copy(update={"fence": document.fence.model_copy(update=fields)})


def _with_corners(document: PlanDoc, shape_id: str, corners: list[PlaceDoc]) -> PlanDoc:
    polygons = [
        each.model_copy(update={"corners": corners}) if each.id == shape_id else each
        for each in document.fence.polygons
    ]
    return _with(document, polygons=polygons)


def _chosen(selection: SelectionDoc, mark: str | None) -> SelectionDoc:
    return selection.model_copy(update={"fence_mark": mark, "poi_id": None, "draft": []})


def _lat_lon(place: PlaceDoc) -> LatLon:
    return place.lat_deg, place.lon_deg


def _place(lat_lon_deg: LatLon) -> PlaceDoc:
    return PlaceDoc(lat_deg=lat_lon_deg[0], lon_deg=lat_lon_deg[1])
