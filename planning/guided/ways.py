"""Lays a guided way over the surface and proves it: straight where that is clear, else up, over and down.

Nothing here is trusted: the line is judged by the certificate, whose code knows nothing of how it was laid. What can be
mended by height is raised until it is certified, a fence is passed beside; what cannot be mended is refused with the
certificate's own words. A vehicle that is nearer to the surface than it must be climbs straight up first: climbing
brings it nearer to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.plan_model import FlownLine
from planning.certificate.certificate_model import Certificate
from planning.certificate.clearance import certify
from planning.certificate.nearest import nearest_distances
from planning.certificate.pyramid import cells_pyramid
from planning.certificate.returns import return_altitude
from planning.errors import MissionError, ParameterError
from planning.guided.guided_model import (
    HEIGHTS_M,
    LAPS,
    RADII_M,
    RETURNS,
    Back,
    Demand,
    GoTo,
    GuidedWay,
    Here,
    Join,
    LatLon,
    Look,
    Orbit,
    Problem,
    Rally,
    TakeOff,
    ToHome,
    Wish,
)
from planning.guided.shapes import circle, simplified
from planning.route.around_fence import Kept, laid_legs
from planning.terrain.dsm import Dsm, SurfaceModel, true_cells

LIFTS_M = (0.0, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 21.0, 34.0)
"""Tried one after the other above what the surface asks for: home may lie lower, and returns may need more."""
MENDED_BY_HEIGHT = frozenset({"clearance", "terrain_hit", "home_drop", "return_height", "return_near_home"})
RETURN_FENCE = "return_fence"
"""The line keeps to the fence, the vehicle's own straight ways back meet a zone; no height mends that."""
OWN_RETURNS = frozenset({"return_unknown", "return_height", "return_near_home", "rally", RETURN_FENCE})
"""The vehicle's own way home from the line is not clear: who is on a certified way home does not need it."""
LANDINGS = frozenset({"home_column", "home_on_top"})
"""What stands where it would land at home."""
FARTHEST_M = 5_000.0
STANDS_M, CAME_FROM_M = 1.0, 3.0
"""From home, where a take-off begins and where the flown way does: heights count from there, and the one leads
straight up, the other straight down to land."""
ROUNDING_M = 0.01
"""Above the exact altitude, so that the proof, which rounds differently, finds it high enough."""
DEEP_M = -1e9


@dataclass(frozen=True, slots=True)
class _Shape:
    """Where a way leads, from over the vehicle on."""

    tail_m: F64
    """(T, 3) flown one after the other; the first is reached on the straight line or over the top."""
    keeps_heights: bool = False
    """They are given; else they are the lowest that is asked for."""
    direct: bool = True
    """The straight line to the first is tried before the way over the top."""
    around_xy_m: F64 = field(default_factory=lambda: np.empty((0, 2)))
    """(N, 2) where the way over the top turns before it comes to the first: around a fence."""


class _Level:
    """How high level flight must be over one surface model: exact, by the heights that returns need."""

    def __init__(self, dsm: Dsm, xy_m: F64, clearance_m: float) -> None:
        cells = true_cells(dsm, xy_m)
        self._layout, self._pyramid, self._clearance_m = cells.layout, cells_pyramid(cells), clearance_m

    def altitude(self, xy_m: F64) -> float:
        """The lowest for the level polyline through (K, 2) places; inf where unknown cells are too near."""
        places_m = self._layout.in_frame(np.column_stack([xy_m, np.full(len(xy_m), DEEP_M)]))
        legs = pairwise(places_m) if len(places_m) > 1 else [(places_m[0], places_m[0])]
        found_m = max(return_altitude(self._pyramid, a[None], b[:2], self._clearance_m)[0] for a, b in legs)
        return found_m + ROUNDING_M if math.isfinite(found_m) else found_m

    def distance_m(self, point_m: F64) -> float:
        """Of one (3,) point to the surface."""
        at_m = self._layout.in_frame(point_m[None])
        return float(nearest_distances(self._pyramid, at_m, at_m)[0][0])


