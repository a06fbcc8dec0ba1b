"""A flight held against its fence: by hand, and against a brute force of hundreds of random fences and flights."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.frames import LocalFrame
from planning.errors import FormatError
from planning.fence.distance import one_to_polygon, to_polygon
from planning.fence.fence_model import Fence, FenceCircle, FencePolygon, circle, fence, polygon
from planning.fence.judge import FencedFlight, FenceVerdict, judge_fence
from tests.reference.fence import nearest_m, plane_about, swept_places, xy_of

HOME = (-37.1244507, 175.6892878)
FRAME = LocalFrame(*HOME, 0.0)
MARGIN_M = 2.0


def at(*east_north_m: tuple[float, float]) -> list[tuple[float, float]]:
    places = FRAME.to_geodetic(np.array([(e, n, 0.0) for e, n in east_north_m]))
    return [(round(float(lat), 7), round(float(lon), 7)) for lat, lon, _ in places]


def flight(
    *line_m: tuple[float, float], rally_m: tuple[tuple[float, float], ...] = (), alt_m: float = 20.0
) -> FencedFlight:
    return FencedFlight(
        line_lat_lon_deg=np.array(at(*line_m)),
        line_rel_home_m=np.full(len(line_m), alt_m),
        home_lat_lon_deg=HOME,
        rally_lat_lon_deg=tuple(at(*rally_m)),
        return_rel_home_m=30.0,
        margin_m=MARGIN_M,
    )


def square(side_m: float, east_m: float = 0.0, north_m: float = 0.0, *, inclusion: bool) -> FencePolygon:
    h = side_m / 2
    corners = at(*[(east_m + x, north_m + y) for x, y in ((-h, -h), (h, -h), (h, h), (-h, h))])
    return polygon(corners, inclusion=inclusion, where="test")


def judged(shape: FencePolygon | FenceCircle, flown: FencedFlight) -> FenceVerdict:
    shapes = Fence(polygons=(shape,)) if isinstance(shape, FencePolygon) else Fence(circles=(shape,))
    return judge_fence(shapes, flown)


OUT_AND_BACK = ((0.0, 0.0), (0.0, 100.0), (100.0, 100.0))


def test_a_flight_beside_an_exclusion_keeps_its_distance() -> None:
    verdict = judged(square(20.0, -50.0, 50.0, inclusion=False), flight(*OUT_AND_BACK))
    assert verdict.keeps
    assert verdict.min_distance_m == pytest.approx(40.0, abs=0.02)
    assert (verdict.shape, verdict.part) == ("exclusion polygon 1", "line")


def test_a_line_that_enters_an_exclusion_is_told_where() -> None:
    verdict = judged(square(20.0, 0.0, 50.0, inclusion=False), flight(*OUT_AND_BACK))
    assert not verdict.keeps
    assert verdict.min_distance_m == 0.0
    assert "The line enters exclusion polygon 1" in verdict.faults[0]
    assert verdict.lat_deg == pytest.approx(at((0.0, 40.0))[0][0], abs=2e-6)


def test_an_exclusion_that_lies_between_the_line_and_home_is_in_the_way_home() -> None:
    """No part of the line comes near it, and no way home from a corner of the line passes it."""
    verdict = judged(square(4.0, 40.0, 70.0, inclusion=False), flight(*OUT_AND_BACK))
    assert not verdict.keeps
    assert verdict.part == "home"
    assert "A way home enters exclusion polygon 1" in verdict.faults[0]
    small = judged(circle(*at((40.0, 70.0))[0], 0.5, inclusion=False, where="test"), flight(*OUT_AND_BACK))
    assert (small.keeps, small.part) == (False, "home")


def test_ways_to_rally_points_count_as_ways_home_do() -> None:
    beside = square(10.0, -50.0, 50.0, inclusion=False)
    assert judged(beside, flight(*OUT_AND_BACK)).keeps
    verdict = judged(beside, flight(*OUT_AND_BACK, rally_m=((-100.0, 50.0),)))
    assert (verdict.keeps, verdict.part) == (False, "rally")


def test_leaving_an_inclusion_and_coming_too_near_its_edge() -> None:
    assert judged(square(300.0, inclusion=True), flight(*OUT_AND_BACK)).keeps
    out = judged(square(150.0, inclusion=True), flight(*OUT_AND_BACK))
    assert "leaves inclusion polygon 1" in out.faults[0]
    near = judged(square(203.0, inclusion=True), flight(*OUT_AND_BACK))
    assert not near.keeps
    assert 1.4 < near.min_distance_m < 1.51
    assert "the vehicle may be 2.00 m beside it" in near.faults[0]


def test_home_outside_an_inclusion_is_a_fault_even_if_the_line_is_inside() -> None:
    verdict = judged(square(50.0, 100.0, 100.0, inclusion=True), flight((90.0, 100.0), (110.0, 100.0)))
    assert (verdict.keeps, verdict.part) == (False, "home")


def test_a_notch_of_an_inclusion_between_line_and_home() -> None:
    ring = at((-50, -50), (150, -50), (150, 150), (52, 150), (50, 60), (48, 150), (-50, 150))
    notched = polygon(ring, inclusion=True, where="test")
    verdict = judged(notched, flight((0.0, 0.0), (20.0, 100.0)))
    assert verdict.keeps
    assert not judged(notched, flight((0.0, 0.0), (0.0, 120.0), (100.0, 120.0))).keeps


def test_circles_are_taken_at_their_worse_size() -> None:
    line = flight((0.0, 0.0), (0.0, 100.0))
    assert not judged(circle(*at((503.0, 50.0))[0], 500.0, inclusion=False, where="test"), line).keeps
    assert judged(circle(*at((506.0, 50.0))[0], 500.0, inclusion=False, where="test"), line).keeps
    assert not judged(circle(*HOME, 102.5, inclusion=True, where="test"), line).keeps
    assert judged(circle(*HOME, 103.0, inclusion=True, where="test"), line).keeps


def test_floor_and_ceiling() -> None:
    line = flight(*OUT_AND_BACK, alt_m=20.0)
    assert judge_fence(Fence(floor_rel_home_m=18.0, ceiling_rel_home_m=32.0), line).keeps
    low = judge_fence(Fence(floor_rel_home_m=18.1), line)
    assert "floor is at 18.1 m" in low.faults[0]
    high = judge_fence(Fence(ceiling_rel_home_m=31.9), line)
    assert "climbs to 30.00 m" in high.faults[0]  # the way home
    assert high.line_keeps
    assert not low.line_keeps
    higher = judge_fence(Fence(ceiling_rel_home_m=51.0), replace(line, line_rel_home_m=np.full(3, 49.5)))
    assert (higher.keeps, higher.line_keeps) == (False, False)


def test_a_fence_on_the_other_side_of_the_earth_is_not_judged_as_kept() -> None:
    far = circle(37.1, -4.3, 50.0, inclusion=True, where="test")
    verdict = judged(far, flight(*OUT_AND_BACK))
    assert not verdict.keeps
    assert "not judged" in verdict.faults[0]


@pytest.mark.parametrize(
    ("corners", "said"),
    [
        ([(0.0, 0.0), (0.0, 1e-3)], "three corners"),
        ([(0.0, 0.0), (0.0, 1e-3), (0.0, 0.0)], "three corners"),
        ([(0.0, 0.0), (1e-3, 1e-3), (0.0, 1e-3), (1e-3, 0.0)], "crosses or touches itself: its edges 1 and 3"),
        ([(0.0, 0.0), (0.0, 1e-3), (0.0, 2e-3)], "on one line"),
        ([(0.0, 0.0), (0.0, 1e-3), (0.0, 1e-3), (1e-3, 1e-3)], "corner 2 twice"),
        ([(0.0, 0.0), (0.0, 2.0), (2.0, 2.0)], "farther than 100 km"),
    ],
)
def test_a_polygon_that_encloses_nothing_is_refused(corners: list[tuple[float, float]], said: str) -> None:
    with pytest.raises(FormatError, match=said) as caught:
        polygon(corners, inclusion=True, where="file, polygon 2")
    assert caught.value.where == "file, polygon 2"
    assert caught.value.advice


@pytest.mark.parametrize("radius_m", [0.0, -1.0, math.nan, math.inf, 1e9])
def test_a_circle_without_a_radius_is_refused(radius_m: float) -> None:
    with pytest.raises(FormatError, match="radius"):
        circle(0.0, 0.0, radius_m, inclusion=False, where="test")


def test_a_floor_above_the_ceiling_is_refused() -> None:
    with pytest.raises(FormatError, match="floor"):
        fence([], [], floor_rel_home_m=50.0, ceiling_rel_home_m=50.0, where="test")


def test_hundreds_of_random_fences_against_the_brute_force() -> None:
    """No flight that passes crosses anything, and none is refused that keeps a hand's breadth more than the margin."""
    passed = refused = 0
    wrong: list[tuple[int, str]] = []
    plane = plane_about(HOME)
    for seed in range(300):
        rng = np.random.default_rng(seed)
        flown, shapes = _random_flight(rng), _random_fence(rng)
        verdict = judge_fence(shapes, flown)
        targets = xy_of(plane, [HOME, *flown.rally_lat_lon_deg])
        # Samples lie at most 1.5 m apart along each way, and the ways at most as much from each other: at the margin
        # a sample is then at most 0.3 m farther from a shape than the way is.
        kept_m = nearest_m(shapes, swept_places(xy_of(plane, flown.line_lat_lon_deg), targets, 1.5), plane)
        passed, refused = passed + verdict.keeps, refused + (not verdict.keeps)
        if verdict.keeps and kept_m < MARGIN_M:
            wrong.append((seed, f"passes, but comes within {kept_m:.3f} m"))
        if not verdict.keeps and kept_m > MARGIN_M + 0.4 + _circle_slack_m(shapes):
            wrong.append((seed, f"refused, but keeps {kept_m:.3f} m: {verdict.faults}"))
    assert wrong == []
    assert passed > 30
    assert refused > 30


