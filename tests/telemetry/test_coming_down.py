"""After a climb the rest is flown at heights that were certified: level to a place ahead, straight down, then along."""

from __future__ import annotations

from dataclasses import replace

import pytest

from mapping.perceiving.braking import Braking
from telemetry.errors import NotAllowedError
from telemetry.flight.avoidance.coming_down import joined
from telemetry.topics.requests import FlyRest
from tests.telemetry.avoiding_bench import ME, NORTH_PER_DEG, Craft, Sense, Wall, craft, state, targets
from tests.telemetry.simulator_bench import HOME


def higher() -> Craft:
    """Over a wall, on its way at the new height; the rest was planned from 30 m north on."""
    it = craft(Wall(25, 15, thick_m=2), senses=[Sense("radar", 10.0, 0.1)])
    it.until(lambda: state(it) == "offset" and it.truth[0] > 31)
    return it


REST = targets((30, 0, 14), (35, 0, 9), (45, 0, 8), (60, 0, 8))


def test_the_rest_is_flown_at_its_proper_height_and_down_over_one_place_only() -> None:
    it = higher()
    high_m, at_m = it.truth[2], it.truth[0]
    it.perform(it.avoiding.fly_rest(FlyRest(ME, REST), it.now_s))
    assert it.avoiding.status.height_offset_m == 0.0
    assert it.avoiding.status.text == "Goes on at its proper height, certified past what was seen."
    it.until(lambda: it.state.mode == "RTL")
    sinking = [n for _, n, u in it.trail if n > at_m and 9.5 < u < high_m - 0.7]
    assert sinking
    assert max(sinking) - min(sinking) < 1.0
    assert max(n for _, n, _ in it.trail) > 59.0
    assert all(u < 8.6 for _, n, u in it.trail if 47 < n < 58)
    assert min(u for t, n, u in it.trail if n > at_m and n < 55) > 7.4


def test_another_obstacle_on_the_rest_is_climbed_over_again() -> None:
    it = higher()
    it.walls.append(Wall(52, 20, thick_m=2))
    it.perform(it.avoiding.fly_rest(FlyRest(ME, REST), it.now_s))
    it.until(lambda: it.state.mode == "RTL")
    assert it.states[-4:] == ["offset", "climbing", "offset", "watching"]
    assert min(u for _, n, u in it.trail if 52 <= n <= 54) > 20.0


def test_it_is_refused_where_nothing_is_flown_higher_where_the_line_is_another_and_where_something_is_ahead() -> None:
    it = craft(senses=[Sense("radar", 10.0, 0.1)])
    it.until(lambda: it.truth[0] > 8)
    with pytest.raises(NotAllowedError, match="No flight goes on higher"):
        it.avoiding.fly_rest(FlyRest(ME, REST), it.now_s)
    it = higher()
    with pytest.raises(NotAllowedError, match="beside the line"):
        it.avoiding.fly_rest(FlyRest(ME, targets((30, 9, 14), (60, 9, 8))), it.now_s)
    with pytest.raises(NotAllowedError, match="no number"):
        it.avoiding.fly_rest(FlyRest(ME, (replace(REST[0], alt_rel_home_m=float("nan")),)), it.now_s)
    it.senses[0].silent = True
    it.until(lambda: not it.avoiding.regions.fresh(it.now_s), 2)
    with pytest.raises(NotAllowedError):
        it.avoiding.fly_rest(FlyRest(ME, REST), it.now_s)


def test_the_join_is_a_stop_ahead_and_never_below_the_line_that_was_certified() -> None:
    it = higher()
    at = replace(it.state, lat_deg=HOME.lat_deg + 31 / NORTH_PER_DEG, lon_deg=HOME.lon_deg, ground_speed_m_s=0.0)
    over, low, *rest = joined(REST, replace(at, alt_rel_home_m=20.0), Braking())
    assert over.alt_rel_home_m == 20.0
    assert low.alt_rel_home_m == pytest.approx(13.0, abs=0.1)
    assert rest == list(REST[1:])
    over, low, *rest = joined(REST, replace(at, alt_rel_home_m=20.0, ground_speed_m_s=3.0), Braking())
    assert low.alt_rel_home_m == pytest.approx(9.0, abs=0.2)
    over, low, *_ = joined(REST, replace(at, alt_rel_home_m=10.0), Braking())
    assert over.alt_rel_home_m == low.alt_rel_home_m, "lower than the line it climbs first"
    with pytest.raises(NotAllowedError, match="almost flown"):
        joined(REST, replace(at, lat_deg=HOME.lat_deg + 59 / NORTH_PER_DEG, ground_speed_m_s=3.0), Braking())
