"""Legs laid around fences: never across, as short as the slow oracle's, and found where a grid finds one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS
from skimage import measure

from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, RallyPoint, circle, polygon
from planning.fence.grown_zones import ROUNDING_M, Flat, zones_of
from planning.fence.judge import FencedFlight, FenceVerdict, judge_fence
from planning.fence.ways_around import field_of, way_around
from planning.route.around_fence import Kept, Laid, laid_legs
from planning.terrain.dsm import Dsm
from tests.reference.fence import nearest_m, plane_about, swept_places, xy_of
from tests.reference.ways_around import Shape, kept, shortest_m

MARGIN_M = 2.0
FLAT = Dsm(
    np.zeros((8, 8), np.float32), Affine(50.0, 0, 700_000.0, 0, -50.0, 5_000_400.0), CRS.from_epsg(32633), None, ""
)
"""400 m square, far enough from its zone's middle meridian for lines to bend."""
HOME_XY_M = np.array([700_200.0, 5_000_200.0])
HOME = tuple(FLAT.lat_lon_from_xy(HOME_XY_M)[0].tolist())


def at(east_m: float, north_m: float) -> tuple[float, float]:
    lat_deg, lon_deg = FLAT.lat_lon_from_xy(HOME_XY_M + np.array([east_m, north_m]))[0]
    return float(lat_deg), float(lon_deg)


def ring(*east_north_m: tuple[float, float], inclusion: bool = False) -> FencePolygon:
    return polygon([at(*each) for each in east_north_m], inclusion=inclusion, where="test")


def disc(east_m: float, north_m: float, radius_m: float, *, inclusion: bool = False) -> FenceCircle:
    return circle(*at(east_m, north_m), radius_m, inclusion=inclusion, where="test")


def laid(fence: Fence, *east_north_m: tuple[float, float], rally: tuple[RallyPoint, ...] = ()) -> Laid:
    return laid_legs(FLAT, HOME_XY_M + np.array(east_north_m), Kept(fence, HOME, rally, MARGIN_M, 3.0))


def flown_m(found: Laid, *east_north_m: tuple[float, float]) -> np.ndarray:
    """(K, 2) from home's place."""
    corners = [leg.corners_xy_m - HOME_XY_M for leg in found.legs]
    rest = zip(corners, np.array(east_north_m)[1:], strict=True)
    return np.vstack([east_north_m[0], *(np.vstack([m, end]) for m, end in rest)])


def flight(line_m: np.ndarray, rally: tuple[RallyPoint, ...] = ()) -> FencedFlight:
    places = FLAT.lat_lon_from_xy(HOME_XY_M + line_m).round(7)
    return FencedFlight(
        places, np.full(len(places), 20.0), HOME, tuple((p.lat_deg, p.lon_deg) for p in rally), 30.0, MARGIN_M
    )


def verdict(fence: Fence, found: Laid, *east_north_m: tuple[float, float]) -> FenceVerdict:
    return judge_fence(fence, flight(flown_m(found, *east_north_m)))


def length_m(line_m: np.ndarray) -> float:
    return float(np.linalg.norm(np.diff(line_m, axis=0), axis=1).sum())


WAY = ((-40.0, 30.0), (40.0, 30.0))


def test_without_anything_in_the_way_a_leg_stays_straight() -> None:
    found = laid(Fence(circles=(disc(0.0, 60.0, 5.0),)), *WAY)
    assert (len(found.legs[0].corners_xy_m), found.legs[0].closed_by, found.forbidden) == (0, (), ("", ""))


@pytest.mark.parametrize("fence", [Fence(ceiling_rel_home_m=50.0), Fence(circles=(disc(0.0, 60.0, 5.0),))])
def test_a_leg_of_no_length_at_home_is_one(fence: Fence) -> None:
    (leg,) = laid(fence, (0.0, 0.0), (0.0, 0.0)).legs
    assert (len(leg.corners_xy_m), leg.closed_by) == (0, ())


