"""Home that moves in flight is said at once, with how far; what it wanders by itself is not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.geometry.frames import moved_deg
from telemetry.flight.home_watch import MOVED_M, ROSE_M, HomePlace, HomeWatch, moved_words
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.link_bench import until
from tests.telemetry.own_time import run
from tests.telemetry.test_mission_taken_up import VEHICLES, holding

HOME = HomePlace(-37.0, 175.0, 800.0)


def moved(east_m: float, north_m: float, up_m: float) -> HomePlace:
    lat_deg, lon_deg = moved_deg((HOME.lat_deg, HOME.lon_deg), east_m, north_m)
    return HomePlace(lat_deg, lon_deg, HOME.alt_amsl_m + up_m)


@pytest.mark.parametrize(
    ("to", "words"),
    [
        ((30.0, 0.0, 0.0), "30 m to the east."),
        ((-20.0, 20.0, 0.0), "28 m to the north-west."),
        ((0.0, -12.0, 3.0), "12 m to the south and 3.0 m up."),
        ((0.0, 0.0, -2.0), "2.0 m down."),
        ((0.9, 0.0, 0.4), None),
    ],
)
def test_it_says_how_far_and_where(to: tuple[float, float, float], words: str | None) -> None:
    said = moved_words(HOME, moved(*to))
    assert said is None if words is None else said is not None and words in said


@settings(deadline=None)
@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-20, 20))
def test_nothing_beyond_its_wandering_is_passed_over(east_m: float, north_m: float, up_m: float) -> None:
    far = (east_m**2 + north_m**2) ** 0.5
    said = moved_words(HOME, moved(east_m, north_m, up_m))
    if far > MOVED_M + 0.01 or abs(up_m) > ROSE_M + 0.01:
        assert said is not None
    elif far < MOVED_M - 0.01 and abs(up_m) < ROSE_M - 0.01:
        assert said is None


def state(home: HomePlace, **more: Any) -> VehicleState:
    told = {"home_lat_deg": home.lat_deg, "home_lon_deg": home.lon_deg, "home_alt_amsl_m": home.alt_amsl_m}
    return VehicleState(1, 1, **{"armed": True, "landed": "in_air", **told, **more})


def test_it_is_said_once_each_time_and_in_flight_only() -> None:
    watch, away = HomeWatch(), moved(40.0, 0.0, 0.0)
    assert watch.on_state(state(HOME, armed=False, landed="on_ground")) is None
    assert watch.on_state(state(away)) is None, "it armed there: its home is where it stood"
    assert watch.on_state(replace(state(away), home_lat_deg=None)) is None
    assert watch.on_state(state(HOME)) is not None
    assert watch.on_state(state(HOME)) is None
    assert watch.on_state(state(moved(0.3, 0.0, 0.0))) is None
    assert watch.on_state(state(away)) is not None
    assert watch.on_state(state(away, armed=False, landed="on_ground")) is None
    assert watch.on_state(state(HOME)) is None, "another flight"


@pytest.mark.parametrize(("autopilot", "parameters"), VEHICLES)
def test_it_is_heard_over_the_link_and_written_down(autopilot: str, parameters: object) -> None:
    async def whole() -> None:
        async with holding(autopilot, parameters) as (bench, simulator, _):
            assert not [text for text in bench.texts if "Home has moved" in text]
            pilot = simulator.vehicle.autopilot
            north_m, east_m, up_m = pilot.home_neu
            pilot.home_neu = (north_m, east_m + 25.0, up_m)
            await until(lambda: [text for text in bench.texts if "25 m to the east" in text])
            await until(lambda: [words for words in bench.commands if "Home has moved in flight" in words])

    run(whole)
