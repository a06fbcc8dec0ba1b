"""Avoidance with the simulated vehicle in virtual time: it climbs over walls, and yields to the pilot."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from telemetry.errors import NotAllowedError, SilentError
from tests.telemetry.avoiding_bench import (
    AUTO,
    BRAKE,
    GUIDED,
    LOITER,
    NORTH_PER_DEG,
    RTL,
    Craft,
    Sense,
    Wall,
    craft,
    place,
    remaining_at,
    state,
)
from tests.telemetry.frames import heard
from tests.telemetry.simulator_bench import HOME


@lru_cache
def climbed_over() -> Craft:
    """A building on the way, as in the field test of Bigazzi 2022: vision alone."""
    it = craft(Wall(25, 15))
    it.until(lambda: it.state.mode == "RTL")
    return it


def test_it_stops_climbs_straight_up_until_clear_and_goes_on_higher() -> None:
    it = climbed_over()
    assert it.states == ["off", "watching", "climbing", "offset", "watching"]
    assert it.modes() == [BRAKE, GUIDED, RTL]
    below = [north_m for _, north_m, up_m in it.trail if up_m < 15.5]
    assert max(below) < 24.0
    climbing = [(n, u) for _, n, u in it.trail if 8.7 < u < 15.0 and n > 10]
    assert max(n for n, _ in climbing) - min(n for n, _ in climbing) < 0.5
    assert max(north_m for _, north_m, _ in it.trail) > 59.0


def test_it_is_never_lower_than_it_was_and_climbs_at_its_own_speed() -> None:
    it = climbed_over()
    first_s = it.orders[0][0]
    heights = [up_m for t, _, up_m in it.trail if t > first_s]
    assert all(later >= earlier - 0.25 for earlier, later in pairwise(heights))
    rises = [(t, u) for t, _, u in it.trail if 9.5 < u < 14.0 and t > first_s]
    (t0, u0), (t1, u1) = rises[0], rises[-1]
    assert (u1 - u0) / (t1 - t0) == pytest.approx(1.5, abs=0.1)


def test_targets_after_the_climb_are_the_missions_raised_by_the_offset() -> None:
    it = climbed_over()
    last = it.sent("SET_POSITION_TARGET_GLOBAL_INT")[-2:]
    offset_m = last[0].alt - 8.0
    assert [round((m.lat_int / 1e7 - HOME.lat_deg) * NORTH_PER_DEG) for m in last] == [45, 60]
    assert all(m.alt == pytest.approx(8.0 + offset_m, abs=0.01) for m in last)
    assert 8.0 < offset_m < 12.0
    speeds = [(m.param1, m.param2) for m in it.sent("COMMAND_LONG") if m.command == 178]
    slowed = [(1.0, 2.7)]  # a region of 7 m
    assert speeds[:3] == [*slowed, (2.0, 1.5), *slowed]  # mission, climb, rest
    assert any("Climbing" in text for text in it.texts)
    assert any("higher than planned" in text for text in it.texts)


def test_a_second_building_is_climbed_over_from_the_new_height() -> None:
    it = craft(Wall(22, 11, thick_m=2), Wall(42, 16, thick_m=2))
    it.until(lambda: it.state.mode == "RTL")
    assert it.states == ["off", "watching", "climbing", "offset", "climbing", "offset", "watching"]
    assert AUTO not in it.modes()
    assert max(n for _, n, u in it.trail if u < 16.5 and n > 30) < 41.5


def test_a_position_that_stands_still_makes_it_hold() -> None:
    it = craft(Wall(25, 18))
    it.until(lambda: it.avoiding.detour.phase == "climbing" and it.truth[2] > 10.0)
    old = replace(it.state, position_t_mono_s=it.now_s - 0.6)
    it.perform(it.avoiding.on_state(old, it.now_s))
    assert state(it) == "holding"
    assert it.modes()[-1] == BRAKE


def test_above_the_ceiling_it_does_not_climb() -> None:
    it = craft(Wall(25, 90))
    it.until(lambda: state(it) == "ceiling")
    it.advance(4.0)
    assert max(up_m for _, _, up_m in it.trail) == pytest.approx(38.0, abs=0.5)
    assert "holds" in it.avoiding.status.text
    assert it.truth[1] == pytest.approx(0.0, abs=0.5)
    assert max(n for _, n, _ in it.trail) < 24.0


def test_too_fast_for_the_region_it_is_slowed_and_stops_before_the_wall() -> None:
    it = craft(Wall(40, 15), senses=[Sense("vision", 4.5, 0.2)])
    it.until(lambda: it.truth[0] > 20.0)
    largest_m_s = it.avoiding.status.largest_speed_m_s
    assert largest_m_s is not None
    assert 1.3 < largest_m_s < 1.7
    assert any(text.startswith("Too fast to stop, the vision sees 4.5 m ahead: ") for text in it.texts)
    assert it.avoiding.status.text == f"Slowed to {it.avoiding.slowed_to_m_s:.1f} m/s: the vision sees 4.5 m ahead."
    it.until(lambda: it.truth[0] > 32.0)
    assert it.state.ground_speed_m_s == pytest.approx(largest_m_s, abs=0.15)
    assert it.state.mode == "AUTO"
    it.until(lambda: state(it) == "offset")
    assert max(n for _, n, u in it.trail if u < 15.5) < 40.0 - 0.6


def test_however_short_it_sees_it_brakes_for_what_it_sees() -> None:
    it = craft(Wall(30, 15), senses=[Sense("vision", 1.0, 0.2)])
    it.until(lambda: it.truth[0] > 20.0)
    assert it.avoiding.status.largest_speed_m_s == 0.0
    it.until(lambda: BRAKE in it.modes(), 120)


@pytest.mark.fact("A41")
def test_a_way_home_that_is_too_fast_is_slowed() -> None:
    """RTL_SPEED 0: as fast as WPNAV_SPEED says, whatever the mission's own speed was."""
    it = craft(senses=[Sense("radar", 10.0, 0.1)])
    it.until(lambda: it.truth[0] > 55)
    it.bench.set_parameters(WPNAV_SPEED=1000)
    it.avoiding.commanded("RTL", it.now_s)
    it.bench.command(176, 1, RTL)
    it.until(lambda: it.state.mode == "RTL")
    it.advance(1.0)
    fastest_m_s = 0.0
    while it.truth[0] > 8:
        it.step()
        fastest_m_s = max(fastest_m_s, it.state.ground_speed_m_s or 0.0)
    assert 3.5 < fastest_m_s < 5.0
    assert "Slowed to 4.0 m/s: the radar sees 10 m ahead." in it.texts
    it.until(lambda: not it.state.armed, 120)
    assert it.avoiding.slowed_to_m_s is None, "what stands has not been slowed"


