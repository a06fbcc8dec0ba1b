"""The velocity to fly now: wanted, else the nearest that leads into nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planning.evading.reachable import shortfall
from planning.evading.steering import SHARES, steer, with_ground
from planning.evading.velocity_obstacles import Limits, Obstacles, approaches

LIMITS = Limits(max_speed_m_s=5.0)
NORTH = np.array([0.0, 3.0])


def poles(*places: tuple[float, float], radius_m: float = 2.0) -> Obstacles:
    return Obstacles.of([0.0, 0.0], np.array(places).reshape(-1, 2), np.zeros((len(places), 2)), radius_m=radius_m)


def test_what_is_wanted_is_flown_while_it_leads_into_nothing():
    found = steer(poles((5.0, 10.0)), NORTH, NORTH, LIMITS)
    assert found is not None
    assert found.velocity_enu_m_s == (0.0, 3.0)
    assert found.evades == ()


@pytest.mark.parametrize("aside_m_s", [-0.8, 0.8])
def test_it_stays_on_the_side_that_it_has_taken(aside_m_s):
    """A pole a little to the right of the line: from the wanted velocity alone the left would be nearer."""
    now = np.array([aside_m_s, 2.9])
    found = steer(poles((0.05, 12.0)), NORTH, now, LIMITS)
    assert found is not None
    assert math.copysign(1.0, found.velocity_enu_m_s[0]) == math.copysign(1.0, aside_m_s)
    assert approaches(poles((0.05, 12.0)), found.velocity_enu_m_s).closest_m[0] >= 2.0


def test_where_the_whole_radius_leaves_nothing_somewhat_less_is_kept():
    gap = poles((-1.9, 4.0), (1.9, 4.0), (-3.0, 0.0), (3.0, 0.0), radius_m=2.0)
    narrow = Limits(max_speed_m_s=5.0, max_turn_rad=math.radians(5.0))
    found = steer(gap, NORTH, NORTH, narrow)
    assert found is not None
    assert approaches(gap, found.velocity_enu_m_s).closest_m.min() >= SHARES[-1] * 2.0


def test_ground_that_rises_is_an_obstacle_in_its_directions():
    room = tuple(8.0 if 30 <= k < 90 else 40.0 for k in range(120))  # ground from east to west, by way of the south
    everything = with_ground(poles((0.0, 10.0)), room, farthest_m=20.0)
    south_east = approaches(everything, (2.0, -2.0))
    assert south_east.closest_m.min() < 0.5
    north_east = approaches(everything, (2.0, 2.9))
    clear = north_east.closest_m >= everything.radius_m
    assert clear[1:].all()
    assert with_ground(poles((0.0, 10.0)), (), farthest_m=20.0).range_m.tolist() == [10.0]
    assert with_ground(poles(), (40.0,) * 120, farthest_m=20.0).range_m.tolist() == []


def test_the_nearest_is_the_nearest_ahead_not_what_is_being_left_behind():
    """A pole that was passed is remembered beside the vehicle, nearer than the next one."""
    passed_and_next = poles((1.6, -0.4), (0.2, 4.0), radius_m=1.0)
    found = steer(passed_and_next, NORTH, NORTH, LIMITS, nearest_only=True)
    assert found is not None
    assert approaches(passed_and_next, found.velocity_enu_m_s).closest_m[1] >= 1.0
    inside = steer(poles((0.6, -0.4), (0.2, 4.0), radius_m=1.0), NORTH, NORTH, LIMITS, nearest_only=True)
    assert inside is not None
    assert np.dot(inside.velocity_enu_m_s, (0.6, -0.4)) < 0.0  # too near: away from it first


def test_the_nearest_one_chooses_and_room_is_left_to_all():
    """Two poles side by side: past the nearer one on the side on which the other one stands."""
    pair = poles((-0.3, 3.0), (1.4, 3.4), radius_m=1.0)
    paper = steer(pair, NORTH, NORTH, LIMITS, nearest_only=True)
    room = steer(pair, NORTH, NORTH, LIMITS, nearest_only=True, by_room=True)
    assert paper is not None
    assert room is not None
    assert approaches(pair, paper.velocity_enu_m_s).closest_m[1] < 0.7
    worst = shortfall(pair, NORTH, np.array([paper.velocity_enu_m_s, room.velocity_enu_m_s]))
    assert worst[1] < worst[0]