def guided_way(dsm: Dsm, ground: SurfaceModel, here: Here, wish: Wish, demand: Demand) -> GuidedWay:
    """``dsm``: with small holes filled and what was seen in it; ``ground``: as it came, for home and landings.

    Raises MissionError where nothing can be laid, ParameterError for what no way can be.
    """
    _check(here, wish, demand)
    home_xy_m = _xy(dsm, here.home_lat_lon_deg)
    home_m = _known(ground, home_xy_m, "home")
    at_m = np.array([*_xy(dsm, here.lat_lon_deg), home_m + here.alt_rel_home_m])
    shape = _shape(dsm, wish, at_m, home_xy_m, home_m)
    _check_home(wish, shape, at_m, home_xy_m)
    away_m = float(np.linalg.norm(shape.tail_m[:, :2] - at_m[:2], axis=1).max())
    if away_m > FARTHEST_M:
        what = f"The way leads {away_m / 1000:.1f} km away; {FARTHEST_M / 1000:g} km are the most."
        raise MissionError(what, advice="Choose a place that is nearer.")
    asked = _Asked(dsm, ground, at_m, home_xy_m, home_m, wish, demand)
    way = _lowest(asked, shape)
    around_xy_m = _around(asked, here, shape, way)
    if not len(around_xy_m):
        return way
    around = _lowest(asked, replace(shape, direct=False, around_xy_m=around_xy_m))
    is_no_better = around.problem in ("way", way.problem)
    return way if is_no_better else replace(around, turns=len(around_xy_m))


@dataclass(frozen=True, slots=True)
class _Asked:
    """What stays the same however the way is laid."""

    dsm: Dsm
    ground: SurfaceModel
    at_m: F64
    home_xy_m: LatLon
    home_m: float
    wish: Wish
    demand: Demand


def _lowest(asked: _Asked, shape: _Shape) -> GuidedWay:
    """The lowest that is certified, or the first that was tried."""
    dsm, demand, wish = asked.dsm, asked.demand, asked.wish
    lands_xy_m = (float(shape.tail_m[-1, 0]), float(shape.tail_m[-1, 1])) if isinstance(wish, Rally | Back) else None
    best: GuidedWay | None = None
    for points_m in _lines(dsm, shape, asked.at_m, demand, takes_off=isinstance(wish, TakeOff)):
        line = _flown(points_m, asked.home_xy_m, asked.home_m, demand, lands_xy_m)
        certificate = certify(dsm, line, demand.clearance, ground=asked.ground)
        codes = _codes(certificate, wish)
        way = _way(asked, points_m, certificate, _problem(codes, wish), shape.tail_m[-1, 2])
        if way.problem is None:
            return way
        hopeless = not codes <= MENDED_BY_HEIGHT | OWN_RETURNS | LANDINGS
        # Where only the vehicle's own return is left, and height mends not all of it, higher is no better.
        hopeless = hopeless or (way.problem == "return" and not codes <= MENDED_BY_HEIGHT | {"rally"})
        if best is None or (best.problem == "way" and (hopeless or way.problem == "return")):
            best = way
        if hopeless:
            break
    assert best is not None
    return best


def _around(asked: _Asked, here: Here, shape: _Shape, way: GuidedWay) -> F64:
    """Where it has to turn before the first place; nowhere if a fence is not what is in the way."""
    fence = way.certificate.fence
    if way.problem is None or fence is None or fence.keeps or isinstance(asked.wish, TakeOff | Look | Back):
        return np.empty((0, 2))
    kept = Kept(
        fence=asked.demand.fence,
        home_lat_lon_deg=here.home_lat_lon_deg,
        rally=asked.demand.rally,
        margin_m=asked.demand.clearance.fence_margin_m,
        from_edge_m=asked.demand.clearance.required_clearance_m,
    )
    return laid_legs(asked.dsm, np.vstack([asked.at_m[:2], shape.tail_m[0, :2]]), kept).legs[0].corners_xy_m


def _codes(certificate: Certificate, wish: Wish) -> set[str]:
    """Of a fence that only the vehicle's own ways back would breach nothing, for who is on the way back."""
    codes, fence = {reason.code for reason in certificate.reasons}, certificate.fence
    if "fence" not in codes or fence is None:
        return codes
    if isinstance(wish, RETURNS):
        return codes - {"fence"} if fence.line_keeps else codes
    return codes - {"fence"} | {RETURN_FENCE} if fence.is_of_ways_back else codes


def _problem(codes: set[str], wish: Wish) -> Problem | None:
    if isinstance(wish, RETURNS):
        codes = codes - OWN_RETURNS
        codes = codes - LANDINGS if isinstance(wish, Rally) else codes
    return None if not codes else "return" if codes <= OWN_RETURNS | LANDINGS else "way"


