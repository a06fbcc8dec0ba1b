"""Where a plan's path leads, seen from above: from home over the points, around what its fence forbids."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import Home, Poi
from planning.errors import PoiError
from planning.fence.fence_model import LatLon
from planning.planner.request import PlanRequest
from planning.route.around_fence import Kept, LaidLeg, laid_legs
from planning.route.path import MIN_SEGMENT_M
from planning.route.poi import poi_label
from planning.route.survey_fenced import fenced_lines, lines_m
from planning.terrain.dsm import SurfaceModel

LEAST_LOST_M = 0.1
NAMED = 4
"""Shapes in one sentence."""


@dataclass(frozen=True, slots=True)
class Detour:
    """A point of the path that was put in to keep to the fence: no photo of its own, no waiting."""

    lat_deg: float
    lon_deg: float
    shape: str
    """ "exclusion polygon 2": around it, or along its edge from within if it is an inclusion."""
    before_poi: int
    """Index of the point that the leg leads to."""


@dataclass(frozen=True, slots=True)
class Route:
    vertices_xy_m: F64
    """(V, 2) in the model's CRS: home if it is no point itself, the points, and between them those of detours."""
    vertex_poi: tuple[int | None, ...]
    """(V,) None for home and detours."""
    detours: tuple[Detour, ...] = ()
    """In the order in which they are flown."""
    pois: tuple[Poi, ...] = ()
    """The points asked for; of a survey the ends of what the fence leaves of its lines."""
    notes: tuple[str, ...] = ()


def laid_route(model: SurfaceModel, request: PlanRequest, home: Home) -> Route:
    """Raises PoiError that names every point where the fence lets nobody be."""
    if not has_shapes(request):
        return _straight(model, request, home)
    kept = _kept(model, request, (home.lat_deg, home.lon_deg))
    if request.survey is not None:
        request = replace(request, pois=fenced_lines(model, request.pois, kept, ways_back=True))
    straight = _straight(model, request, home)
    laid = laid_legs(model, straight.vertices_xy_m, kept)
    problems = [
        f"{poi_label(poi, request.pois[poi])} {wrong}"
        for poi, wrong in zip(straight.vertex_poi, laid.forbidden, strict=True)
        if poi is not None and wrong
    ]
    if problems:
        raise PoiError(" ".join(problems), where="points of interest" if len(problems) > 1 else "")
    return _with_detours(model, request, straight, laid.legs)


def has_shapes(request: PlanRequest) -> bool:
    return bool(request.fence.polygons or request.fence.circles)


def before_home(model: SurfaceModel, request: PlanRequest) -> PlanRequest:
    """A survey's lines cut where nobody may be, so that home can be put at the first of them."""
    if request.survey is None or not has_shapes(request):
        return request
    first = request.home_lat_lon_deg or (request.pois[0].lat_deg, request.pois[0].lon_deg)
    return replace(request, pois=fenced_lines(model, request.pois, _kept(model, request, first), ways_back=False))


def home_place(model: SurfaceModel, home: Home) -> F64:
    """(1, 2) projected."""
    return model.xy_from_lat_lon(np.array([(home.lat_deg, home.lon_deg)]))


def _kept(model: SurfaceModel, request: PlanRequest, home_lat_lon_deg: LatLon) -> Kept:
    clearance = request.clearance_over(model)
    return Kept(
        fence=request.fence,
        home_lat_lon_deg=home_lat_lon_deg,
        rally=request.rally,
        margin_m=clearance.fence_margin_m,
        from_edge_m=clearance.required_clearance_m,
    )


def _straight(model: SurfaceModel, request: PlanRequest, home: Home) -> Route:
    xy_m = model.xy_from_lat_lon(np.array([(p.lat_deg, p.lon_deg) for p in request.pois]))
    home_xy_m = home_place(model, home)
    poi_index: tuple[int | None, ...] = tuple(range(len(xy_m)))
    if np.hypot(*(home_xy_m[0] - xy_m[0])) < max(request.path.step_m, MIN_SEGMENT_M):
        return Route(xy_m, poi_index, pois=request.pois)
    return Route(np.vstack([home_xy_m, xy_m]), (None, *poi_index), pois=request.pois)


def _with_detours(model: SurfaceModel, request: PlanRequest, straight: Route, legs: tuple[LaidLeg, ...]) -> Route:
    vertices, index, detours = [straight.vertices_xy_m[:1]], [straight.vertex_poi[0]], []
    notes = _lost_words(model, request)
    ends = zip(pairwise(straight.vertex_poi), straight.vertices_xy_m[1:], legs, strict=True)
    for (from_poi, to_poi), to_xy_m, leg in ends:
        assert to_poi is not None
        vertices += [leg.corners_xy_m, to_xy_m[None]]
        index += [*[None] * len(leg.shapes), to_poi]
        places = model.lat_lon_from_xy(leg.corners_xy_m).tolist()
        detours += [Detour(lat, lon, shape, to_poi) for (lat, lon), shape in zip(places, leg.shapes, strict=True)]
        if leg.closed_by:
            begins = "home" if from_poi is None else poi_label(from_poi, request.pois[from_poi])
            notes.append(_closed_words(begins, poi_label(to_poi, request.pois[to_poi]), leg.closed_by))
    return Route(np.vstack(vertices), tuple(index), tuple(detours), request.pois, tuple(notes))


def _lost_words(model: SurfaceModel, request: PlanRequest) -> list[str]:
    """What a survey loses to its fence."""
    if request.survey is None:
        return []
    whole_m, left_m = lines_m(model, request.survey.pois), lines_m(model, request.pois)
    if whole_m - left_m < LEAST_LOST_M:
        return []
    return [f"The fence leaves {left_m:.0f} m of the survey's {whole_m:.0f} m of lines; the rest is not photographed."]


def _closed_words(begins: str, ends: str, shapes: tuple[str, ...]) -> str:
    more = f" and {len(shapes) - NAMED} more" if len(shapes) > NAMED else ""
    return (
        f"There is no way from {begins} to {ends} that keeps to the fence: {', '.join(shapes[:NAMED])}{more} close it."
    )