def _circle_slack_m(shapes: Fence) -> float:
    return 0.007 * max((each.radius_m for each in shapes.circles), default=0.0)


def _random_flight(rng: np.random.Generator) -> FencedFlight:
    points = [(0.0, 0.0), *map(tuple, rng.uniform(-60.0, 60.0, (int(rng.integers(1, 4)), 2)))]
    rally = tuple(map(tuple, rng.uniform(-60.0, 60.0, (int(rng.integers(0, 2)), 2))))
    return flight(*points, rally_m=rally)


def _random_fence(rng: np.random.Generator) -> Fence:
    """Exclusions around the flight, mostly, and now and then an inclusion that may hold all of it."""
    polygons, circles = [], []
    for _ in range(int(rng.integers(1, 4))):
        inclusion = bool(rng.random() < 0.25)
        centre = rng.uniform(-20.0, 20.0, 2) if inclusion else rng.uniform(-90.0, 90.0, 2)
        size_m = rng.uniform(80.0, 200.0) if inclusion else rng.uniform(4.0, 30.0)
        if rng.random() < 0.5:
            circles.append(circle(*at(tuple(centre))[0], size_m, inclusion=inclusion, where="test"))
        else:
            polygons.append(_star(rng, centre, size_m, inclusion=inclusion))
    return Fence(tuple(polygons), tuple(circles))


