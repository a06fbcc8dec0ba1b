"""Vehicles in the air are held against each other, at the worse end of what is known of them."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mapping.geometry.frames import moved_deg
from server.flying.apart.nearness import NEAR_M, OVER_M, RADIUS_M, Flown, Nearness, near_each_other
from server.heard.led_way import led_ahead
from server.heard.plan_follower import Ahead
from telemetry.topics.vehicle import VehicleState

HOME = 47.0, 8.0
NOW_S = 1000.0


def flying(east_m: float, north_m: float = 0.0, *, up_m: float = 500.0, **more: Any) -> VehicleState:
    lat_deg, lon_deg = moved_deg(HOME, east_m, north_m)
    state = VehicleState(1, 1, armed=True, landed="in_air", position_t_mono_s=NOW_S)
    placed = replace(state, lat_deg=lat_deg, lon_deg=lon_deg, alt_amsl_m=up_m, home_alt_amsl_m=480.0)
    return replace(placed, **more)


def apart_m(one: VehicleState, other: VehicleState, *aheads: Ahead | None) -> float:
    first, second = aheads or (None, None)
    found = near_each_other(Flown("Bee", one, first), Flown("Wasp", other, second), NOW_S)
    assert found is not None
    return found.distance_m


def test_two_that_hover_are_as_far_apart_as_they_are() -> None:
    assert apart_m(flying(0), flying(40)) == pytest.approx(40 - 2 * RADIUS_M, abs=0.1)
    assert apart_m(flying(0), flying(0, up_m=530)) == pytest.approx(30 - 2 * RADIUS_M, abs=0.1)
    assert apart_m(flying(0, horizontal_accuracy_m=10.0), flying(40)) == pytest.approx(40 - 20 - RADIUS_M, abs=0.1)


def test_an_unknown_height_is_the_same_height() -> None:
    high = replace(flying(10, up_m=600), alt_amsl_m=None)
    assert apart_m(flying(0), high) == pytest.approx(10 - 2 * RADIUS_M, abs=0.1)


def test_two_that_fly_at_each_other_meet_and_two_that_part_do_not() -> None:
    east, west = {"v_east_m_s": 5.0}, {"v_east_m_s": -5.0}
    assert apart_m(flying(0, **east), flying(80, **west)) == 0.0
    assert apart_m(flying(0, **west), flying(80, **east)) == pytest.approx(80 - 2 * RADIUS_M, abs=2.0)


def test_one_that_is_not_heard_any_more_may_be_anywhere_near_its_way() -> None:
    heard, silent = {"v_north_m_s": 4.0}, {"v_north_m_s": 4.0, "position_t_mono_s": NOW_S - 20.0}
    at = flying(60, -80, **silent)
    assert apart_m(flying(0, **heard), at) < apart_m(flying(0, **heard), flying(60, 0, **heard)) - 10.0


def test_a_plan_that_turns_away_in_time_is_believed() -> None:
    def plan(*east_north_m: tuple[float, float]) -> Ahead:
        places = np.array([moved_deg(HOME, *place) for place in east_north_m])
        return Ahead(places, np.full(len(places), 20.0), np.arange(10.0, 10.0 * len(places) + 1.0, 10.0))

    fast, other = flying(0, v_east_m_s=5.0), flying(80)
    assert apart_m(fast, other) < NEAR_M
    assert apart_m(fast, other, plan((40, 0), (0, 40)), None) > 25.0
    # Straight on by plan, it comes.
    assert apart_m(fast, other, plan((40, 0), (80, 0)), None) == 0.0


class Pair:
    def __init__(self) -> None:
        self.states = {1: flying(0), 2: flying(100)}
        self.in_air = True
        channels: dict[int, Any] = {1: ("Bee", _Channel(self, 1)), 2: ("Wasp", _Channel(self, 2))}
        self.nearness = Nearness(channels, now_mono_s=lambda: NOW_S)

    def alarms(self, between_m: float) -> dict[int, str]:
        self.states[2] = flying(between_m + 2 * RADIUS_M)
        asyncio.run(self.nearness.look())
        return {number: alarm.text for number, alarm in self.nearness.alarms.items()}


class _Channel:
    def __init__(self, pair: Pair, number: int) -> None:
        self._pair, self._number = pair, number

    @property
    def state(self) -> VehicleState:
        return self._pair.states[self._number]

    @property
    def in_air(self) -> bool:
        return self._pair.in_air

    def ahead(self) -> None:
        return None

    def led_ahead(self) -> None:
        return None


def test_both_have_the_alarm_until_they_are_well_apart() -> None:
    pair = Pair()
    assert pair.alarms(NEAR_M + 1) == {}
    told = pair.alarms(NEAR_M - 1)
    assert set(told) == {1, 2}
    assert told[1].startswith("Bee and Wasp may come within 4 m of each other")
    assert told[2].startswith("Wasp and Bee may come within 4 m of each other")
    assert "Hold one of them" in told[1]
    # No alarm that comes and goes with every second.
    assert set(pair.alarms(OVER_M - 1)) == {1, 2}
    assert pair.alarms(OVER_M + 1) == {}
    assert pair.alarms(OVER_M - 1) == {}


def test_on_the_ground_vehicles_may_stand_side_by_side() -> None:
    pair = Pair()
    pair.in_air = False
    assert pair.alarms(0.0) == {}


def test_a_way_that_is_led_adds_to_straight_on_and_takes_nothing_away() -> None:
    there = np.array([[*moved_deg(HOME, 60.0, 0.0), 20.0]])

    def led(state: VehicleState) -> Flown:
        told = Flown("Bee", state, led_ahead(there, np.array([20.0]), 2.0, 12.0))
        return Flown("Bee", state, None, told=told)

    hovers = Flown("Wasp", flying(60), None)
    found = near_each_other(led(flying(0)), hovers, NOW_S)
    assert found is not None
    assert found.distance_m == 0.0
    found = near_each_other(hovers, led(flying(0)), NOW_S)
    assert found is not None
    assert found.distance_m == 0.0
    # Avoidance has led it 12 m above its way, and it flies straight at the other one there.
    above = flying(30, up_m=512.0, v_east_m_s=3.0)
    found = near_each_other(led(above), Flown("Wasp", flying(60, up_m=515.0), None), NOW_S)
    assert found is not None
    assert found.distance_m == 0.0
