"""The place of a line that belongs to a position: against a slow oracle, and what must hold whatever the line."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mapping.geometry.polyline import along_m
from planning.following.nearest import follow, follow_track
from tests.planning.following_lines import flown, line
from tests.reference import following as oracle

POINTS = arrays(np.float64, (5, 3), elements=st.floats(-50, 50).map(lambda v: round(v, 2)))
OFFSET = st.floats(-20, 20)
STEP_M = 0.02


@given(points=POINTS, x=OFFSET, y=OFFSET, z=OFFSET)
@settings(max_examples=40, deadline=None)
def test_never_nearer_than_the_nearest_place_and_never_much_farther(points, x, y, z):
    assume(np.all(np.hypot(*np.diff(points[:, :2], axis=0).T) > 0.5))
    found = follow(line(points), (x, y, z))
    exact_m = oracle.cross_track(points, np.array([x, y, z]), STEP_M)
    assert abs(found.cross_track_m) >= exact_m - STEP_M
    # The choice between legs weighs the height too.
    assert abs(found.cross_track_m) <= exact_m + 0.2 * 120


@given(x=st.floats(0, 100), y=st.floats(-30, 30), z=OFFSET)
def test_beside_a_straight_line(x, y, z):
    found = follow(line([(0, 0, 10), (40, 0, 30), (100, 0, 0)]), (x, y, z))
    points = np.array([(0, 0, 10), (40, 0, 30), (100, 0, 0)], dtype=float)
    place = np.array([x, y, z])
    assert found.s_m == pytest.approx(x, abs=1e-9)
    assert found.cross_track_m == pytest.approx(-y, abs=1e-9)  # to the east: north is left
    assert found.height_error_m == pytest.approx(oracle.height_error(points, place, STEP_M), abs=2 * STEP_M)


@given(points=POINTS, leg=st.integers(0, 3), share=st.floats(0, 1))
@settings(deadline=None)
def test_a_position_on_the_line_has_no_error(points, leg, share):
    assume(np.all(np.hypot(*np.diff(points[:, :2], axis=0).T) > 0.5))
    reference = line(points)
    x, y, z = points[leg] + share * (points[leg + 1] - points[leg])
    near_s_m = reference.s_m[leg] + share * (reference.s_m[leg + 1] - reference.s_m[leg])
    found = follow(reference, (x, y, z), near_s_m=near_s_m)
    assert found.cross_track_m == pytest.approx(0.0, abs=1e-6)
    assert found.height_error_m == pytest.approx(0.0, abs=1e-5)


@given(
    points=POINTS, x=OFFSET, y=OFFSET, z=OFFSET, turn=st.floats(-math.pi, math.pi), east=OFFSET, north=OFFSET, up=OFFSET
)
@settings(deadline=None)
def test_turning_and_shifting_everything_changes_nothing(points, x, y, z, turn, east, north, up):
    assume(np.all(np.hypot(*np.diff(points[:, :2], axis=0).T) > 0.5))
    R = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
    shift = np.array([east, north, up])
    before = follow(line(points), (x, y, z))
    moved = R @ np.array([x, y, z]) + shift
    after = follow(line(points @ R.T + shift), (moved[0], moved[1], moved[2]))
    size = math.hypot(before.cross_track_m, 0.2 * before.height_error_m)
    # Two places may be equally near: the nearness is what must stay.
    assert math.hypot(after.cross_track_m, 0.2 * after.height_error_m) == pytest.approx(size, abs=1e-6)


def test_right_is_positive():
    north = line([(0, 0, 5), (0, 100, 5)])
    assert follow(north, (3, 50, 5)).cross_track_m == pytest.approx(3)
    assert follow(north, (-3, 50, 5)).cross_track_m == pytest.approx(-3)


def test_a_crossing_is_passed_straight_on():
    eight = line([(0, 0, 10), (100, 0, 10), (100, 50, 10), (50, 50, 10), (50, -50, 10)])
    t_s, xyz_m = flown(eight)
    beside = xyz_m + np.random.default_rng(3).normal(0.0, 0.3, xyz_m.shape)
    found = follow_track(eight, beside)
    assert np.abs(found.s_m - np.minimum(2.0 * t_s, eight.length_m)).max() < 3.0


@pytest.mark.parametrize("noise_m", [0.0, 0.05])
def test_there_and_back_on_the_same_way_goes_on(noise_m):
    there_and_back = line([(0, 0, 10), (60, 0, 20), (0, 0, 10)])
    t_s, xyz_m = flown(there_and_back)
    found = follow_track(there_and_back, xyz_m + np.random.default_rng(4).normal(0.0, noise_m, xyz_m.shape))
    assert np.abs(found.s_m - np.minimum(2.0 * t_s, there_and_back.length_m)).max() < 6.0
    assert found.s_m[-1] == pytest.approx(120, abs=6)


def test_a_vehicle_that_was_lost_is_found_elsewhere():
    loop = line([(0, 0, 10), (200, 0, 10), (200, 100, 10), (0, 100, 10)])
    found = follow(loop, (100, 100, 10), near_s_m=10.0)
    assert found.s_m == pytest.approx(400)


def test_a_climb_on_the_spot():
    climb = line([(0, 0, 10), (50, 0, 10), (50, 0, 40), (0, 0, 40)])
    for height in (12.0, 25.0, 38.0):
        found = follow(climb, (50.03, 0.02, height), near_s_m=50.0)
        assert found.leg == 1
        assert found.height_error_m == pytest.approx(0.0, abs=1e-9)
        assert found.share == pytest.approx((height - 10) / 30)


def test_a_track_is_followed_as_its_positions_are():
    zigzag = line([(0, 0, 10), (30, 5, 12), (60, -5, 9), (90, 0, 15)])
    _, xyz_m = flown(zigzag)
    xyz_m += np.random.default_rng(5).normal(0.0, 0.2, xyz_m.shape)
    together = follow_track(zigzag, xyz_m)
    near = None
    for k, (x, y, z) in enumerate(xyz_m):
        alone = follow(zigzag, (x, y, z), near_s_m=near)
        near = alone.s_m
        assert (alone.s_m, alone.cross_track_m, alone.height_error_m) == (
            together.s_m[k],
            together.cross_track_m[k],
            together.height_error_m[k],
        )


def test_ending_at_an_item():
    whole = line([(0, 0, 10), (30, 0, 10), (60, 0, 10)])
    part = whole.ending_at(1)
    assert not part.whole
    assert part.length_m == 30
    assert follow(part, (33, 0, 10)).cross_track_m == pytest.approx(3)
    assert whole.ending_at(2) is whole
    assert whole.ending_at(99) is whole
    assert np.array_equal(along_m(part.points_m[:, :2]), part.s_m)
    assert replace(part, whole=True).last_item == 1
