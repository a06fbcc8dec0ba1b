"""The arena: ways past two poles, a radar with the printed limits, and what becomes of them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.errors import ParameterError
from planning.errors import ParameterError as PlanningError
from telemetry.flight.avoidance.aside import Aside
from telemetry.simulation.scenarios.arena import arena, arena_course
from telemetry.simulation.scenarios.arena.arena import error_charts, ways_chart
from telemetry.simulation.scenarios.arena.arena_course import Approach, approaches
from telemetry.simulation.scenarios.arena.arena_flight import ArenaFlown, arena_settings, fly
from telemetry.simulation.scenarios.arena.arena_radar import Position2GoModel
from telemetry.simulation.scenarios.catalogue import NAMES
from telemetry.simulation.scenarios.stage.result import ScenarioRequest
from telemetry.topics.track_settings import TrackerSettings
from telemetry.topics.vehicle import RadarKind

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
    radar = Position2GoModel(detection_probability=1.0, false_alarms=0.0)
    true = np.array(
        [[0.9, 0.0, 0.0], [12.1, 0.0, 0.0], [5.0, math.radians(39.0), 0.0], [5.0, math.radians(-39.0), 0.0]]
    )
    assert len(radar.frame(true, np.random.default_rng(0))) == 0
    assert len(radar.frame(np.array([[5.0, math.radians(37.0), 0.0]]), np.random.default_rng(0))) == 1


def test_the_radars_errors_are_the_printed_ones():
    radar, random = Position2GoModel(detection_probability=1.0, false_alarms=0.0), np.random.default_rng(0)
    for bearing_deg, sigma_deg in ((10.0, 2.0), (30.0, 8.0)):
        true = np.array([[6.0, math.radians(bearing_deg), -1.0]])
        off = np.concatenate([radar.frame(true, random) for _ in range(2000)]) - true
        assert np.degrees(off[:, 1].std()) == pytest.approx(sigma_deg, rel=0.1)
        assert off[:, 0].std() == pytest.approx(0.15, rel=0.1)


def test_of_three_things_in_one_range_bin_two_are_seen():
    exact = Position2GoModel(
        detection_probability=1.0, false_alarms=0.0, errors=replace(Position2GoModel().errors, range_sigma_m=1e-6)
    )
    true = np.array([[5.4, -0.2, 0.0], [5.5, 0.0, 0.0], [5.6, 0.2, 0.0], [8.0, 0.0, 0.0]])
    assert len(exact.frame(true, np.random.default_rng(0))) == 3


def flown(
    *, nearest_only: bool = False, radar: RadarKind = "model", tracker: TrackerSettings | None = None
) -> ArenaFlown:
    settings = arena_settings(nearest_only=nearest_only, tracker=tracker)
    return fly(AHEAD, np.random.default_rng(0), settings=settings, radar=radar)


@pytest.mark.parametrize(
    ("nearest_only", "radar", "coordinates"),
    [
        (True, "model", "cartesian"),
        (False, "model", "cartesian"),
        (False, "model", "polar"),
        (False, "iq", "cartesian"),
    ],
)
def test_a_pole_straight_ahead_is_passed_by_what_avoids_live(nearest_only, radar, coordinates):
    tracker = replace(Position2GoModel().errors, coordinates=coordinates)
    way = flown(nearest_only=nearest_only, radar=radar, tracker=tracker)
    assert way.arrived
    assert way.nearest_gap_m > 0.1
    assert way.climbed_m < 0.5
    assert way.first_evasion_s is not None
    assert len(way.errors) > 10


def test_while_its_present_velocity_is_free_and_the_wanted_is_not_it_flies_on_and_not_to_the_line():
    """A way on which it flew to its line through a pole that it remembered beside it."""
    way = one_of(31, 61)
    assert way.nearest_gap_m > 0.2
    assert way.arrived


def one_of(seed: int, number: int, *, nearest_only: bool = False) -> ArenaFlown:
    random = np.random.default_rng([seed, 6 if nearest_only else 5])
    ways = approaches(26 if nearest_only else 78, random)
    for _ in range(number):
        random.integers(2**31)  # the seeds of the ways before it
    return fly(ways[number], random, settings=arena_settings(nearest_only=nearest_only), radar="model")


def test_a_way_to_the_south_begins_with_the_nose_along_it_and_the_pole_in_view():
    """It began with its nose to the north, and saw a pole that stood 3 m ahead when it was 1 m away."""
    way = one_of(32, 0, nearest_only=True)
    assert way.nearest_gap_m > 0.3
    assert way.first_evasion_s is not None
    assert way.first_evasion_s < 2.0


@pytest.mark.parametrize(("seed", "number"), [(35, 23), (36, 17)])
def test_by_the_nearest_pole_alone_the_other_one_is_not_run_into(seed, number):
    """One that was passed hid the next; one was evaded into the other beside it."""
    assert one_of(seed, number, nearest_only=True).nearest_gap_m > 0.3


@pytest.mark.parametrize(("seed", "number", "nearest_only"), [(15, 22, False), (28, 16, True)])
def test_a_pole_too_near_to_be_seen_stays_where_it_stood(seed, number, nearest_only):
    """One late echo had moved it aside and given it a speed: it went away on the map, and was flown into."""
    assert one_of(seed, number, nearest_only=nearest_only).nearest_gap_m > 0.3


def test_a_mode_that_is_ordered_twice_is_no_pilot_who_took_over():
    """GUIDED, BRAKE and GUIDED again in quick succession: avoidance had given up, and the vehicle never arrived."""
    assert one_of(29, 19, nearest_only=True).arrived


def test_without_a_radar_that_sees_it_is_hit(monkeypatch):
    """What shows that the poles are really in the way, and that nothing but the radar's tracks avoids them."""
    monkeypatch.setattr(Position2GoModel, "frame", lambda self, true, random: np.empty((0, 3)))
    assert flown().nearest_gap_m < 0.0


