"""The arena: ways past two poles, a radar with the printed limits, and what becomes of them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from planning.errors import ParameterError
from telemetry.scenarios import arena, arena_course
from telemetry.scenarios.arena_course import Approach, approaches
from telemetry.scenarios.arena_flight import fly
from telemetry.scenarios.arena_radar import Position2Go
from telemetry.scenarios.catalogue import NAMES
from telemetry.scenarios.wanted import Wanted

AHEAD = Approach(np.array([[0.0, 0.5], [0.0, 3.0]]), np.array([0.0, -5.0]), np.array([0.0, 5.0]))


def test_ways_come_from_all_around_and_most_would_hit_a_pole():
    ways = approaches(26, np.random.default_rng(1))
    for way in ways:
        for place in (way.start_enu_m, way.goal_enu_m):
            assert np.abs(place).max() == pytest.approx(arena_course.HALF_M)
        assert way.gap_m(way.start_enu_m) > 1.0
        assert way.length_m > 5.0
    sides = {round(math.atan2(*way.start_enu_m) / (math.pi / 4)) % 8 for way in ways}
    assert sides == set(range(8))
    assert np.mean([way.gap_straight_on_m() <= 0.0 for way in ways]) > 0.85


def test_the_gap_is_between_hulls():
    assert AHEAD.gap_m(np.array([1.0, 0.5])) == pytest.approx(1.0 - 0.25 - 0.2)
    assert AHEAD.gap_straight_on_m() < 0.0


def test_the_radar_sees_within_its_printed_limits_only():
    radar = Position2Go(detection_probability=1.0, false_alarms=0.0)
    true = np.array(
        [[0.9, 0.0, 0.0], [12.1, 0.0, 0.0], [5.0, math.radians(39.0), 0.0], [5.0, math.radians(-39.0), 0.0]]
    )
    assert len(radar.frame(true, np.random.default_rng(0))) == 0
    assert len(radar.frame(np.array([[5.0, math.radians(37.0), 0.0]]), np.random.default_rng(0))) == 1


def test_the_radars_errors_are_the_printed_ones():
    radar, random = Position2Go(detection_probability=1.0, false_alarms=0.0), np.random.default_rng(0)
    for bearing_deg, sigma_deg in ((10.0, 2.0), (30.0, 8.0)):
        true = np.array([[6.0, math.radians(bearing_deg), -1.0]])
        off = np.concatenate([radar.frame(true, random) for _ in range(2000)]) - true
        assert np.degrees(off[:, 1].std()) == pytest.approx(sigma_deg, rel=0.1)
        assert off[:, 0].std() == pytest.approx(0.15, rel=0.1)


def test_of_three_things_in_one_range_bin_two_are_seen():
    exact = Position2Go(detection_probability=1.0, false_alarms=0.0, range_sigma_m=1e-6)
    true = np.array([[5.4, -0.2, 0.0], [5.5, 0.0, 0.0], [5.6, 0.2, 0.0], [8.0, 0.0, 0.0]])
    assert len(exact.frame(true, np.random.default_rng(0))) == 3


@pytest.mark.parametrize("nearest_only", [True, False])
def test_a_pole_straight_ahead_is_passed(nearest_only):
    flown = fly(AHEAD, np.random.default_rng(0), nearest_only=nearest_only)
    assert flown.arrived
    assert flown.nearest_gap_m > 0.0
    assert flown.first_evasion_s is not None
    assert len(flown.errors) > 10


def test_without_a_radar_that_sees_it_is_hit(monkeypatch):
    """What shows that the poles are really in the way, and that nothing but the radar's tracks avoids them."""
    monkeypatch.setattr(Position2Go, "frame", lambda self, true, random: np.empty((0, 3)))
    flown = fly(AHEAD, np.random.default_rng(0), nearest_only=False)
    assert flown.nearest_gap_m < 0.0


def test_a_few_ways_reach_the_figures_and_the_same_seed_flies_them_again():
    results = [arena.through("a few", 4, np.random.default_rng(3), nearest_only=False) for _ in range(2)]
    assert results[0].figures == results[1].figures
    avoided = results[0].figures[0]
    assert avoided.words == "a few: avoided"
    assert avoided.value == 1.0
    assert avoided.least == 0.98
    assert any("deg off the nose" in note for note in results[0].notes)


def test_the_arena_is_in_the_catalogue_and_takes_no_world():
    assert arena.NAME in NAMES
    with pytest.raises(ParameterError, match="--world"):
        arena.run(Wanted(world=Path("my.json")))
    with pytest.raises(ParameterError, match="--record"):
        arena.run(Wanted(record=Path("my.mcap")))
