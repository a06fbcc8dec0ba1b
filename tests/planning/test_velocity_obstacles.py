"""Velocity obstacles: what is proposed leads into nothing, keeps to the limits, and is the nearest that does."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from planning.errors import ParameterError
from planning.evading.velocity_obstacles import STILL_M_S, Limits, Obstacles, approaches, cones, propose
from tests.reference import velocity_obstacles as slow

ROUNDING_M = 1e-4
"""Of a present velocity that is on a cone's very edge."""
COORDINATE, SPEED = st.floats(-40.0, 40.0), st.floats(-8.0, 8.0)
PAIR, PAIR_M_S = st.tuples(COORDINATE, COORDINATE), st.tuples(SPEED, SPEED)
OBSTACLE = st.tuples(PAIR, PAIR_M_S, st.floats(0.0, 12.0))
LIMITS = st.builds(
    Limits,
    max_speed_m_s=st.floats(0.5, 12.0),
    max_turn_rad=st.one_of(st.just(math.pi), st.floats(0.1, 3.0)),
    leave_m_s=st.floats(0.0, 1.0),
)


def one(place=(0.0, 20.0), velocity=(0.0, 0.0), radius_m=3.0) -> Obstacles:
    return Obstacles.of((0.0, 0.0), [place], [velocity], radius_m=radius_m)


def many(rows) -> Obstacles:
    return Obstacles.of(
        (0.0, 0.0), [row[0] for row in rows], [row[1] for row in rows], radius_m=[row[2] for row in rows]
    )


def test_a_cone_is_as_wide_as_the_radius_over_the_range_and_stands_at_the_obstacles_velocity():
    [cone] = cones(one(place=(20.0, 0.0), velocity=(-3.0, 1.0), radius_m=10.0))
    assert cone.apex_enu_m_s == (-3.0, 1.0)
    assert cone.axis_rad == pytest.approx(math.pi / 2)
    assert cone.half_angle_rad == pytest.approx(math.pi / 6)


@pytest.mark.parametrize("radius_m", [20.0, 20.1, 1e6])
def test_a_radius_beyond_the_range_is_a_right_angle(radius_m):
    [cone] = cones(one(radius_m=radius_m))
    assert cone.half_angle_rad == pytest.approx(math.pi / 2)


def test_the_closest_approach_of_two_that_cross():
    coming = approaches(one(place=(10.0, 20.0), velocity=(-2.0, 0.0)), (0.0, 5.0))
    assert coming.after_s[0] == pytest.approx((10 * 2 + 20 * 5) / 29)
    assert coming.closest_m[0] == pytest.approx(10 / math.sqrt(29))


def test_what_goes_away_is_nearest_now():
    coming = approaches(one(velocity=(0.0, 9.0)), (0.0, 5.0))
    assert (coming.closest_m[0], coming.after_s[0]) == (20.0, 0.0)


def test_two_that_keep_their_distance_for_ever():
    coming = approaches(one(velocity=(0.0, 5.0)), (0.0, 5.0))
    assert (coming.closest_m[0], coming.after_s[0]) == (20.0, 0.0)


@given(PAIR, PAIR_M_S, PAIR_M_S)
@example((1.0, 0.0), (0.0, 0.0), (1e-6, 0.0))
def test_the_closest_approach_is_that_of_ways_stepped_through_time(place, theirs, ours):
    obstacles = one(place, theirs)
    coming = approaches(obstacles, ours)
    assume(coming.after_s[0] < 30.0)
    relative = np.subtract(ours, theirs)
    tried = slow.closest_m(np.array(place), relative, until_s=coming.after_s[0] + 0.1, step_s=0.01)
    # What moves as slowly as nothing is taken to stand, also for the 0.1 s beyond.
    one_step_m, standing_m = 0.01 * math.hypot(*relative), 0.1 * STILL_M_S
    assert tried == pytest.approx(coming.closest_m[0], abs=one_step_m + standing_m + 1e-8)