def _star(rng: np.random.Generator, centre: np.ndarray, size_m: float, *, inclusion: bool) -> FencePolygon:
    count = int(rng.integers(3, 12))
    angles = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2 * math.pi / count
    radii = size_m * rng.uniform(0.4, 1.0, count)
    corners = [(centre[0] + r * math.cos(a), centre[1] + r * math.sin(a)) for a, r in zip(angles, radii, strict=True)]
    return polygon(at(*corners), inclusion=inclusion, where="test")


def test_one_triangle_over_all_edges_at_once_is_as_near_as_edge_by_edge() -> None:
    rng = np.random.default_rng(7)
    zeros = 0
    for _ in range(100):
        count = int(rng.integers(3, 40))
        angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, count))
        corners_m = (rng.uniform(5.0, 60.0, count) * np.array([np.sin(angles), np.cos(angles)])).T
        triangle_m = rng.uniform(-80.0, 80.0, 2) + rng.uniform(-25.0, 25.0, (3, 2))
        triangle_m[2] = triangle_m[int(rng.integers(1, 3))]  # half of them are legs of no width
        for inclusion in (False, True):
            expected_m = float(to_polygon(triangle_m[None], corners_m, inclusion=inclusion).distance_m[0])
            assert one_to_polygon(triangle_m, corners_m, inclusion=inclusion) == pytest.approx(expected_m, abs=1e-9)
            zeros += expected_m == 0.0
    assert 33 < zeros < 166