@pytest.mark.parametrize(("depth_m", "sensor"), [(7.0, "vision"), (10.0, "radar")])
def test_each_sensor_alone_clears_the_building(depth_m: float, sensor: Any) -> None:
    other = Sense("radar" if sensor == "vision" else "vision", 12.0, 0.1, state="blind")
    it = craft(Wall(25, 12), senses=[Sense(sensor, depth_m, 0.1), other])
    it.until(lambda: state(it) == "offset")
    assert it.avoiding.status.sensors == (sensor,)
    assert max(n for _, n, u in it.trail if u < 12.5) < 24.5


def test_a_mode_that_the_pilot_chooses_releases_it_for_the_flight() -> None:
    it = craft(Wall(25, 20))
    it.until(lambda: it.avoiding.detour.phase == "climbing")
    sent = len(it.orders)
    assert it.bench.command(176, 1, LOITER) == 0
    it.until(lambda: state(it) == "released")
    it.advance(5.0)
    assert len(it.orders) == sent
    assert "the pilot took over" in it.avoiding.status.text
    assert not it.avoiding.status.enabled
    with pytest.raises(NotAllowedError, match="for this flight"):
        it.avoiding.enable(it.now_s)
    it.bench.command(176, 1, AUTO)
    it.advance(5.0)
    assert len(it.orders) == sent
    it.bench.command(400, 0, 21196)
    it.until(lambda: not it.state.armed)
    assert state(it) == "watching"


def test_a_mode_that_this_station_asked_for_is_no_pilots() -> None:
    it = craft()
    it.avoiding.commanded("LOITER", it.now_s)
    it.bench.command(176, 1, LOITER)
    it.advance(1.0)
    assert state(it) == "watching"


def channels(*sticks_us: int) -> Any:
    values: list[int] = [0, 8, *sticks_us, *[1500] * (18 - len(sticks_us)), 255]
    return heard(wire.MAVLink_rc_channels_message(*values))


def test_a_stick_that_is_moved_stops_the_vehicle_and_releases_it() -> None:
    it = craft(Wall(25, 20))
    it.hear(channels(1500, 1500, 1100, 1500))
    it.until(lambda: it.avoiding.detour.phase == "climbing")
    it.hear(channels(1500, 1540, 1100, 1500))
    assert state(it) == "climbing"
    it.hear(channels(1500, 1700, 1100, 1500))
    assert state(it) == "released"
    assert it.modes()[-1] == BRAKE
    assert "stick" in it.avoiding.status.text
    sent = len(it.orders)
    it.advance(5.0)
    assert len(it.orders) == sent
    assert it.state.mode == "BRAKE"


def test_on_the_mission_a_stick_releases_it_without_a_word_to_the_vehicle() -> None:
    it = craft(Wall(25, 12))
    it.hear(channels(1500, 1500, 1500, 1500))
    it.hear(heard(wire.MAVLink_manual_control_message(1, 300, 0, 500, 0, 0)))
    it.until(lambda: it.truth[0] > 22)
    assert state(it) == "released"
    assert it.orders == []