@settings(max_examples=120)
@given(st.lists(OBSTACLE, min_size=1, max_size=6), PAIR_M_S, LIMITS, st.booleans())
@example([((0.0, 0.0), (0.0, 0.0), 1.0)], (0.0, 5.0), Limits(), False)
@example([((0.0, 3.0), (0.0, 0.0), 3.0)], (0.0, 5.0), Limits(), False)
@example([((0.0, 0.0), (0.0, -1.0), 0.0)], (0.0, 0.0), Limits(max_speed_m_s=1.0, leave_m_s=0.0), False)
def test_what_is_proposed_leads_into_nothing_and_keeps_to_the_limits(rows, velocity, limits, nearest_only):
    obstacles = many(rows)
    found = propose(obstacles, velocity, limits, nearest_only=nearest_only)
    if found is None:
        return
    chosen = np.array(found.velocity_enu_m_s)
    minded = obstacles.nearest() if nearest_only else obstacles
    coming = approaches(minded, chosen)
    outside = minded.range_m >= minded.radius_m
    assert (coming.closest_m[outside] >= minded.radius_m[outside] - ROUNDING_M).all()
    for cone, somewhere in zip(cones(minded), outside & (minded.range_m > 0.0), strict=True):
        if somewhere:  # a point where the vehicle is lies in no direction
            assert not _inside(cone, chosen)
    _leaves(minded, chosen, ~outside, limits)
    assert math.hypot(*chosen) <= limits.max_speed_m_s
    if math.hypot(*velocity) >= 0.1 and chosen.any():
        assert abs(found.turn_rad) <= limits.max_turn_rad + 1e-6
    assert found.closest_m == coming.closest_m.min()


def _inside(cone, velocity) -> bool:
    relative = velocity - cone.apex_enu_m_s
    if math.hypot(*relative) < 1e-6:
        return False
    off = math.remainder(math.atan2(*relative) - cone.axis_rad, 2 * math.pi)
    return abs(off) < cone.half_angle_rad - 1e-6


def _leaves(obstacles: Obstacles, velocity, inside, limits: Limits) -> None:
    """Whatever is already too near gets farther away."""
    for offset, theirs, near in zip(obstacles.offset_enu_m, obstacles.velocities_enu_m_s, inside, strict=True):
        if near and offset.any():
            assert (velocity - theirs) @ offset / np.hypot(*offset) <= -limits.leave_m_s + 1e-6


@settings(max_examples=25)
@given(st.lists(OBSTACLE, min_size=1, max_size=4), PAIR_M_S, st.one_of(st.just(math.pi), st.floats(0.3, 2.5)))
def test_no_velocity_that_is_allowed_is_much_nearer(rows, velocity, max_turn_rad):
    obstacles = many(rows)
    assume((obstacles.range_m > obstacles.radius_m + 0.01).all())
    assume(math.hypot(*velocity) > 0.2)
    limits = Limits(max_speed_m_s=6.0, max_turn_rad=max_turn_rad)
    tried = slow.nearest_free(
        np.array(velocity),
        obstacles.offset_enu_m,
        obstacles.velocities_enu_m_s,
        obstacles.radius_m,
        max_speed_m_s=6.0,
        max_turn_rad=max_turn_rad,
        steps=25,
    )
    found = propose(obstacles, velocity, limits)
    if found is not None:
        assert math.hypot(*np.subtract(found.velocity_enu_m_s, velocity)) <= tried + 0.02
    else:
        assert tried > 5.0 or tried == math.inf


def test_while_nothing_is_in_the_way_the_present_velocity_stays():
    found = propose(one(place=(0.0, -20.0)), (0.3, 5.0))
    assert found is not None
    assert found.velocity_enu_m_s == (0.3, 5.0)
    assert (found.turn_rad, found.hold_s, found.evades) == (0.0, 0.0, ())


def test_no_obstacles_at_all():
    found = propose(Obstacles.of((0, 0), [], [], radius_m=3.0), (0.3, 5.0))
    assert found is not None
    assert found.velocity_enu_m_s == (0.3, 5.0)
    assert found.closest_m == math.inf


@pytest.mark.parametrize(("aside_m", "side"), [(1.0, -1), (-1.0, 1)])
def test_the_nearer_edge_is_the_one_that_is_taken(aside_m, side):
    """Something to the right of the way is passed on its left, and the other way round."""
    found = propose(one(place=(aside_m, 20.0)), (0.0, 5.0))
    assert found is not None
    assert math.copysign(1, found.turn_rad) == side
    assert found.closest_m == pytest.approx(3.0, abs=0.01)
    assert found.evades == (0,)
    assert found.hold_s == pytest.approx(20 / 5, rel=0.1)


def test_of_one_cone_it_is_the_foot_on_the_edge_as_in_fig_3():
    found = propose(one(place=(0.5, 20.0)), (0.0, 5.0), Limits(max_speed_m_s=20.0))
    assert found is not None
    angle = math.asin(3 / math.hypot(0.5, 20)) - math.atan2(0.5, 20)
    edge = np.array([-math.sin(angle), math.cos(angle)])
    np.testing.assert_allclose(found.velocity_enu_m_s, 5.0 * math.cos(angle) * edge, atol=0.01)


def test_a_moving_obstacle_is_passed_behind_where_that_is_nearer():
    """It crosses from the right and would be hit a little behind its middle."""
    found = propose(one(place=(10.0, 20.0), velocity=(-2.6, 0.0)), (0.0, 5.0))
    assert found is not None
    assert found.turn_rad > 0.0
    assert found.closest_m >= 3.0


