"""Avoidance with the simulated PX4 in virtual time: it stops, climbs over, goes around and aside, and lets go."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise

import pytest

from mapping.perceiving.braking import PX4_HOLD, Braking, no_shorter
from telemetry.flight.avoidance.regions import braking_of
from telemetry.flight.guided.remaining_mission import RemainingMission
from telemetry.topics.obstacles import PerceptionSettings
from telemetry.topics.requests import FlyManoeuvre
from tests.telemetry.avoiding_bench import ME, NORTH_PER_DEG, Sense, Wall, state, targets
from tests.telemetry.px4_craft import SET_MODE, Px4Craft, px4_craft, px4_remaining_at
from tests.telemetry.simulator_bench import HOME

SETTINGS = PerceptionSettings()
KEPT_M = SETTINGS.vehicle_radius_m + SETTINGS.position_error_m
"""Between the vehicle's middle and anything seen."""
HOVERS_M = 0.5
"""PX4 does not stand more still than that."""


def least_m(it: Px4Craft, wall: Wall) -> float:
    """How near the vehicle truly came to a wall, over which it flies, too."""
    distances = []
    for _, north_m, up_m in it.trail:
        beside_m = max(wall.north_m - north_m, north_m - wall.north_m - wall.thick_m, 0.0)
        distances.append(math.hypot(beside_m, max(up_m - wall.top_m, 0.0)))
    return min(distances)


@lru_cache
def climbed_over() -> tuple[Px4Craft, Wall]:
    wall = Wall(25, 15)
    it = px4_craft(wall)
    it.until(lambda: it.state.mode == "RTL")
    return it, wall


def test_it_holds_climbs_straight_up_until_clear_and_goes_on_higher() -> None:
    it, wall = climbed_over()
    assert it.states == ["off", "watching", "climbing", "offset", "watching"]
    assert it.mode_names() == ["HOLD", "RTL"]
    assert it.pauses() == []
    assert least_m(it, wall) >= KEPT_M
    climbing = [n for _, n, u in it.trail if 9.5 < u < 15.0 and n > 10]
    assert max(climbing) - min(climbing) < 2 * HOVERS_M
    assert max(n for _, n, _ in it.trail) > 59.0


def test_it_is_not_lower_than_it_was_once_it_climbs() -> None:
    it, _ = climbed_over()
    begins_s = next(t for t, m in it.orders if m.get_type() == "COMMAND_INT")
    heights = [up_m for t, _, up_m in it.trail if t > begins_s]
    assert all(later >= earlier - 0.25 for earlier, later in pairwise(heights))
    assert all(u >= max(heights[: k + 1]) - 1.0 for k, u in enumerate(heights))


def test_places_after_the_climb_are_the_missions_raised_and_counted_from_the_sea() -> None:
    it, _ = climbed_over()
    last = it.repositions()[-2:]
    assert [round((m.x / 1e7 - HOME.lat_deg) * NORTH_PER_DEG) for m in last] == [45, 60]
    offset_m = last[0].z - HOME.alt_amsl_m - 8.0
    assert all(m.z == pytest.approx(HOME.alt_amsl_m + 8.0 + offset_m, abs=0.05) for m in last)
    assert all((m.frame, m.param2) == (0, 0) for m in last)  # no pilot's mode is undone
    assert 7.0 < offset_m < 14.0


def test_a_second_building_stops_it_in_the_mode_that_it_flies_in() -> None:
    second = Wall(45, 25, thick_m=2)
    it = px4_craft(Wall(22, 11, thick_m=2), second)
    it.until(lambda: it.state.mode == "RTL")
    assert it.states == ["off", "watching", "climbing", "offset", "climbing", "offset", "watching"]
    assert it.mode_names() == ["HOLD", "RTL"]
    (pause,) = it.pauses()
    assert all(math.isnan(value) for value in (pause.param4, pause.param5, pause.param6, pause.param7))
    assert least_m(it, second) >= KEPT_M


