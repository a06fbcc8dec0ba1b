"""Wind over the simulated world."""

import math

import numpy as np
import pytest

from telemetry.simulation.simulator.airframe.dynamics import GUST_SHARE, Wind


def blown(seed: int, speed_m_s: float, from_rad: float, steps: int) -> np.ndarray:
    wind = Wind(np.random.default_rng(seed))
    return np.array([wind.step(speed_m_s, from_rad, 0.1) for _ in range(steps)])


def test_no_wind_is_still() -> None:
    assert not blown(0, 0.0, 1.0, 100).any()


def test_blows_from_where_it_is_said_to() -> None:
    north, east, up = blown(1, 6.0, math.radians(270), 20_000).mean(axis=0)
    assert (north, east, up) == pytest.approx((0, 6, 0), abs=0.15)


def test_gusts_have_their_share_of_the_speed() -> None:
    spread = blown(2, 5.0, 0.0, 40_000).std(axis=0)
    assert spread == pytest.approx(GUST_SHARE * 5.0 * np.array([1, 1, 0.5]), rel=0.1)


def test_the_same_seed_gives_the_same_gusts() -> None:
    assert np.array_equal(blown(3, 4.0, 1.0, 100), blown(3, 4.0, 1.0, 100))
    assert not np.array_equal(blown(3, 4.0, 1.0, 100), blown(4, 4.0, 1.0, 100))