def test_without_the_live_sidestep_it_is_hit(monkeypatch):
    monkeypatch.setattr(Aside, "wants", lambda *_: False)
    assert flown().nearest_gap_m < 0.0


def test_a_few_ways_reach_the_figures_and_the_same_seed_flies_them_again():
    results = [arena.through("a few", 3, np.random.default_rng(3), nearest_only=False) for _ in range(2)]
    assert results[0].figures == results[1].figures
    avoided = results[0].figures[0]
    assert avoided.words == "a few: avoided"
    assert avoided.value == 1.0
    assert avoided.least == 1.0
    assert any("deg off the nose" in note for note in results[0].notes)


def test_figures_that_are_set_are_the_ones_that_fly_and_wrong_ones_are_named():
    settings = {
        "tracker": {"coordinates": "polar", "birth_updates": "4"},
        "velocities": {"max_turn_deg": "60", "choice": "edge"},
    }
    made = arena._settings(ScenarioRequest(settings=settings), nearest_only=True)
    assert made.tracker == replace(Position2GoModel().errors, coordinates="polar", birth_updates=4)
    assert made.velocities == replace(arena_settings(nearest_only=True).velocities, max_turn_deg=60.0, choice="edge")
    for part, name, value in (
        ("tracker", "gates", "9"),
        ("tracker", "gate", "wide"),
        ("tracker", "coordinates", "round"),
        ("tracker", "birth_updates", "4.7"),
        ("velocities", "nearest_only", "7"),
        ("velocities", "choice", "wide"),
        ("velocities", "max_turn_deg", "-1"),
    ):
        with pytest.raises(ParameterError):
            arena._settings(ScenarioRequest(settings={part: {name: value}}), nearest_only=True)


def test_the_arena_is_in_the_catalogue_and_takes_no_world():
    assert arena.NAME in NAMES
    with pytest.raises(PlanningError, match="--world"):
        arena.run(ScenarioRequest(world=Path("my.json")))
    with pytest.raises(PlanningError, match="--record"):
        arena.run(ScenarioRequest(record=Path("my.mcap")))


def test_errors_are_drawn_by_the_distance_from_the_nose_and_from_zero_on():
    near, far = [(math.radians(2.0), 0.1, 0.01)] * 40, [(math.radians(12.0), 0.3, 0.02)] * 40
    range_chart, bearing_chart = error_charts([*near, *far, (math.radians(22.0), 9.0, 9.0)])
    (tracks,) = range_chart.series
    assert (tracks.x, tracks.y) == ((2.5, 12.5), (0.1, 0.3))
    assert range_chart.y_span == (0.0, pytest.approx(0.33))
    assert bearing_chart.series[0].y == pytest.approx((math.degrees(0.01), math.degrees(0.02)), abs=1e-4)


def test_ways_are_seen_from_the_pole_that_they_pass():
    way = Approach(np.array([[0.0, 0.0], [3.0, 3.0]]), np.array([-5.0, 0.0]), np.array([5.0, 0.0]))
    flown = ArenaFlown(path_enu_m=[(-2.0, 0.0), (0.0, -1.0), (2.0, 0.0)])
    drawn = ways_chart("one", [way], [flown]).series[0]
    assert list(zip(drawn.x, drawn.y, strict=True)) == [(0.0, -2.0), (1.0, 0.0), (0.0, 2.0)]
