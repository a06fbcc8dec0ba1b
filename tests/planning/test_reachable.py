"""What a velocity comes to when the vehicle cannot change to it at once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from planning.evading.reachable import ACCEL_M_S2, HORIZON_S, roomiest, shortfall
from planning.evading.steering import ENOUGH, steer
from planning.evading.velocity_obstacles import Limits, Obstacles

LIMITS = Limits(max_speed_m_s=3.0)
NORTH = np.array([0.0, 2.0])


def obstacles(*places: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0), radius_m: float = 1.0):
    return Obstacles.of([0.0, 0.0], places, [velocity] * len(places), radius_m=radius_m)


def slowly(around: Obstacles, velocity: np.ndarray, to: np.ndarray) -> float:
    """Step by step, as a vehicle would fly it."""
    dt_s, worst = 0.002, 0.0
    place, now = np.zeros(2), velocity.copy()
    for k in range(round(HORIZON_S / dt_s)):
        left = to - now
        now = now + left * min(1.0, ACCEL_M_S2 * dt_s / max(math.hypot(*left), 1e-12))
        place = place + dt_s * now
        others = around.obstacles_enu_m + (k + 1) * dt_s * around.velocities_enu_m_s
        worst = max(worst, float((1.0 - np.hypot(*(others - place).T) / around.radius_m).max()))
    return worst


@pytest.mark.parametrize("seed", range(8))
def test_it_is_what_flying_it_step_by_step_comes_to(seed: int) -> None:
    random = np.random.default_rng(seed)
    around = obstacles((0.6, 3.5), (-2.0, 5.0), velocity=tuple(random.uniform(-1, 1, 2)), radius_m=1.5)
    velocity, candidates = random.uniform(-2, 2, 2), random.uniform(-3, 3, (4, 2))
    found = shortfall(around, velocity, candidates)
    assert found == pytest.approx([slowly(around, velocity, to) for to in candidates], abs=0.1)


def test_nothing_around_nothing_is_come_too_near() -> None:
    assert shortfall(obstacles(), NORTH, np.zeros((3, 2))).tolist() == [0.0, 0.0, 0.0]


def test_the_roomiest_comes_less_near_than_stopping_or_going_on() -> None:
    pole = obstacles((0.1, 1.6))
    best = roomiest(pole, NORTH, NORTH, LIMITS)
    stop, on = np.zeros(2), NORTH
    worst = shortfall(pole, NORTH, np.array([best, stop, on]))
    assert worst[0] < worst[1:].min()
    assert best[0] < 0.0  # away from the side on which it stands
    assert math.hypot(*best) <= LIMITS.max_speed_m_s + 1e-9


def steered(around: Obstacles, **choice: Any) -> np.ndarray:
    found = steer(around, NORTH, NORTH, LIMITS, **choice)
    assert found is not None
    assert found.evades
    return np.array([found.velocity_enu_m_s])


def test_a_velocity_that_cannot_be_reached_in_time_gives_way_to_the_one_with_the_most_room() -> None:
    near = obstacles((0.3, 1.7))
    edge, room = steered(near), steered(near, by_room=True)
    assert shortfall(near, NORTH, edge)[0] > shortfall(near, NORTH, room)[0] + 0.05


@pytest.mark.parametrize("nearest_only", [False, True])
def test_far_ahead_both_choices_are_the_nearest_velocity_on_the_edge(nearest_only: bool) -> None:
    far = obstacles((0.3, 12.0))
    edge = steered(far, nearest_only=nearest_only)
    assert shortfall(far, NORTH, edge)[0] <= ENOUGH
    assert steered(far, nearest_only=nearest_only, by_room=True).tolist() == edge.tolist()


def test_where_no_velocity_is_free_the_roomiest_is_flown_and_in_the_papers_way_none() -> None:
    ring = [(2.0 * math.sin(a), 2.0 * math.cos(a)) for a in np.arange(0.0, math.tau, 0.4)]
    narrow = obstacles(*ring, radius_m=2.9)
    assert steer(narrow, NORTH, NORTH, LIMITS) is None
    found = steer(narrow, NORTH, NORTH, LIMITS, by_room=True)
    assert found is not None
    assert math.hypot(*found.velocity_enu_m_s) <= LIMITS.max_speed_m_s
