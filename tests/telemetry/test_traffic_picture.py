"""The picture of the traffic around a vehicle: heights by their datum, ageing, echoes, warnings, and a full sky."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mapping.geometry.frames import moved_deg
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.traffic import GONE_S, Aircraft, TrafficSettings, TrafficStatus
from telemetry.traffic.memory import MOST
from telemetry.traffic.traffic_picture import MOST_TOLD, TrafficPicture
from telemetry.traffic.warning import CLEAR_S
from tests.telemetry.traffic_messages import (
    ALL_VALID,
    HERE,
    MAC,
    adsb,
    basic_id,
    location,
    over_the_air,
    own_state,
    padded,
    utm,
)

NEAR = TrafficSettings(warn_distance_m=1_000.0, warn_height_m=200.0)


class Sky:
    """A picture with a clock that a test turns."""

    def __init__(self, settings: TrafficSettings = NEAR, **own: Any) -> None:
        self.picture, self.own, self.now_s = TrafficPicture(settings), own, 100.0
        self.alerts: list[ObstacleAlert] = []

    def hear(self, *messages: Any) -> None:
        for message in messages:
            self.picture.on_message(message, own_state(self.now_s, **self.own), self.now_s)

    def tick(self, seconds: float = 1.0) -> TrafficStatus:
        self.now_s += seconds
        told = self.picture.on_tick(own_state(self.now_s, **self.own), self.now_s, self.now_s)
        assert told is not None
        self.alerts += told.alerts
        return told.status

    def only(self, *messages: Any) -> Aircraft:
        self.hear(*messages)
        (it,) = self.tick().aircraft
        return it

    @property
    def phases(self) -> list[str]:
        return [alert.phase for alert in self.alerts if alert.phase != "goes_on"]


def test_nothing_is_told_before_anything_is_heard_and_then_once_a_second() -> None:
    sky = Sky()
    assert sky.picture.on_tick(own_state(), 100.0, 0.0) is None
    sky.hear(over_the_air(mavlink.MAVLink_heartbeat_message(1, 1, 0, 0, 0, 3)))
    assert sky.picture.on_tick(own_state(), 100.0, 0.0) is None
    assert sky.only(adsb()).name == "HBABC"
    assert sky.picture.on_tick(own_state(), sky.now_s + 0.9, 0.0) is None
    assert sky.tick(GONE_S).aircraft == ()


def test_an_aircraft_is_where_its_velocity_has_led_it() -> None:
    it = Sky().only(adsb())
    assert it.distance_m == pytest.approx(760, abs=1)
    assert it.bearing_deg == pytest.approx(90, abs=0.1)
    assert it.closing_m_s == pytest.approx(40, abs=0.5)
    assert it.closest_in_s == pytest.approx(18.7, abs=0.3)
    assert it.age_s == 1.0


def test_a_receivers_delay_counts_as_age() -> None:
    it = Sky().only(adsb(tslc=7))
    assert it.age_s == 8.0
    assert it.distance_m == pytest.approx(480, abs=1)
    sky = Sky()
    sky.hear(adsb(tslc=255))
    assert sky.tick().heard == 0


def test_silence_is_led_on_with_growing_doubt_and_ends() -> None:
    sky = Sky()
    first = sky.only(adsb())
    (later,) = sky.tick(20.0).aircraft
    assert later.age_s == 21.0
    assert later.within_m == pytest.approx(first.within_m + 20 * 0.2 * 40)
    assert sky.tick(GONE_S - 22.0).aircraft
    assert sky.tick(2.0).aircraft == ()


def test_a_place_that_is_sent_again_is_as_old_as_it_was() -> None:
    sky = Sky()
    sky.hear(location())
    for _ in range(9):
        sky.hear(location())
        sky.tick()
    assert sky.tick().aircraft[0].age_s == 10.0
    sky.hear(location(timestamp=1300.0))
    assert sky.tick().aircraft[0].age_s == 1.0


# Heights

LEVEL: dict[str, Any] = {"altitude_geodetic": 548.0, "speed_vertical": 0}
"""At the vehicle's own height."""


def test_heights_above_the_ellipsoid_are_compared_by_the_vehicles_own_receiver() -> None:
    it = Sky().only(location(**LEVEL))
    assert it.alt_datum == "ellipsoid"
    assert it.height_m == pytest.approx(0.0)
    assert it.height_within_m < 30
    doubtful = Sky(gnss_alt_ellipsoid_m=None).only(location(**LEVEL))
    assert doubtful.height_m == pytest.approx(48.0)
    assert doubtful.height_within_m > 110


def test_a_satellite_height_of_unknown_level_lies_between_both() -> None:
    it = Sky().only(adsb(altitude=500_000, ver_velocity=0))
    assert it.height_m == pytest.approx(-24.0)
    assert it.height_within_m >= 24 + 10


