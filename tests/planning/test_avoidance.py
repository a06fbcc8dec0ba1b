"""Ways over and around what was seen: never lower, never nearer than told, and as clear as a slow oracle finds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.arrays import F32, F64
from planning.evading.manoeuvres import AvoidanceParams, Manoeuvre, NoWay, Seen, around, over
from tests.reference.box_distance import polyline_boxes_m

HERE = np.array([0.0, 0.0, 10.0])
LINE = np.array([[0.0, 0.0, 10.0], [0.0, 45.0, 12.0], [30.0, 80.0, 8.0]])


def block(east_m: float, north_m: float, width_m: float, top_m: float, *, edge_m: float = 1.0) -> Seen:
    """A solid box of voxels that stands on up = 0 and is 3 m deep."""
    e, n, u = np.meshgrid(
        np.arange(-width_m / 2, width_m / 2, edge_m) + edge_m / 2 + east_m,
        np.arange(0, 3, edge_m) + edge_m / 2 + north_m,
        np.arange(0, top_m, edge_m) + edge_m / 2,
    )
    return Seen(np.column_stack([e.ravel(), n.ravel(), u.ravel()]), edge_m)


@dataclass
class Slope:
    """Ground that rises to the east; 1 m cells around the origin."""

    up_m: F32
    enu_to_cell: F64
    cell_m: float = 1.0


def slope(rise: float = 0.0, base_m: float = 0.0, side: int = 240) -> Slope:
    east_m = np.arange(side) + 0.5 - side / 2
    up_m = np.tile(base_m + rise * east_m, (side, 1)).astype(np.float32)
    return Slope(up_m, np.array([[0.0, -1.0, side / 2], [1.0, 0.0, side / 2]]))


def plan_height_m(points: F64, line: F64) -> F64:
    """Height of the line where it is nearest over ground to each point."""
    out = []
    for p in points:
        best = (np.inf, 0.0)
        for a, b in pairwise(line):
            d = b - a
            t = np.clip(np.dot(p[:2] - a[:2], d[:2]) / np.dot(d[:2], d[:2]), 0, 1)
            q = a + t * d
            best = min(best, (float(np.hypot(*(p[:2] - q[:2]))), float(q[2])))
        out.append(best[1])
    return np.array(out)


def test_over_climbs_no_higher_than_it_must_and_joins_the_line_behind() -> None:
    seen = block(0, 20, 12, 18)
    way = over(HERE, LINE, [seen])
    assert isinstance(way, Manoeuvre)
    assert (way.points_enu_m[0] == HERE).all()
    assert way.points_enu_m[1, :2] == pytest.approx(HERE[:2])
    assert 9.0 <= way.height_offset_m <= 9.5  # to 2 m above a top of 18 m, on a line that is at 10.9 m there
    assert way.seen_m >= 2.0
    assert way.surface_m == np.inf
    assert way.points_enu_m[-1, 1] > 23
    assert way.leg == 0


def test_around_leaves_the_line_on_the_shorter_side() -> None:
    seen = block(5, 20, 20, 30)  # reaches 5 m to the left and 15 m to the right
    way = around(HERE, LINE, [seen])
    assert isinstance(way, Manoeuvre)
    assert way.points_enu_m[:, 0].min() == pytest.approx(-10.0, abs=1.1)
    assert way.points_enu_m[:, 0].max() < 1.0
    assert way.height_offset_m == 0.0
    assert way.points_enu_m[-1, 1] > 25


@pytest.mark.parametrize("deep_m", [3.0, 8.0, 14.0])
def test_around_does_not_cut_into_a_building_of_which_only_the_face_was_seen(deep_m: float) -> None:
    face, deeper_m = block(0, 20, 14, 30), np.arange(0.0, deep_m - 2.0)
    body = face.centres_enu_m[None] + deeper_m[:, None, None] * np.array([0.0, 1.0, 0.0])
    way = around(HERE, LINE, [face])
    assert isinstance(way, Manoeuvre)
    assert polyline_boxes_m(way.points_enu_m, body.reshape(-1, 3), 0.5) >= 2.0
    assert way.points_enu_m[-1, 1] > 20 + deep_m


def test_around_keeps_clear_of_the_hillside_beside_the_line() -> None:
    ground = slope(rise=-1.0, base_m=0.0)  # the hill is in the west
    seen = block(5, 20, 20, 30)
    way = around(HERE, LINE, [seen], ground)
    assert isinstance(way, Manoeuvre)
    assert way.surface_m >= 2.0
    level = around(HERE, LINE, [seen])
    assert isinstance(level, Manoeuvre)
    assert (way.points_enu_m[1:, :] != level.points_enu_m[: len(way.points_enu_m) - 1, :]).any()


@pytest.mark.parametrize(
    ("find", "words"),
    [
        (lambda: over(HERE, LINE, [block(0, 20, 12, 60)]), "not clear up to 30 m"),
        (lambda: over(HERE, LINE, [block(30, 20, 4, 30)]), "keeps 2 m"),
        (lambda: around(HERE, LINE[:2], [block(0, 43, 12, 30)]), "no way back"),
        (lambda: around(HERE, LINE, [block(0, 20, 120, 30)]), "within 40 m"),
        (lambda: around(HERE, LINE, [block(0, -1, 4, 30)]), "only 0.0 m"),
        (lambda: around(HERE, LINE, [block(2.9, 0, 4, 30), block(0, 20, 8, 30)]), "only 0.9 m"),
        (lambda: over(HERE, LINE[:1], []), "no mission"),
        (lambda: over(HERE, [[0, 0, 0], [np.nan, 0, 0]], []), "no mission"),
    ],
)
def test_why_there_is_no_way_is_said(find: Callable[[], Manoeuvre | NoWay], words: str) -> None:
    way = find()
    assert isinstance(way, NoWay)
    assert words in way.reason


def test_unknown_ground_is_no_way() -> None:
    ground = slope()
    ground.up_m[:] = np.nan
    assert isinstance(around(HERE, LINE, [block(0, 20, 12, 18)], ground), NoWay)


def test_a_vehicle_that_is_near_already_comes_no_nearer() -> None:
    seen = block(0, 1.5, 6, 14)
    here = np.array([0.0, 0.0, 10.0])
    for way in (over(here, LINE, [seen]), around(here, LINE, [seen])):
        assert isinstance(way, Manoeuvre)
        assert way.seen_m == pytest.approx(1.5)


boxes = st.tuples(st.floats(-12, 12), st.floats(6, 40), st.floats(2, 10), st.floats(6, 24))


@settings(max_examples=20)
@given(found=st.lists(boxes, min_size=1, max_size=2), up_m=st.floats(6, 16), rise=st.floats(-0.15, 0.15))
def test_no_way_is_lower_or_nearer_than_told(
    found: list[tuple[float, float, float, float]], up_m: float, rise: float
) -> None:
    here = np.array([0.0, 0.0, up_m])
    seen = [block(*each) for each in found]
    ground = slope(rise)
    params = AvoidanceParams()
    for find in (over, around):
        way = find(here, LINE, seen, ground, params)
        if isinstance(way, NoWay):
            assert way.reason
            continue
        points = way.points_enu_m
        assert (points[:, 2] >= up_m - 1e-9).all() or find is over
        assert (points[1:, 2] >= plan_height_m(points[1:], LINE) - 1e-6).all()
        at_start = polyline_boxes_m(np.vstack([here, here]), seen[0].centres_enu_m, seen[0].resolution_m / 2)
        told = min(way.seen_m, 60.0)
        true = min(polyline_boxes_m(points, each.centres_enu_m, each.resolution_m / 2) for each in seen)
        assert min(true, 60.0) == pytest.approx(told, abs=0.06)
        assert way.seen_m >= min(params.keep_m, at_start) - 1e-9 or len(seen) > 1
        assert min(way.seen_m, way.surface_m) >= params.radius_m