def _lines(dsm: Dsm, shape: _Shape, at_m: F64, demand: Demand, *, takes_off: bool) -> Iterator[F64]:
    """(K, 3) lines in the order in which they are tried."""
    tail_m = shape.tail_m
    if takes_off:
        for lift_m in LIFTS_M:
            yield _lifted(np.vstack([tail_m, tail_m]), lift_m)
        return
    level = _Level(
        dsm, np.vstack([at_m[None, :2], shape.around_xy_m, tail_m[:, :2]]), demand.clearance.required_clearance_m
    )
    if level.distance_m(at_m) <= 0.0:
        raise MissionError(
            "By the surface model the vehicle is inside what stands here: the model, its home or its height is wrong.",
            advice="Climb by remote control, or land.",
        )
    begins_m = np.array([*at_m[:2], max(at_m[2], _finite(level.altitude(at_m[None, :2]), "under the vehicle"))])
    if not shape.keeps_heights:
        needed_m = _finite(level.altitude(tail_m[:, :2]), "where it leads")
        tail_m = np.column_stack([tail_m[:, :2], np.maximum(tail_m[:, 2], needed_m)])
    if shape.direct:
        yield np.vstack([begins_m, tail_m])
    across_xy_m = np.vstack([shape.around_xy_m, tail_m[0, :2]])
    over_m = _finite(level.altitude(np.vstack([at_m[:2], across_xy_m])), "on the way")
    for lift_m in LIFTS_M:
        lifted_m, lower_m = _lifted(tail_m, lift_m), _lifted(begins_m[None], lift_m)
        top_m = max(over_m + lift_m, float(lower_m[0, 2]), float(lifted_m[0, 2]))
        up_m, across_m = [*at_m[:2], top_m], np.column_stack([across_xy_m, np.full(len(across_xy_m), top_m)])
        yield _without_repeats(np.vstack([lower_m, up_m, across_m, lifted_m]))


def _shape(dsm: Dsm, wish: Wish, at_m: F64, home_xy_m: LatLon, home_m: float) -> _Shape:
    if isinstance(wish, TakeOff):
        return _Shape(np.array([[*home_xy_m, home_m + wish.alt_rel_home_m]]))
    if isinstance(wish, Look):
        return _Shape(at_m[None])
    if isinstance(wish, Join):
        return _Shape(np.array([[*_xy(dsm, wish.lat_lon_deg), home_m + wish.alt_rel_home_m]]), keeps_heights=True)
    if isinstance(wish, ToHome):
        return _Shape(np.array([[*home_xy_m, home_m + wish.height_m]]), direct=False)
    if isinstance(wish, Back):
        flown = np.array(wish.flown, np.float64).reshape(-1, 3)
        track_m = np.column_stack([dsm.xy_from_lat_lon(flown[:, :2]), home_m + flown[:, 2]])
        return _Shape(simplified(track_m[::-1]), keeps_heights=True)
    if isinstance(wish, Rally):
        xy_m = _xy(dsm, (wish.point.lat_deg, wish.point.lon_deg))
        return _Shape(np.array([[*xy_m, _known(dsm, xy_m, "the rally point") + wish.height_m]]), direct=False)
    xy_m = (float(at_m[0]), float(at_m[1])) if wish.lat_lon_deg is None else _xy(dsm, wish.lat_lon_deg)
    alt_m = _known(dsm, xy_m, "the place") + wish.height_m
    if isinstance(wish, GoTo):
        return _Shape(np.array([[*xy_m, alt_m]]))
    round_m = circle(np.array(xy_m), at_m[:2], wish.radius_m, laps=wish.laps, clockwise=wish.clockwise)
    return _Shape(np.column_stack([round_m, np.full(len(round_m), alt_m)]))


def _flown(
    points_m: F64, home_xy_m: LatLon, home_m: float, demand: Demand, lands_xy_m: tuple[float, float] | None
) -> FlownLine:
    return FlownLine(
        points_m=points_m,
        leg_item=np.arange(len(points_m) - 1),
        home_xy_m=home_xy_m,
        home_alt_dsm_m=home_m,
        takeoff_alt_dsm_m=float(points_m[0, 2]),
        ends_with_rtl=False,
        landing_xy_m=lands_xy_m,
        fence=demand.fence,
        rally=demand.rally,
    )


