"""The velocity to fly now: wanted, else the nearest that leads into nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planning.steering import SHARES, steer, with_ground
from planning.velocity_obstacles import Limits, Obstacles, approaches

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
