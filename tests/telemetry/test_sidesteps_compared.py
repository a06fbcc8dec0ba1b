"""Sidesteps as they are flown live, beside BlueSky's MVP on the same noisy tracks; all 1,000 of them: `make bench`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from telemetry.topics.track_settings import VelocitySettings
from tests.telemetry.bluesky_mvp import Mvp, is_installed
from tests.telemetry.sidesteps_compared import (
    COUNT,
    KEEP_M,
    LIVE,
    NORTH,
    SEED,
    Encounter,
    encounters,
    modified_voltage_potential,
    nearest_m,
    velocity_obstacles,
)

peer = pytest.mark.skipif(
    not is_installed(), reason="BlueSky is not installed: pip install --no-deps -r requirements-peers.txt"
)
HARD = (49, 89, 308, 452, 853, 916, 929)
"""Of those at which an earlier way of avoiding came within the distance: out of the radar's sight, or slow."""


def met(*numbers: int) -> list[Encounter]:
    every = encounters(COUNT, SEED)
    return [every[k] for k in numbers]


def test_of_encounters_that_nobody_avoids_all_come_too_near() -> None:
    least_m = [nearest_m(one, lambda *_: NORTH) for one in met(*range(20))]
    assert max(least_m) < KEEP_M


@pytest.mark.parametrize("number", HARD)
def test_what_leaves_the_radars_sight_or_is_slow_is_kept_away_from_all_the_same(number: int) -> None:
    (one,) = met(number)
    assert nearest_m(one, velocity_obstacles()) >= KEEP_M


def test_the_papers_choice_can_still_be_flown() -> None:
    paper = VelocitySettings(max_speed_m_s=5.0, nearest_only=True, choice="edge")
    least_m = [nearest_m(one, velocity_obstacles(replace(LIVE, velocities=paper))) for one in met(*range(8))]
    assert np.median(least_m) >= KEEP_M


@peer
def test_ours_comes_too_near_no_more_often_than_mvp() -> None:
    some = met(*HARD, *range(100, 120))
    ours = sum(nearest_m(one, velocity_obstacles()) < KEEP_M for one in some)
    theirs = sum(nearest_m(one, modified_voltage_potential()) < KEEP_M for one in some)
    assert ours <= theirs


@peer
def test_mvp_resolves_a_conflict_as_its_paper_draws_it() -> None:
    """Hoekstra et al. 2002: the predicted closest approach is pushed out to the radius, along the shortest way."""
    offset, own, other, radius_m, after_s = np.array([1.0, 40.0]), np.array([0.0, 4.0]), np.array([0.0, -4.0]), 4.0, 5.0
    change = Mvp().change(offset, own, other, radius_m=radius_m, within_s=8.0, after_s=after_s)
    at_closest = offset + after_s * (other - own)  # 1 m to the east: it is left to the west
    distance_m = float(np.hypot(*at_closest))
    beyond = 1.0 / np.cos(np.arcsin(radius_m / np.hypot(*offset)) - np.arcsin(distance_m / np.hypot(*offset)))
    pushed_m = radius_m * beyond - distance_m
    assert change == pytest.approx([-pushed_m / after_s, 0.0], abs=1e-6)