def test_a_pressure_altitude_is_within_what_weather_does() -> None:
    it = Sky().only(adsb(altitude_type=0, altitude=1_000_000, ver_velocity=0))
    assert it.height_m == pytest.approx(500.0)
    assert 700 < it.height_within_m < 800
    assert it.conflict
    high = Sky(TrafficSettings(show_height_m=20_000.0))
    assert not high.only(adsb(altitude_type=0, altitude=11_000_000)).conflict


@pytest.mark.parametrize("own", [{}, {"alt_amsl_m": None}])
def test_without_a_height_it_counts_as_level(own: dict[str, Any]) -> None:
    flags = ALL_VALID if own else ALL_VALID & ~(2 | 256)
    sky = Sky(**own)
    it = sky.only(adsb(altitude=9_000_000, flags=flags))
    assert it.height_m is None
    assert it.conflict
    assert "height unknown" in sky.alerts[0].text


def test_without_its_own_position_nothing_is_judged_and_that_is_said() -> None:
    sky = Sky(lat_deg=None, lon_deg=None)
    sky.hear(adsb())
    status = sky.tick()
    assert status.state == "no_position"
    assert "Look out" in status.text
    (it,) = status.aircraft
    assert (it.distance_m, it.height_m, it.conflict) == (None, None, False)
    assert sky.alerts == []


# Warnings


def test_a_warning_begins_in_the_words_of_a_pilot_and_ends_when_it_is_clear() -> None:
    sky = Sky()
    sky.hear(adsb(at=moved_deg(HERE, 1_240.0, 0.0), altitude=604_000))
    sky.tick()
    (begun,) = sky.alerts
    assert begun.text == (
        "Traffic HBABC, 3 o'clock, 1.2 km, 80 m above, closing, 30 s. Give way: hold, descend or land, as you decide."
    )
    assert (begun.sensor, begun.kind, begun.phase) == ("traffic", "traffic", "begins")
    for second in range(60):
        sky.hear(adsb(at=moved_deg(HERE, -300.0 - 40.0 * second, 0.0), altitude=604_000))
        sky.tick()
    assert sky.phases == ["begins", "ends"]
    assert "clear" in sky.alerts[-1].text
    assert sky.alerts[-1].id == begun.id


def test_one_that_circles_stays_warned_of() -> None:
    sky = Sky()
    for second in range(120):
        turn = math.radians(9.0 * second)
        heading = round((math.degrees(turn) + 90.0) % 360.0 * 100)
        at = moved_deg(HERE, 400.0 + 300.0 * math.sin(turn), 300.0 * math.cos(turn))
        sky.hear(adsb(at=at, heading=heading, hor_velocity=4_700))
        sky.tick()
    assert sky.phases == ["begins"]


def test_one_that_falls_silent_is_warned_of_until_it_is_gone() -> None:
    sky = Sky()
    sky.hear(adsb())
    for _ in range(int(GONE_S) + 2):
        sky.tick()
    assert sky.phases == ["begins", "ends"]
    assert "not heard for 60 s" in sky.alerts[-1].text
    assert "heard 6 s ago" in "".join(alert.text for alert in sky.alerts)


def test_going_away_is_clear_only_after_a_while() -> None:
    sky = Sky()
    sky.hear(adsb())
    sky.tick()
    for second in range(int(CLEAR_S) + 3):
        sky.hear(adsb(heading=9_000, at=moved_deg(HERE, 800.0 + 40.0 * second, 0.0)))
        sky.tick()
        if second == int(CLEAR_S) - 3:
            assert sky.phases == ["begins"]
    assert sky.phases == ["begins", "ends"]


@pytest.mark.parametrize(
    "harmless",
    [
        adsb(altitude=2_000_000, ver_velocity=0),
        adsb(at=moved_deg(HERE, 9_000.0, 0.0)),
        adsb(emitter_type=18),
        location(status=1),
    ],
)
def test_what_is_high_far_or_on_the_ground_is_listed_without_a_warning(harmless: Any) -> None:
    sky = Sky()
    assert not sky.only(harmless).conflict
    assert sky.alerts == []


def test_disarmed_nothing_is_warned_of() -> None:
    sky = Sky(armed=False)
    assert sky.only(adsb()).conflict
    assert sky.alerts == []
    sky.own = {}
    sky.tick()
    sky.own = {"armed": False}
    sky.tick()
    assert sky.phases == ["begins", "ends"]


def test_by_default_it_warns_as_ugcs_does() -> None:
    given_by = TrafficSettings()
    assert (given_by.warn_distance_m, given_by.warn_height_m, given_by.look_ahead_s) == (5 * 1852, 300, 60)
    assert Sky(given_by).only(adsb(at=moved_deg(HERE, 11_000.0, 0.0), altitude=500_000)).conflict


# Its own


def test_its_own_transponder_is_no_traffic() -> None:
    here = {"hor_velocity": 500, "heading": 0, "altitude": 530_000}
    sky = Sky()
    assert sky.only(adsb(at=HERE, **here)).trust == "echo"
    assert sky.alerts == []
    named = Sky(TrafficSettings(own_icao="4B1805"))
    named.hear(adsb(at=moved_deg(HERE, 0.0, -60.0), **here))
    assert named.tick().aircraft == ()