@pytest.mark.parametrize(
    "shape",
    [disc(0.0, 30.0, 6.0), ring((-5, 25), (5, 25), (5, 35), (-5, 35)), ring((-5, 22), (0, 29), (5, 22), (0, 33))],
)
def test_a_shape_on_the_leg_is_passed_on_home_s_side_so_that_the_way_back_stays_clear(
    shape: FenceCircle | FencePolygon,
) -> None:
    fence = Fence((shape,)) if isinstance(shape, FencePolygon) else Fence(circles=(shape,))
    found = laid(fence, *WAY)
    assert set(found.legs[0].shapes) == {"exclusion polygon 1" if fence.polygons else "exclusion circle 1"}
    assert (found.legs[0].corners_xy_m[:, 1] < HOME_XY_M[1] + 25.0).all()
    judged = verdict(fence, found, *WAY)
    assert judged.keeps
    assert MARGIN_M <= judged.min_distance_m < MARGIN_M + 2 * ROUNDING_M + 0.02


def test_where_no_way_back_is_clear_the_line_alone_is_laid_around_and_the_judge_says_so() -> None:
    fence, way = Fence(circles=(disc(0.0, 30.0, 6.0),)), ((0.0, 10.0), (0.0, 60.0))
    found = laid(fence, *way)
    assert found.legs[0].shapes
    judged = verdict(fence, found, *way)
    assert (judged.keeps, judged.part) == (False, "home")


def test_rally_points_are_seen_from_everywhere_too() -> None:
    """Past the circle on home's side the way to a rally point beyond it would pass the circle."""
    fence, rally = Fence(circles=(disc(0.0, 30.0, 6.0),)), (RallyPoint(*at(-80.0, 30.0), 20.0),)
    found = laid(fence, (-40.0, 50.0), (-20.0, 10.0), rally=rally)
    assert judge_fence(fence, flight(flown_m(found, (-40.0, 50.0), (-20.0, 10.0)), rally)).keeps
    behind = laid(fence, *WAY, rally=rally)
    assert not judge_fence(fence, flight(flown_m(behind, *WAY), rally)).keeps  # from (40, 30) no way could


def test_a_notch_of_an_inclusion_is_passed_within() -> None:
    outline = ring((-60, -20), (60, -20), (60, 60), (4, 60), (0, 20), (-4, 60), (-60, 60), inclusion=True)
    fence = Fence((outline,))
    found = laid(fence, *WAY)
    assert set(found.legs[0].shapes) == {"inclusion polygon 1"}
    assert verdict(fence, found, *WAY).keeps


def test_ways_turn_inside_an_inclusion_circle_only() -> None:
    """Past the outer side of the bar there would be a way, but beyond the circle's edge."""
    bar = ring((-3, -30), (3, -30), (3, 45), (-3, 45))
    beside, way = (
        Kept(Fence((bar,)), at(-60.0, 20.0), (), MARGIN_M, 3.0),
        HOME_XY_M + np.array([(-30.0, 20.0), (30.0, 20.0)]),
    )
    assert not laid_legs(FLAT, way, beside).legs[0].closed_by
    within = Fence((bar,), (disc(0.0, 0.0, 48.0, inclusion=True),))
    down = laid_legs(FLAT, way, Kept(within, at(-60.0, 20.0), (), MARGIN_M, 3.0)).legs[0]
    assert (down.corners_xy_m[:, 1] < HOME_XY_M[1] - 30.0).all()
    closed = Fence((bar,), (disc(0.0, 8.0, 39.0, inclusion=True),))
    assert "exclusion polygon 1" in laid_legs(FLAT, way, Kept(closed, HOME, (), MARGIN_M, 3.0)).legs[0].closed_by


def test_the_model_s_edge_is_no_way() -> None:
    wall = Fence((ring((-3, -198), (3, -198), (3, 198), (-3, 198)),))
    assert laid(wall, (-40.0, 0.0), (40.0, 0.0)).legs[0].closed_by == ("exclusion polygon 1",)