def test_frames_that_stop_while_it_climbs_make_it_hold_until_they_come_again() -> None:
    it = px4_craft(Wall(25, 20))
    it.until(lambda: it.avoiding.detour.phase == "climbing" and it.truth[2] > 10.0)
    it.senses[0].silent = True
    it.until(lambda: state(it) == "holding")
    it.advance(5.0)
    held_m = it.truth[2]
    assert held_m < 18.0
    it.advance(4.0)
    assert it.truth[2] == pytest.approx(held_m, abs=HOVERS_M)
    it.senses[0].silent = False
    it.until(lambda: state(it) == "offset")
    assert it.truth[2] > 20.5


def test_a_pause_on_the_way_stops_it_and_resume_goes_on() -> None:
    it = px4_craft(Wall(25, 14))
    it.until(lambda: state(it) == "offset" and it.truth[0] > 30)
    it.perform(it.avoiding.pause(it.now_s))
    assert len(it.pauses()) == 1
    it.perform(it.avoiding.pause(it.now_s))
    assert len(it.pauses()) == 1  # it is stopping already
    it.advance(8.0)
    stood_m = it.truth[0]
    it.advance(5.0)
    assert it.truth[0] == pytest.approx(stood_m, abs=2 * HOVERS_M)
    assert it.avoiding.flight_status().phase == "paused"
    assert it.avoiding.detour.is_paused
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: it.state.mode == "RTL")
    assert max(n for _, n, _ in it.trail) > 59


def test_a_prepared_way_around_is_flown_and_the_mission_goes_on_at_its_height() -> None:
    wall = Wall(18, 60, half_wide_m=5.0, thick_m=4)
    it = px4_craft(wall)
    it.until(lambda: state(it) == "climbing")
    it.perform(it.avoiding.fly(FlyManoeuvre(ME, "around", targets((8, 12, 8), (26, 12, 8), (30, 0, 8)), 2),
                               px4_remaining_at(it, 2), it.now_s))  # fmt: skip
    it.until(lambda: it.bench.vehicle.truth.p_neu[1] > 11, 90)
    it.until(lambda: it.state.mode == "RTL")
    assert max(n for _, n, _ in it.trail) > 59
    assert max(u for _, n, u in it.trail if n > 30) < 9.5


def test_a_prepared_way_over_climbs_on_while_it_is_not_clear() -> None:
    wall = Wall(25, 14)
    it = px4_craft(wall)
    it.avoiding.disable(it.now_s)
    it.until(lambda: it.truth[0] > 10)
    request = FlyManoeuvre(ME, "over", targets((16, 0, 10), (32, 0, 10)), None, 2.0)
    it.perform(it.avoiding.fly(request, RemainingMission((), "hold"), it.now_s))
    it.until(lambda: it.truth[0] > 30)
    assert least_m(it, wall) >= KEPT_M
    it.until(lambda: state(it) == "holding")
    assert it.truth[2] > 14.5


def test_a_sidestep_is_flown_without_a_stop_and_the_mission_goes_on() -> None:
    it = px4_craft()
    it.until(lambda: it.truth[0] > 8)
    begun = len(it.trail)
    request = FlyManoeuvre(ME, "sidestep", targets((22, 10, 8), (30, 0, 8)), 2)
    it.perform(it.avoiding.fly(request, px4_remaining_at(it, 2), it.now_s))
    it.until(lambda: it.bench.vehicle.truth.p_neu[1] > 8, 60)
    it.until(lambda: it.state.mode == "RTL")
    assert it.mode_names() == ["HOLD", "RTL"]
    assert it.pauses() == []
    flown = it.trail[begun:]
    assert min(up_m for _, _, up_m in flown) > 7.0
    assert max(n for _, n, _ in flown) > 59


def test_the_end_of_its_own_mission_is_no_pilot() -> None:
    it = px4_craft()
    it.until(lambda: it.state.mode == "RTL")
    it.until(lambda: not it.state.armed, 300)
    assert it.avoiding.released == ""
    assert it.mode_names() == []