def _way(asked: _Asked, points_m: F64, certificate: Certificate, problem: Problem | None, asked_m: float) -> GuidedWay:
    dsm, at_m, home_m, demand = asked.dsm, asked.at_m, asked.home_m, asked.demand
    whole_m = _without_repeats(np.vstack([at_m, points_m]))
    legs = np.diff(whole_m, axis=0)
    flat_m, up_m = np.hypot(legs[:, 0], legs[:, 1]), legs[:, 2]
    rates_m_s = np.where(up_m > 0.0, demand.climb_m_s, demand.descent_m_s)
    lat_lon_deg = dsm.lat_lon_from_xy(whole_m[:, :2])
    return GuidedWay(
        points_m=whole_m,
        places=tuple(
            (float(lat), float(lon), float(z - home_m))
            for (lat, lon), z in zip(lat_lon_deg, whole_m[:, 2], strict=True)
        ),
        certificate=certificate,
        raised_m=max(0.0, float(points_m[-1, 2] - asked_m)),
        rises_m=max(0.0, float(points_m[0, 2] - at_m[2])),
        length_m=float(np.linalg.norm(legs, axis=1).sum()),
        t_s=np.concatenate([[0.0], np.cumsum(np.maximum(flat_m / demand.speed_m_s, np.abs(up_m) / rates_m_s))]),
        problem=problem,
    )


def _lifted(points_m: F64, by_m: float) -> F64:
    return points_m + np.array([0.0, 0.0, by_m])


def _without_repeats(points_m: F64) -> F64:
    """Two points at least."""
    keep = np.concatenate([[True], np.any(np.diff(points_m, axis=0) != 0.0, axis=1)])
    return points_m[keep] if keep.sum() > 1 else points_m[:2]


def _xy(dsm: SurfaceModel, lat_lon_deg: LatLon) -> LatLon:
    x_m, y_m = dsm.xy_from_lat_lon(np.array([lat_lon_deg]))[0]
    return float(x_m), float(y_m)


def _known(dsm: SurfaceModel, xy_m: LatLon, name: str) -> float:
    """The surface's height there."""
    return _finite(float(dsm.elevation_at(np.array([xy_m]))[0]), f"at {name}")


def _check_home(wish: Wish, shape: _Shape, at_m: F64, home_xy_m: LatLon) -> None:
    if isinstance(wish, TakeOff):
        off_m = math.dist(at_m[:2], home_xy_m)
        if off_m > STANDS_M:
            what = f"The vehicle stands {off_m:.1f} m from its home: from there no take-off is certified."
            raise MissionError(what, advice="Disarm it: when it arms again, its home is where it stands.")
    if isinstance(wish, Back):
        off_m = math.dist(shape.tail_m[-1, :2], home_xy_m)
        if off_m > CAME_FROM_M:
            what = f"The way that was flown is known from {off_m:.1f} m beside home on only: it does not lead home."
            raise MissionError(what, advice="Return another way.")


def _finite(alt_m: float, where: str) -> float:
    if math.isnan(alt_m) or alt_m == math.inf:
        raise MissionError(
            f"The surface model ends or knows no height {where}, or too near to it.",
            advice="Choose a place farther inside the surface model.",
        )
    return alt_m


def _check(here: Here, wish: Wish, demand: Demand) -> None:
    numbers = [*here.lat_lon_deg, *here.home_lat_lon_deg, here.alt_rel_home_m]
    numbers += [*wish.lat_lon_deg, wish.alt_rel_home_m] if isinstance(wish, Join) else []
    if not np.isfinite(numbers).all():
        raise MissionError("The vehicle's place, height or home is not known.", advice="Wait for its position.")
    if not 0.0 < demand.speed_m_s < math.inf:
        raise ParameterError(f"The speed is {demand.speed_m_s} m/s.", advice="Give a positive number.")
    asked = {
        "height": (getattr(wish, "height_m", None), HEIGHTS_M),
        "radius": (getattr(wish, "radius_m", None), RADII_M),
    }
    if isinstance(wish, TakeOff):
        asked["height"] = (wish.alt_rel_home_m, HEIGHTS_M)
    for name, (value_m, (least_m, most_m)) in asked.items():
        if value_m is not None and not least_m <= value_m <= most_m:
            raise ParameterError(f"The {name} is {value_m} m.", advice=f"Give {least_m:g} to {most_m:g} m.")
    if isinstance(wish, Orbit) and not LAPS[0] <= wish.laps <= LAPS[1]:
        raise ParameterError(f"{wish.laps} laps were asked for.", advice=f"Give {LAPS[0]} to {LAPS[1]}.")
    if isinstance(wish, Back) and not (len(wish.flown) > 1 and np.isfinite(np.array(wish.flown)).all()):
        raise MissionError("The way that was flown is not known.", advice="Return another way.")
    place = getattr(wish, "lat_lon_deg", None)
    if place is not None and not (abs(place[0]) <= 90.0 and abs(place[1]) <= 180.0):
        raise ParameterError(f"{place[0]}, {place[1]} is no place on Earth.", advice="Give the latitude first.")
