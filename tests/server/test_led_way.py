"""How far along a guided way the vehicle is, and what is left of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.frames import moved_deg, offset_m
from server.heard.channel import Channel
from server.heard.led_way import LedWay
from server.heard.plan_follower import OFF_LINE_M
from telemetry.topics.messages import FlightStatus
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told

HOME = 47.0, 8.0
THERE_AND_BACK = ((0.0, 0.0), (100.0, 0.0), (0.0, 0.0))
T_S = np.array([0.0, 50.0, 100.0])


def at(east_m: float, north_m: float = 0.0, up_m: float = 20.0) -> VehicleState:
    lat_deg, lon_deg = moved_deg(HOME, east_m, north_m)
    return VehicleState(1, 1, armed=True, landed="in_air", lat_deg=lat_deg, lon_deg=lon_deg, alt_rel_home_m=up_m)


def led() -> LedWay:
    return LedWay(tuple((*moved_deg(HOME, *place), 20.0) for place in THERE_AND_BACK), T_S)


def test_what_is_left_gets_shorter_and_a_way_back_over_itself_is_not_cut_short() -> None:
    way = led()
    for east_m, left_s in ((0.0, [50, 100]), (40.0, [30, 80]), (96.0, [2, 52])):
        ahead = way.ahead(at(east_m, 1.0))
        assert ahead is not None
        np.testing.assert_allclose(ahead.t_s, left_s, atol=0.1)
        east_m, _ = offset_m(HOME, ahead.lat_lon_deg[:, 0], ahead.lat_lon_deg[:, 1])
        np.testing.assert_allclose(east_m, [100.0, 0.0], atol=0.01)
        assert ahead.alt_rel_home_m.tolist() == [20.0, 20.0]
    for east_m, left_s in ((90.0, 45.0), (40.0, 20.0), (0.0, 0.0)):
        ahead = way.ahead(at(east_m))
        assert ahead is not None
        assert ahead.t_s.tolist() == [pytest.approx(left_s, abs=0.1)]


def test_beside_it_and_without_a_place_nothing_is_told_and_it_is_found_again() -> None:
    way = led()
    assert way.ahead(at(40.0, OFF_LINE_M + 1.0)) is None
    assert way.ahead(replace(at(40.0), lat_deg=None)) is None
    assert way.ahead(replace(at(40.0), alt_rel_home_m=None)) is None
    assert way.ahead(at(10.0)) is not None


def test_at_half_the_speed_the_rest_takes_twice_as_long() -> None:
    way = led()
    way.ahead(at(50.0))
    way.slowed(2.0)
    ahead = way.ahead(at(50.0))
    assert ahead is not None
    np.testing.assert_allclose(ahead.t_s, [50.0, 150.0], atol=0.1)


def test_a_channel_tells_the_single_way_only_while_it_is_flown() -> None:
    channel = Channel("live", Told())
    channel.state, channel.led = at(0.0), led()
    assert channel.ahead() is None
    channel.flight = FlightStatus("guided", "flying")
    assert channel.ahead() is not None
    channel.flight = FlightStatus("guided", "paused")
    assert channel.ahead() is None
    channel.flight = FlightStatus("guided", "flying", target=3)
    assert channel.ahead() is None, "it is led along its plan, which nobody knows here"