def test_the_paper_minds_the_nearest_only_and_we_all():
    """The way past the first leads into the second."""
    rows = [((1.0, 15.0), (0.0, 0.0), 3.0), ((-6.0, 30.0), (0.0, 0.0), 5.0)]
    paper, ours = (propose(many(rows), (0.0, 5.0), nearest_only=only) for only in (True, False))
    assert paper is not None
    assert ours is not None
    assert approaches(many(rows), paper.velocity_enu_m_s).closest_m[1] < 5.0
    assert (approaches(many(rows), ours.velocity_enu_m_s).closest_m >= [3.0, 5.0]).all()


def test_an_obstacle_inside_the_radius_is_left_behind():
    found = propose(one(place=(0.0, 2.0)), (0.0, 1.0), Limits(leave_m_s=0.4))
    assert found is not None
    assert found.velocity_enu_m_s[1] <= -0.4
    assert approaches(one(place=(0.0, 2.0)), found.velocity_enu_m_s).after_s[0] == 0.0


def test_an_obstacle_in_the_very_same_place():
    found = propose(one(place=(0.0, 0.0)), (0.0, 1.0))
    assert found is not None
    assert math.hypot(*found.velocity_enu_m_s) > 0.0


def test_a_limit_of_turn_makes_it_slow_down_or_stop():
    wall = many([((float(x), 12.0), (0.0, 0.0), 2.0) for x in range(-12, 13, 3)])
    free, bound = (propose(wall, (0.0, 5.0), Limits(max_turn_rad=turn)) for turn in (math.pi, 0.5))
    assert free is not None
    assert abs(free.turn_rad) > 0.5
    assert bound is not None
    assert bound.velocity_enu_m_s == (0.0, 0.0)


def test_surrounded_and_run_into_there_is_no_way():
    angles = np.linspace(0, 2 * math.pi, 12, endpoint=False)
    unit = np.column_stack([np.sin(angles), np.cos(angles)])
    closing = Obstacles.of((0, 0), 10 * unit, -3 * unit, radius_m=4.0)
    assert propose(closing, (0.0, 2.0), Limits(max_speed_m_s=2.0)) is None


def test_too_fast_already_it_slows_to_the_limit():
    found = propose(one(place=(0.0, -20.0)), (0.0, 9.0), Limits(max_speed_m_s=4.0))
    assert found is not None
    assert found.velocity_enu_m_s == pytest.approx((0.0, 4.0), abs=1e-6)


def test_a_thousand_obstacles_take_a_bounded_time():
    random = np.random.default_rng(0)
    places = random.uniform(-80, 80, (1000, 2))
    far = np.hypot(*places.T) > 8
    obstacles = Obstacles.of((0, 0), places[far], random.normal(0, 3, (1000, 2))[far], radius_m=1.0)
    began_s = time.thread_time()
    found = propose(obstacles, (0.0, 5.0))
    assert time.thread_time() - began_s < 30.0
    if found is not None:
        assert (approaches(obstacles, found.velocity_enu_m_s).closest_m >= 1.0).all()


def test_with_very_many_in_the_way_a_grid_still_finds_what_is_free():
    """A ring of 120 that leaves a gap."""
    angles = np.linspace(0.5, 2 * math.pi - 0.2, 120)
    ring = Obstacles.of((0, 0), 30 * np.column_stack([np.sin(angles), np.cos(angles)]), np.zeros((120, 2)), radius_m=3)
    found = propose(ring, (0.0, -5.0), Limits(max_speed_m_s=6.0))
    assert found is not None
    assert (approaches(ring, found.velocity_enu_m_s).closest_m >= 3.0).all()


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_what_is_no_number_is_refused(bad):
    with pytest.raises(ParameterError):
        one(place=(bad, 1.0))
    with pytest.raises(ParameterError):
        one(velocity=(bad, 1.0))
    with pytest.raises(ParameterError):
        one(radius_m=bad)
    with pytest.raises(ParameterError):
        Obstacles.of((bad, 0.0), [(1.0, 1.0)], [(0.0, 0.0)], radius_m=1.0)
    with pytest.raises(ParameterError):
        propose(one(), (bad, 0.0))
    with pytest.raises(ParameterError):
        approaches(one(), (bad, 0.0))
    with pytest.raises(ParameterError):
        Limits(max_speed_m_s=bad)


def test_a_negative_radius_and_missing_velocities_are_refused():
    with pytest.raises(ParameterError, match="radius"):
        one(radius_m=-1.0)
    with pytest.raises(ParameterError, match="velocities"):
        Obstacles.of((0, 0), [(1.0, 1.0)], [], radius_m=1.0)