def test_another_mode_is_somebody_who_has_taken_over() -> None:
    it = px4_craft(Wall(25, 20))
    it.until(lambda: it.avoiding.detour.phase == "climbing")
    assert it.bench.command(SET_MODE, 1, 4, 6) == 0
    it.until(lambda: it.avoiding.released != "")
    orders = len(it.orders)
    it.advance(5.0)
    assert len(it.orders) == orders
    assert it.avoiding.released == "The flight mode was changed to LAND: the pilot took over."


@pytest.mark.parametrize("by_m", [-4.0, 4.0])
def test_home_that_somebody_moves_changes_no_height(by_m: float) -> None:
    it = px4_craft(Wall(25, 14))
    it.until(lambda: state(it) == "offset" and it.truth[0] > 28)
    pilot, sent = it.bench.vehicle.autopilot, len(it.repositions())
    flown_m, ordered_m = it.truth[2], it.repositions()[-1].z
    n, e, u = pilot.home_neu
    pilot.home_neu = (n, e, u + by_m)
    it.until(lambda: it.truth[0] > 57)
    assert len(it.repositions()) > sent, "the next place of the rest"
    assert {round(order.z, 2) for order in it.repositions()[sent:]} == {round(ordered_m, 2)}
    assert all(up_m == pytest.approx(flown_m, abs=1.5) for _, north_m, up_m in it.trail if north_m > 29)


@pytest.mark.parametrize("speed_m_s", [1.0, 2.0, 3.0, 5.0, 8.0])
def test_it_stops_no_later_than_is_counted_on(speed_m_s: float) -> None:
    it = Px4Craft((), [], [])
    bench, pilot = it.bench, it.bench.vehicle.autopilot
    bench.until(lambda: pilot.position_ok)
    bench.advance(1.2)
    nan = math.nan
    assert bench.command(400, 1) == 0
    assert bench.command(22, nan, 0, 0, nan, nan, nan, HOME.alt_amsl_m + 20) == 0
    bench.until(lambda: pilot.mode.name == "HOLD")
    pilot.go_to((1000.0, 0.0, 20.0))
    pilot.change_speed(1, speed_m_s)
    bench.advance(15.0)
    from_m = bench.vehicle.truth.p_neu[0]
    from_m_s = max(bench.vehicle.truth.v_neu[0], pilot.v_neu[0])  # its estimate slips; as told counts, or as true
    assert bench.command(192, -1, 1, 0, nan, nan, nan, nan) == 0
    far_m, until_s = from_m, bench.now_s + 12
    while bench.now_s < until_s:
        bench.advance(0.1)
        far_m = max(far_m, bench.vehicle.truth.p_neu[0])
    counted_m = PX4_HOLD.distance_m(from_m_s)
    assert far_m - from_m <= counted_m
    assert far_m - from_m >= 0.75 * counted_m - 0.7


def test_the_longest_of_many_stops_is_counted_on() -> None:
    """With another seed 1.89 m were measured at a true 0.86 m/s, which it told as more."""
    assert PX4_HOLD.distance_m(0.86) >= 1.89


def test_a_profile_may_say_that_it_stops_later_but_not_sooner() -> None:
    assert braking_of("px4", 7.5, 5.0) == PX4_HOLD
    assert braking_of("px4", 3.0, 1.2) == Braking(3.0, 1.2)
    assert braking_of("ardupilot", 7.5, 5.0) == Braking()
    assert no_shorter(PX4_HOLD, PX4_HOLD) == PX4_HOLD


def test_it_is_slowed_to_what_it_can_stop_from() -> None:
    it = px4_craft(senses=[Sense("vision", 7.0, 0.2)])
    it.until(lambda: it.truth[0] > 20)
    slowed_m_s = it.avoiding.slowed_to_m_s
    assert slowed_m_s is not None
    assert slowed_m_s < 2.7
    it.advance(3.0)
    assert it.state.ground_speed_m_s == pytest.approx(slowed_m_s, abs=0.5)
