"""The part of a large surface model that a plan or a mission made anywhere needs, and whether it was enough."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from affine import Affine

from mapping.geometry.arrays import F64
from planning.basics.plan_model import FlownLine, Mission
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.certificate.clearance import certify
from planning.fence.fence_model import RallyPoint
from planning.formats.commands import has_position
from planning.missions.flown import PLACED, flown_line
from planning.planner.request import PlanRequest
from planning.terrain.dsm import FLIGHT_MARGIN_M, LARGE_PX, SCALE_TOLERANCE, Dsm, SurfaceModel
from planning.terrain.holes import HoleReport, fill_holes

MARGIN_M = 10.0
"""Around the points, beside what the ball and the Gaussian reach."""
GROWTH = 3.0
T = TypeVar("T")
Judged = tuple[FlownLine, Certificate]


@dataclass(frozen=True, slots=True)
class Ground:
    """A part of a surface model, or all of it, before and after its small holes were filled."""

    dsm: Dsm
    """As it came: a filled hole has its rim's height, and every altitude would be counted from it."""
    filled: Dsm
    holes: HoleReport
    max_hole_m2: float


class Grounds:
    """Parts of one model; the last is kept."""

    def __init__(self, model: SurfaceModel, max_hole_m2: float) -> None:
        self.model = model
        self._max_hole_m2 = max_hole_m2
        self._last: Ground | None = None

    def around(self, xy_m: F64, margin_m: float) -> Ground:
        """Of what lies within ``margin_m`` of the bounding box of projected (N, 2) points."""
        box = _needed_box(self.model, xy_m, margin_m)
        last = self._last
        if last is None or not _is_box(last.dsm, self.model, box):
            dsm = _part(self.model, box)
            filled, holes = fill_holes(dsm, max_area_m2=self._max_hole_m2)
            last = self._last = Ground(dsm, filled, holes, self._max_hole_m2)
        return last

    def judged(
        self, xy_m: F64, margin_m: float, judge: Callable[[Ground], T], is_enough: Callable[[Ground, T], bool]
    ) -> T:
        """What ``judge`` makes of a part that grows until it is enough, or the whole model."""
        while True:
            ground = self.around(xy_m, margin_m)
            found = judge(ground)
            if _is_whole(ground.dsm, self.model) or is_enough(ground, found):
                return found
            margin_m *= GROWTH


def felt_m(request: PlanRequest) -> float:
    """How far beside a place the safe surface over it feels the model, the blocks of the fast form included."""
    surface = request.surface
    sigma_m = surface.radius_m / 10 if surface.smooth_sigma_m is None else surface.smooth_sigma_m
    return 1.5 * surface.radius_m + 5.0 * sigma_m + surface.height_m


def least_margin_m(model: SurfaceModel, request: PlanRequest) -> float:
    """Beyond the points' bounding box: what the safe surface feels, and where the certificate should find ground."""
    return felt_m(request) + request.clearance_over(model).required_clearance_m + MARGIN_M


def looked_over(model: SurfaceModel, xy_m: F64, required_clearance_m: float = 0.0) -> SurfaceModel:
    """The model as a flight among projected (N, 2) places meets it: ``SurfaceModel.over``."""
    return model.over(xy_m, _looked_m(required_clearance_m))


def needed_part(model: SurfaceModel, xy_m: F64, required_clearance_m: float = 0.0) -> Dsm:
    """The model around the bounding box of projected (N, 2) points, as a flight among them meets it.

    Whole where a part saves little, and what it tells of its errors holds in all of it. Points outside the model need
    nothing of it.
    """
    look, margin_m = looked_over(model, xy_m, required_clearance_m), _looked_m(required_clearance_m)
    is_cut = look.place_m < look.most_place_m  # the smaller error is that of what was looked at: no line leaves that
    return _part(look, _needed_box(look, xy_m, margin_m, is_cut=is_cut))


def was_enough(
    ground: Ground, model: SurfaceModel, line: FlownLine, certificate: Certificate, *, felt_m: float = 0.0
) -> bool:
    """Whether the certificate over the part is the one over the whole model.

    All ground beyond the part counts as infinitely high. Nothing that was found is as far as that, so nothing
    that was found is there, and nothing beyond it could be nearer. A small hole that the part cuts is not filled in
    it: all that is found, and all that the path felt, is nearer than such holes, too.
    """
    if _is_whole(ground.dsm, model):
        return True
    places_m = [line.points_m[:, :2], [line.home_xy_m], rally_places(model, line.rally)]
    to_cut_m = _to_cut_m(ground.dsm, model, np.vstack(places_m))
    found_m = max(
        float(certificate.trend_distance_m.max()),
        *(leg.min_distance_m for leg in certificate.legs),
        certificate.required_clearance_m,
        felt_m,
    )
    # Distances to cuts are in metres of the CRS.
    return (1.0 + SCALE_TOLERANCE) * found_m < to_cut_m - _cut_holes_m(ground, model)


def certify_part(
    model: SurfaceModel,
    mission: Mission,
    params: ClearanceParams,
    *,
    max_hole_m2: float,
    assumptions: Mapping[str, object],
) -> tuple[Ground, Certificate]:
    """The part that it took, and the certificate, which is the one over the whole model with its small holes filled."""
    places_m = mission_places(model, mission)
    model = looked_over(model, places_m, params.required_clearance_m)

    def judge(ground: Ground) -> tuple[Ground, Judged]:
        line = flown_line(mission, ground.filled)
        made = {**hole_assumptions(ground.holes, max_hole_m2), **model.said_of_look, **assumptions}
        return ground, (line, certify(ground.filled, line, params, ground=model, assumptions=made))

    def is_enough(ground: Ground, found: tuple[Ground, Judged]) -> bool:
        return was_enough(ground, model, *found[1])

    grounds = Grounds(model, max_hole_m2)
    ground, (_, certificate) = grounds.judged(places_m, params.required_clearance_m + MARGIN_M, judge, is_enough)
    return ground, certificate