def test_what_leaves_or_comes_is_no_echo() -> None:
    here = {"hor_velocity": 500, "heading": 0, "altitude": 530_000}
    left = Sky()
    left.hear(adsb(at=HERE, **here))
    left.tick()
    left.hear(adsb(at=moved_deg(HERE, 200.0, 0.0), **here))
    left.hear(adsb(at=HERE, **here))
    assert left.tick().aircraft[0].trust == "other"
    assert left.phases == ["begins"]
    # The vehicle's own number far away is somebody else under it.
    forged = Sky(TrafficSettings(own_icao="4b1805"))
    assert forged.only(adsb()).trust == "other"
    assert forged.phases == ["begins"]


def test_the_vehicles_own_remote_id_is_learned_from_itself() -> None:
    sky = Sky()
    sky.hear(basic_id(b"MINE", mac=b""), location(at=HERE, mac=b""), basic_id(b"MINE"), location(at=HERE))
    status = sky.tick()
    assert status.aircraft == ()
    assert status.heard == 2
    assert sky.alerts == []
    assert Sky().only(utm()).trust == "other"
    own_utm = Sky()
    own_utm.hear(utm(source=1, at=HERE))
    assert own_utm.tick().aircraft == ()


# Many, and hostile ones


def test_what_is_far_or_high_is_left_out_and_counted() -> None:
    sky = Sky(TrafficSettings(show_distance_m=5_000.0, show_height_m=500.0))
    sky.hear(adsb(ICAO_address=1, at=moved_deg(HERE, 60_000.0, 0.0)), adsb(ICAO_address=2, altitude=5_000_000))
    sky.hear(adsb(ICAO_address=3))
    status = sky.tick()
    assert [it.key for it in status.aircraft] == ["adsb 000003"]
    assert (status.filtered, status.heard) == (2, 3)


def test_of_too_many_the_nearest_are_kept_and_the_rest_is_counted() -> None:
    sky = Sky()
    for number in range(MOST + 150):
        away_m = 2_000.0 + 100.0 * ((number * 37) % (MOST + 150))
        sky.hear(adsb(ICAO_address=number, at=moved_deg(HERE, away_m, 0.0), hor_velocity=0))
    status = sky.tick()
    assert status.heard == MOST
    assert status.crowded_out == 150
    assert len(status.aircraft) == MOST_TOLD
    nearest = [2_000.0 + 100.0 * k for k in range(MOST_TOLD)]
    assert [it.distance_m for it in status.aircraft] == pytest.approx(nearest, rel=1e-3)
    assert status.hidden + status.filtered == MOST - MOST_TOLD


wild_e7 = st.integers(-(2**31), 2**31 - 1)
wild = st.one_of(
    st.builds(
        adsb,
        ICAO_address=st.integers(0, 300),
        lat=st.one_of(wild_e7, st.sampled_from([900_000_000, -900_000_000, 470_000_000])),
        lon=st.one_of(wild_e7, st.sampled_from([1_800_000_000, 80_000_000])),
        altitude_type=st.integers(0, 255),
        altitude=wild_e7,
        heading=st.integers(0, 65535),
        hor_velocity=st.integers(0, 65535),
        ver_velocity=st.integers(-32768, 32767),
        tslc=st.integers(0, 255),
        flags=st.integers(0, 65535),
    ),
    st.builds(
        location,
        latitude=wild_e7,
        longitude=wild_e7,
        altitude_geodetic=st.floats(width=32),
        timestamp=st.floats(width=32),
        speed_horizontal=st.integers(0, 65535),
        mac=st.sampled_from([b"", MAC]),
    ),
    st.builds(utm, lat=wild_e7, lon=wild_e7, flags=st.integers(0, 255), uas_id=st.just(padded(b"X", 18))),
)
own_ones = st.sampled_from([{}, {"lat_deg": 90.0}, {"lat_deg": None}, {"v_east_m_s": None}, {"alt_amsl_m": None}])


@settings(max_examples=60)
@given(st.lists(st.tuples(wild, st.floats(0, 30)), max_size=12), own_ones)
def test_whatever_is_sent_the_picture_goes_on(sent: list[tuple[Any, float]], own: dict[str, Any]) -> None:
    sky = Sky(**own)
    sky.hear(adsb())
    for message, pause_s in sent:
        sky.hear(message)
        status = sky.tick(1.0 + pause_s)
        for it in status.aircraft:
            numbers = (it.lat_deg, it.lon_deg, it.distance_m, it.height_m, it.closing_m_s, it.closest_m, it.within_m)
            assert all(value is None or math.isfinite(value) for value in numbers)
            assert abs(it.lat_deg) <= 90
            assert abs(it.lon_deg) <= 180