def test_a_place_that_is_closed_in_names_what_closes_it() -> None:
    sides = (
        ring((20, 20), (60, 20), (60, 24), (20, 24)),
        ring((56, 20), (60, 20), (60, 60), (56, 60)),
        ring((20, 56), (60, 56), (60, 60), (20, 60)),
        ring((20, 20), (24, 20), (24, 60), (20, 60)),
        ring((-60, -60), (-50, -60), (-50, -50)),
    )
    leg = laid(Fence(sides), (0.0, 0.0), (40.0, 40.0)).legs[0]
    assert set(leg.closed_by) == {f"exclusion polygon {k}" for k in (1, 2, 3, 4)}
    assert len(leg.corners_xy_m) == 0


@pytest.mark.parametrize(
    ("fence", "said"),
    [
        (Fence(circles=(disc(0.0, 30.0, 10.0),)), "lies 7.07 m inside exclusion circle 1"),
        (Fence((ring((-9, 21), (9, 21), (9, 39), (-9, 39)),)), "lies 6.00 m inside exclusion polygon 1"),
        (
            Fence((ring((-90, -10), (90, -10), (90, 25), (-90, 25), inclusion=True),)),
            "5.00 m outside inclusion polygon 1",
        ),
        (Fence(circles=(disc(0.0, 0.0, 20.0, inclusion=True),)), "lies 10.28 m outside inclusion circle 1"),
        (Fence((ring((-9, 31), (9, 31), (9, 39), (-9, 39)),)), "lies 1.00 m from the edge of exclusion polygon 1"),
    ],
)
def test_a_place_where_nobody_may_be_is_told_by_how_much(fence: Fence, said: str) -> None:
    wrong = laid(fence, (-3.0, 30.0), (100.0, 20.0)).forbidden[0]
    assert said in wrong
    assert "move it" in wrong


def test_a_thousand_random_fences_are_never_crossed_by_what_is_certified() -> None:
    certified = detours = 0
    plane, wrong = plane_about(HOME), []
    for seed in range(1000):
        rng = np.random.default_rng(seed)
        places = [(0.0, 0.0), *map(tuple, rng.uniform(-60.0, 60.0, (int(rng.integers(1, 4)), 2)))]
        fence = _random_fence(rng, places)
        rally = tuple(RallyPoint(*at(*each), 20.0) for each in rng.uniform(-60, 60, (int(rng.random() < 0.2), 2)))
        found = laid(fence, *places, rally=rally)
        if any(found.forbidden):
            continue
        line_m = flown_m(found, *places)
        keeps = judge_fence(fence, flight(line_m, rally)).keeps
        flown = flight(line_m, rally)
        places_m = xy_of(plane, flown.line_lat_lon_deg)
        targets = xy_of(plane, [HOME, *flown.rally_lat_lon_deg]) if keeps else np.empty((0, 2))
        kept_m = nearest_m(fence, swept_places(places_m, targets, 2.5), plane)
        if kept_m < MARGIN_M - 1e-3 and not any(leg.closed_by for leg in found.legs):
            wrong.append((seed, f"{'certified' if keeps else 'laid'} within {kept_m:.3f} m"))
        certified, detours = certified + keeps, detours + (keeps and len(line_m) > len(places))
    assert wrong == []
    assert certified > 250
    assert detours > 60


def test_ways_are_at_most_two_percent_longer_than_the_slow_oracle_s_and_exist_where_its_do() -> None:
    around = closed = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        flats, ends_m, seen_from_m = _random_plane(rng)
        zones = [zone for flat in flats for zone in zones_of(flat, MARGIN_M, np.vstack([ends_m, seen_from_m]))]
        field = field_of(zones, [], seen_from_m, lambda corners_m: np.ones(len(corners_m), bool))
        assert field is not None
        found = way_around(field, ends_m[0], ends_m[1])
        shapes: list[Shape] = [(flat.corners_m, flat.radius_m + MARGIN_M) for flat in flats]
        best_m = shortest_m(ends_m[0], ends_m[1], seen_from_m, shapes)
        assert bool(found.closed_by) == math.isinf(best_m), seed
        if found.closed_by:
            closed += 1
            continue
        way_m = np.vstack([ends_m[0], found.corners_m, ends_m[1]])
        assert kept(way_m[:-1], way_m[1:], seen_from_m, shapes).all(), seed
        assert length_m(way_m) <= 1.02 * best_m, seed
        assert length_m(way_m) >= 0.995 * best_m, seed
        around += len(found.corners_m) > 0
    assert around > 12
    assert closed > 0