def mission_places(model: SurfaceModel, mission: Mission) -> F64:
    """(N, 2) projected places of home, of all items that are flown to, and of rally points; not what is looked at."""
    flown_to = (item for item in mission.items if item.command in PLACED and has_position(item))
    places = [(item.lat_deg, item.lon_deg) for item in flown_to]
    home = mission.home
    flown_m = model.xy_from_lat_lon(np.array([*places, (home.lat_deg, home.lon_deg)]))
    return np.vstack([flown_m, rally_places(model, mission.rally)])


def rally_places(model: SurfaceModel, rally: tuple[RallyPoint, ...]) -> F64:
    """(N, 2) projected places of those that lie on the model: of others it knows nothing, however large its part."""
    lat_lon_deg = np.array([(point.lat_deg, point.lon_deg) for point in rally]).reshape(-1, 2)
    xy_m = model.xy_from_lat_lon(lat_lon_deg)
    west, south, east, north = model.bounds_m
    return xy_m[((xy_m >= (west, south)) & (xy_m <= (east, north))).all(axis=1)]


def hole_assumptions(holes: HoleReport, max_hole_m2: float) -> dict[str, object]:
    """What a certificate writes down about unknown cells that were given a height."""
    return {"holes_filled": holes.count, "holes_filled_area_m2": holes.area_m2, "max_hole_m2": max_hole_m2}


def _looked_m(required_clearance_m: float) -> float:
    return max(FLIGHT_MARGIN_M, required_clearance_m)


def _needed_box(model: SurfaceModel, xy_m: F64, margin_m: float, *, is_cut: bool = False) -> tuple[int, int, int, int]:
    """First row, first column, rows and columns. ``is_cut``: never more than within the margin."""
    whole = (0, 0, model.height_px, model.width_px)
    if not is_cut and model.height_px * model.width_px < LARGE_PX:
        return whole
    west, south, east, north = model.bounds_m
    inside = xy_m[((xy_m >= (west, south)) & (xy_m <= (east, north))).all(axis=1)]
    if not len(inside):
        return 0, 0, 1, 1
    box = model.box_around(inside, margin_m)
    return whole if not is_cut and box[2] * box[3] > model.height_px * model.width_px / 2 else box


def _part(model: SurfaceModel, box: tuple[int, int, int, int]) -> Dsm:
    if box == (0, 0, model.height_px, model.width_px):
        return model.whole()
    part = model.window(*box)
    return replace(part, elevation_m=np.ascontiguousarray(part.elevation_m))


def _is_box(part: Dsm, model: SurfaceModel, box: tuple[int, int, int, int]) -> bool:
    row, column = (round(float(place[0])) for place in model.fractional_cell(np.array([part.transform @ (0, 0)])))
    return (row, column, part.height_px, part.width_px) == box


def _is_whole(part: Dsm, model: SurfaceModel) -> bool:
    return (part.height_px, part.width_px) == (model.height_px, model.width_px)


def _cuts(part: Dsm, model: SurfaceModel) -> tuple[bool, bool, bool, bool]:
    """Whether the part was cut off at its west, south, east and north."""
    half_m = 0.5 * part.resolution_m
    west, south, east, north = (
        abs(inner - outer) > half_m for inner, outer in zip(part.bounds_m, model.bounds_m, strict=True)
    )
    return west, south, east, north


def _to_cut_m(part: Dsm, model: SurfaceModel, xy_m: F64) -> float:
    """Smallest distance of any point between projected (N, 2) points to where the part was cut off."""
    west, south, east, north = part.bounds_m
    low, high = xy_m.min(axis=0), xy_m.max(axis=0)
    away_m = (low[0] - west, low[1] - south, east - high[0], north - high[1])
    cuts = zip(_cuts(part, model), away_m, strict=True)
    return float(min((m for is_cut, m in cuts if is_cut), default=np.inf))


def _cut_holes_m(ground: Ground, model: SurfaceModel) -> float:
    """How far holes reach into the part that it cuts and that may be small enough to be filled in the whole model."""
    cells = ground.filled.cells
    heights, (west, south, east, north) = cells.elevation_m, _cuts(ground.dsm, model)
    if ground.dsm.source is not None:  # its ring of unknown cells is the part's own; any side may be a cut
        heights, (west, south, east, north) = heights[1:-1, 1:-1], (True,) * 4
    # Holes that end at a cut are filled when what lies beyond is known: then they are small so far.
    beyond = np.pad(heights, ((int(north), int(south)), (int(west), int(east))), constant_values=0.0)
    side_m = float(np.sqrt(cells.area_m2))
    stand_in = Dsm(beyond, Affine.scale(side_m, -side_m), ground.dsm.crs, None, "")
    closed, found = fill_holes(stand_in, max_area_m2=ground.max_hole_m2)
    if not found.count:
        return 0.0
    inner = closed.elevation_m[int(north) : int(north) + heights.shape[0], int(west) : int(west) + heights.shape[1]]
    row, column = np.nonzero(np.isnan(heights) & ~np.isnan(inner))
    height_px, width_px = heights.shape
    sides = ((north, row + 1), (south, height_px - row), (west, column + 1), (east, width_px - column))
    deep_px = np.min([away for is_cut, away in sides if is_cut], axis=0)
    lattice = cells.layout.lattice
    return float(deep_px.max()) * max(lattice.width_m, lattice.height_m)
