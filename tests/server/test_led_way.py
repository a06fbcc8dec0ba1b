"""How far along a guided way the vehicle is, and what is left of it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mapping.geometry.frames import moved_deg, offset_m
from server.heard.channel import Channel
from server.heard.led_way import LATE_S, LATER_SHARE, SOONER_SHARE, LedWay, latest_s
from server.heard.plan_follower import OFF_LINE_M, Ahead
from telemetry.topics.messages import FlightStatus
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told

HOME = 47.0, 8.0
THERE_AND_BACK = ((0.0, 0.0), (100.0, 0.0), (0.0, 0.0))


def at(east_m: float, north_m: float = 0.0, up_m: float = 20.0, t_s: float = 0.0) -> VehicleState:
    lat_deg, lon_deg = moved_deg(HOME, east_m, north_m)
    state = VehicleState(1, 1, armed=True, landed="in_air", position_t_mono_s=t_s)
    return replace(state, lat_deg=lat_deg, lon_deg=lon_deg, alt_rel_home_m=up_m)


def led(*places: tuple[float, float], speed_m_s: float = 2.0) -> LedWay:
    line = places or THERE_AND_BACK
    t_s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(np.array(line), axis=0), axis=1))]) / speed_m_s
    return LedWay(tuple((*moved_deg(HOME, *place), 20.0) for place in line), t_s, speed_m_s, 1000.0)


def soonest_latest_s(ahead: Ahead | None) -> list[tuple[float, float]]:
    assert ahead is not None
    early_s = ahead.early_late_s + ahead.early_late_share * ahead.t_s
    return [
        (round(float(t), 1), round(float(u), 1)) for t, u in zip(ahead.t_s - early_s, ahead.t_s + early_s, strict=True)
    ]


def between_s(t_s: float) -> tuple[float, float]:
    return round((1 - SOONER_SHARE) * t_s - LATE_S, 1), round(latest_s(t_s, LATER_SHARE), 1)


def test_what_is_left_gets_shorter_and_a_way_back_over_itself_is_not_cut_short() -> None:
    way = led()
    for second, (east_m, left_s) in enumerate(((0.0, [50, 100]), (6.0, [47, 97]), (40.0, [30, 80]), (96.0, [2, 52]))):
        ahead = way.ahead(at(east_m, 1.0, t_s=10.0 * second))
        assert soonest_latest_s(ahead) == [between_s(t_s) for t_s in left_s]
        assert ahead is not None
        assert ahead.off_m == pytest.approx(1.0, abs=0.01)
        to_m, _ = offset_m(HOME, ahead.lat_lon_deg[:, 0], ahead.lat_lon_deg[:, 1])
        np.testing.assert_allclose(to_m, [100.0, 0.0], atol=0.01)
        assert ahead.alt_rel_home_m.tolist() == [20.0, 20.0]
    for second, (east_m, left_s) in enumerate(((90.0, 45.0), (40.0, 20.0), (0.0, 0.0))):
        assert soonest_latest_s(way.ahead(at(east_m, t_s=60.0 + 30.0 * second))) == [between_s(left_s)]


def test_it_is_found_again_after_a_silence_and_beside_its_way() -> None:
    around = [(50.0 * math.cos(k * math.pi / 36) - 50.0, 50.0 * math.sin(k * math.pi / 36)) for k in range(145)]
    way = led(*around, speed_m_s=5.0)
    assert way.ahead(at(*around[0], t_s=0.0)) is not None
    gone = way.ahead(at(*around[16], t_s=14.0))  # 13 s later, a quarter of the first of two laps on
    assert gone is not None
    assert abs(len(gone.t_s) - (145 - 17)) <= 1
    assert way.ahead(at(around[20][0], around[20][1] + 2 * OFF_LINE_M, t_s=18.0)) is None
    back = way.ahead(at(*around[30], t_s=28.0))
    assert back is not None
    assert abs(len(back.t_s) - (145 - 31)) <= 1
    assert way.ahead(replace(at(0.0), lat_deg=None)) is None
    assert way.ahead(replace(at(0.0), alt_rel_home_m=None)) is None


def test_a_small_circle_loses_no_lap() -> None:
    around = [(4.0 * math.cos(k * math.pi / 18) - 4.0, 4.0 * math.sin(k * math.pi / 18)) for k in range(145)]
    way = led(*around)
    for k in range(145):
        ahead = way.ahead(at(around[k][0] + 0.2 * (-1) ** k, around[k][1], t_s=0.35 * k))
        assert ahead is not None
        assert abs(len(ahead.t_s) - (145 - k)) <= 3


def test_at_another_speed_over_ground_a_climb_takes_as_long() -> None:
    lat_deg, lon_deg = moved_deg(HOME, 60.0, 0.0)
    places = ((*HOME, 0.0), (*HOME, 40.0), (lat_deg, lon_deg, 40.0))
    way = LedWay(places, np.array([0.0, 40.0, 70.0]), 2.0, 1000.0)
    way.at_speed(6.0)
    assert soonest_latest_s(way.ahead(at(0.0, up_m=0.0))) == [between_s(40.0), between_s(50.0)]


def test_a_channel_tells_the_single_way_until_it_is_held() -> None:
    channel = Channel("live", Told())
    channel.state, channel.led = at(0.0), led()
    channel.flight = FlightStatus("guided", "paused")
    assert channel.led_ahead() is not None, "it is ordered, and nothing is told of it yet"
    channel.led.is_new = False
    assert channel.led_ahead() is None
    channel.flight = FlightStatus("guided", "flying")
    assert channel.led_ahead() is not None
    assert channel.ahead() is None, "of its plan it is not told where it is"
    channel.led = None
    assert channel.led_ahead() is None