def test_where_a_fine_grid_has_a_way_so_have_the_zones() -> None:
    reached = 0
    axis = np.arange(-70.0, 70.5, 2.0)
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    for seed in range(100, 130):
        flats, ends_m, seen_from_m = _random_plane(np.random.default_rng(seed))
        shapes: list[Shape] = [(flat.corners_m, flat.radius_m + MARGIN_M) for flat in flats]
        # Between neighbours and to the nearest node nothing is farther than this from a node that is free.
        free = kept(grid, grid, seen_from_m, shapes, spare_m=1.45).reshape(len(axis), len(axis))
        islands = np.asarray(measure.label(free, connectivity=1))
        on = [islands[tuple(np.rint((end + 70.0) / 2.0).astype(int)[::-1])] for end in ends_m]
        if on[0] == 0 or on[0] != on[1]:
            continue
        reached += 1
        zones = [zone for flat in flats for zone in zones_of(flat, MARGIN_M, np.vstack([ends_m, seen_from_m]))]
        field = field_of(zones, [], seen_from_m, lambda corners_m: np.ones(len(corners_m), bool))
        assert field is not None
        assert not way_around(field, ends_m[0], ends_m[1]).closed_by, seed
    assert reached > 6


def _random_plane(rng: np.random.Generator) -> tuple[list[Flat], np.ndarray, np.ndarray]:
    """Shapes in the way between two places, and what has to be seen from everywhere: home, at times a rally point."""
    while True:
        seen_from_m = np.vstack([np.zeros((1, 2)), rng.uniform(-50, 50, (int(rng.random() < 0.4), 2))])
        ends_m = rng.uniform(-50.0, 50.0, (2, 2))
        flats = [_random_flat(rng) for _ in range(int(rng.integers(1, 4)))]
        shapes: list[Shape] = [(flat.corners_m, flat.radius_m + MARGIN_M) for flat in flats]
        places_m = np.vstack([ends_m, seen_from_m])
        straight = kept(ends_m[:1], ends_m[1:], seen_from_m, shapes)[0]
        if kept(places_m, places_m, seen_from_m, shapes, spare_m=0.1).all() and not straight:
            return flats, ends_m, seen_from_m


def _random_flat(rng: np.random.Generator) -> Flat:
    centre_m = rng.uniform(-50.0, 50.0, 2)
    if rng.random() < 0.4:
        return Flat("circle", False, centre_m[None], float(rng.uniform(1.0, 15.0)), 0.0)
    return Flat("polygon", False, centre_m + _random_ring(rng, 4.0, 20.0), 0.0, 0.0)


def _random_ring(rng: np.random.Generator, least_m: float, most_m: float) -> np.ndarray:
    """A star-shaped polygon around the origin, counter-clockwise, seldom convex."""
    count = int(rng.integers(3, 7))
    angle = (np.arange(count) + rng.uniform(-0.3, 0.3, count)) * math.tau / count
    return rng.uniform(least_m, most_m, count)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def _random_fence(rng: np.random.Generator, places: list[tuple[float, float]]) -> Fence:
    """Some exclusions lie on a leg."""
    polygons, circles = [], []
    for _ in range(int(rng.integers(1, 4))):
        inclusion = bool(rng.random() < 0.2)
        centre_m = rng.uniform(-15.0, 15.0, 2) if inclusion else rng.uniform(-60.0, 60.0, 2)
        if not inclusion and len(places) > 2 and rng.random() < 0.5:
            centre_m = np.mean(places[-2:], axis=0)
        least_m, most_m = (60.0, 130.0) if inclusion else (3.0, 15.0)
        if rng.random() < 0.4:
            circles.append(
                disc(float(centre_m[0]), float(centre_m[1]), float(rng.uniform(least_m, most_m)), inclusion=inclusion)
            )
        else:
            corners = map(tuple, centre_m + _random_ring(rng, least_m, most_m))
            polygons.append(ring(*corners, inclusion=inclusion))
    return Fence(tuple(polygons), tuple(circles))