def test_it_is_paused_and_goes_on() -> None:
    it = craft(Wall(25, 14))
    it.until(lambda: state(it) == "offset" and it.truth[0] > 26)
    it.perform(it.avoiding.pause(it.now_s))
    it.advance(4.0)
    assert (it.state.mode, state(it)) == ("BRAKE", "holding")
    held_m = it.truth[0]
    it.advance(1.0)
    assert it.truth[0] == pytest.approx(held_m, abs=0.2)
    it.perform(it.avoiding.resume(it.now_s))
    it.until(lambda: it.state.mode == "RTL")
    assert max(n for _, n, _ in it.trail) > 59


def test_switched_off_nothing_is_sent() -> None:
    it = craft(Wall(25, 7.5))
    it.perform(it.avoiding.disable(it.now_s))
    it.until(lambda: it.truth[0] > 30)
    assert it.orders == []
    assert state(it) == "off"


def test_on_the_far_way_home_it_climbs_over_what_stands_there_and_returns() -> None:
    it = craft()
    it.until(lambda: it.truth[0] > 40)
    it.walls.append(Wall(0, 0))
    it.avoiding.commanded("RTL", it.now_s)
    it.bench.command(176, 1, RTL)
    it.until(lambda: it.state.mode == "RTL")
    it.walls[0] = Wall(it.truth[0] + 3, 60.0)
    it.until(lambda: it.avoiding.detour.phase == "climbing")
    it.walls.clear()
    it.until(lambda: it.state.mode == "RTL" and state(it) == "watching")
    assert it.modes() == [BRAKE, GUIDED, RTL]


def test_another_flight_is_told_of_by_its_own_items_from_the_moment_it_brakes() -> None:
    it = craft(Wall(25, 15))
    it.until(lambda: it.state.mode == "RTL" and it.avoiding.detour.phase == "idle")
    it.walls.clear()
    it.until(lambda: it.truth[0] < 20)
    it.avoiding.commanded("AUTO", it.now_s)
    it.bench.command(224, 2)
    it.bench.command(176, 1, AUTO)
    it.until(lambda: it.state.mode == "AUTO")
    flown = remaining_at(it, 2)
    it.walls.append(Wall(it.truth[0] + 6, 60.0))
    it.until(lambda: it.avoiding.is_engaged)
    assert it.avoiding.detour.phase in ("stopping", "taking")
    assert it.avoiding.flight_status().target == flown.targets[0].item
    assert it.avoiding.flight_status().targets == flown.targets[-1].item


def test_an_order_to_stop_that_nobody_answered_is_given_again_when_the_vehicle_is_heard() -> None:
    it = craft()
    it.until(lambda: it.truth[0] > 8)
    detour, helm = it.avoiding.detour, it.avoiding._helm  # pyright: ignore[reportPrivateUsage]
    detour.avoid(remaining_at(it, 2), frozenset(), it.now_s)  # lost on its way
    detour._helm._on_failed(SilentError("Nothing was heard."), it.now_s)  # pyright: ignore[reportPrivateUsage]
    assert helm.failed
    silent = replace(it.state, heartbeat_t_mono_s=it.now_s - 5.0)
    assert detour.look(silent, it.now_s) == []
    it.until(lambda: it.state.mode in ("BRAKE", "GUIDED"), 5)


def test_what_cannot_be_gone_on_with_is_not_taken_over_and_that_is_said() -> None:
    it = craft(Wall(25, 15))
    it.onboard = replace(it.onboard, items=(*it.onboard.items[:-1], place(60, 8, command=17)))  # waits without end
    it.until(lambda: it.truth[0] > 20)
    assert it.modes() == []
    assert "in the way" in it.avoiding.status.text


def test_something_new_just_as_it_goes_on_is_climbed_over_although_the_vehicle_still_stands_in_guided() -> None:
    it = craft(Wall(25, 12))
    it.until(lambda: it.avoiding.detour.phase == "going")
    north_m, _, up_m = it.truth
    it.walls.append(Wall(north_m + 4.0, up_m + 4.0))
    it.until(lambda: it.state.mode == "RTL")
    assert it.states == ["off", "watching", "climbing", "offset", "climbing", "offset", "watching"]
    assert it.modes() == [BRAKE, GUIDED, BRAKE, GUIDED, RTL]
    assert all(up > it.walls[1].top_m for _, north, up in it.trail if north > north_m + 4.0)


def test_how_fast_and_how_high_it_climbs_is_set() -> None:
    it = craft(Wall(25, 90))
    it.avoiding.on_settings(replace(it.avoiding.regions.settings, climb_m_s=2.5, climb_ceiling_m=12.0))
    it.until(lambda: state(it) == "ceiling")
    it.advance(4.0)
    assert max(up_m for _, _, up_m in it.trail) == pytest.approx(20.0, abs=0.5)
    assert (2.0, 2.5) in [(m.param1, m.param2) for m in it.sent("COMMAND_LONG") if m.command == 178]
