"""ADS-B and remote ID of one aircraft: listed and warned of once where both agree, twice where anything is unsure."""

from __future__ import annotations

from typing import Any

import pytest

from mapping.geometry.frames import moved_deg
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.traffic import TrafficSettings, TrafficStatus
from telemetry.traffic.joining import PICTURES
from telemetry.traffic.traffic_picture import TrafficPicture
from tests.telemetry.traffic_messages import HERE, MAC, adsb, basic_id, location, own_state

NEAR = TrafficSettings(warn_distance_m=1_000.0, warn_height_m=200.0, look_ahead_s=1.0)
OTHER_MAC = bytes([9, 8, 7, 6, 5, 4])
BOTH, ONE = ["adsb 4b1805", f"rid {MAC.hex()}"], ["adsb 4b1805"]


class Flight:
    """An aircraft 800 m to the east that flies north at 10 m/s, heard both ways each second."""

    def __init__(self) -> None:
        self.picture, self.now_s, self.alerts = TrafficPicture(NEAR), 100.0, list[ObstacleAlert]()

    def fly(self, seconds: int, *, drone: dict[str, Any] | None = None, **plane: Any) -> TrafficStatus:
        """``drone`` and ``plane``: what the remote ID and the transponder say otherwise."""
        drone = {"aside_m": 5.0} | (drone or {})
        aside_m, mac, status = drone.pop("aside_m"), drone.pop("mac", MAC), None
        for _ in range(seconds):
            north_m = 10.0 * (self.now_s - 160.0)
            told = {"direction": 0, "speed_horizontal": 1_000, "speed_vertical": 0, "altitude_geodetic": 548.0}
            self.hear(adsb(at=moved_deg(HERE, 800.0, north_m), **({"heading": 0, "hor_velocity": 1_000} | plane)))
            at = moved_deg(HERE, 800.0 - aside_m, north_m)
            self.hear(location(mac=mac, at=at, timestamp=self.now_s, **(told | drone)))
            status = self.tick()
        assert status is not None
        return status

    def hear(self, *messages: Any) -> None:
        for message in messages:
            self.picture.on_message(message, own_state(self.now_s), self.now_s)

    def tick(self) -> TrafficStatus:
        self.now_s += 1.0
        told = self.picture.on_tick(own_state(self.now_s), self.now_s, self.now_s)
        assert told is not None
        self.alerts += told.alerts
        return told.status


PLANE: dict[str, Any] = {"altitude": 520_000, "ver_velocity": 0}


def keys(status: TrafficStatus) -> list[str]:
    return sorted(it.key for it in status.aircraft)


def test_what_agrees_for_long_enough_is_one_aircraft_with_both_names_where_the_nearer_is() -> None:
    flight = Flight()
    flight.hear(basic_id())
    assert keys(flight.fly(PICTURES - 1, **PLANE)) == BOTH
    status = flight.fly(1, **PLANE)
    assert keys(status) == ONE
    (it,) = status.aircraft
    assert it.name == "HBABC (1581F5FKD)"
    assert it.distance_m is not None
    # The remote ID's place lies 5 m nearer.
    assert it.lon_deg == pytest.approx(moved_deg(HERE, 795.0, 0.0)[1], abs=1e-6)
    assert keys(flight.fly(1, drone={"aside_m": 70.0}, **PLANE)) == ONE
    assert keys(flight.fly(1, drone={"aside_m": 200.0}, **PLANE)) == BOTH


def test_an_id_that_both_send_needs_no_time_but_the_same_place() -> None:
    for name in (b"HB-ABC", b"4B1805"):
        flight = Flight()
        flight.hear(basic_id(name))
        (it,) = flight.fly(1, **PLANE).aircraft
        assert it.name == "HBABC"
    forged = Flight()
    forged.hear(basic_id(b"HB-ABC"))
    assert keys(forged.fly(2 * PICTURES, drone={"aside_m": 500.0}, **PLANE)) == BOTH


@pytest.mark.parametrize(
    ("drone", "plane"),
    [
        ({"aside_m": 60.0}, PLANE),
        ({"speed_horizontal": 1_600}, PLANE),
        ({"direction": 27_000}, PLANE),
        ({"speed_horizontal": 25_500}, PLANE),
        ({"speed_vertical": 400}, PLANE),
        ({"altitude_geodetic": 700.0}, PLANE),
        ({"altitude_geodetic": -1000.0, "altitude_barometric": -1000.0}, PLANE),
        ({}, PLANE | {"tslc": 7}),
        ({"status": 1}, PLANE),
    ],
    ids=["place", "speed", "course", "no speed", "climb", "height", "no height", "old", "on ground"],
)
def test_both_stay_where_it_is_unsure(drone: dict[str, Any], plane: dict[str, Any]) -> None:
    assert keys(Flight().fly(2 * PICTURES, drone=drone, **plane)) == BOTH


def test_one_that_agrees_with_two_is_joined_with_neither() -> None:
    flight, status = Flight(), None
    for _ in range(2 * PICTURES):
        at = moved_deg(HERE, 805.0, 10.0 * (flight.now_s - 160.0))
        second = {"direction": 0, "speed_horizontal": 1_000, "speed_vertical": 0, "altitude_geodetic": 548.0}
        flight.hear(location(mac=OTHER_MAC, at=at, timestamp=flight.now_s, **second))
        status = flight.fly(1, **PLANE)
    assert status is not None
    assert len(keys(status)) == 3


def test_a_warning_goes_on_under_one_name_and_the_other_ends_with_a_word() -> None:
    flight = Flight()
    flight.fly(PICTURES + 2, **PLANE)
    begun = [alert.id for alert in flight.alerts if alert.phase == "begins"]
    ended = [alert.text for alert in flight.alerts if alert.phase == "ends"]
    assert len(begun) == 2
    assert ended == [f"Traffic {MAC.hex()}: the same aircraft as HBABC ({MAC.hex()})."]
    assert [alert.id.rpartition("-")[0] for alert in flight.alerts][-1] == "traffic-adsb 4b1805"


def test_the_warning_of_the_one_that_is_listed_no_more_becomes_the_others() -> None:
    """By its own height, which is uncertain, the transponder alone would not be warned of."""
    flight = Flight()
    flight.fly(
        PICTURES + 2, altitude=900_000, ver_velocity=0, drone={"altitude_geodetic": 760.0, "vertical_accuracy": 1}
    )
    begun = {alert.id for alert in flight.alerts if alert.phase == "begins"}
    assert len(begun) == 1
    assert next(iter(begun)).startswith("traffic-rid")
    assert {alert.id for alert in flight.alerts} == begun
    assert "HBABC" in flight.alerts[-1].text
