"""What is left of a flight when avoidance takes it over."""

from __future__ import annotations

from dataclasses import replace

import pytest

from telemetry.flight.guided.remaining_mission import RemainingMission, remaining_flight, remaining_from
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.test_mavlink_flights import ALT_M, LAT_DEG, LON_DEG, items

FAR = VehicleState(
    1,
    1,
    autopilot="ardupilot",
    mode="AUTO",
    armed=True,
    lat_deg=LAT_DEG + 5e-4,
    lon_deg=LON_DEG,
    home_lat_deg=LAT_DEG,
    home_lon_deg=LON_DEG,
    mission_item=3,
)


def onboard(*found: Item) -> OnboardMission:
    return OnboardMission(found or items(), LAT_DEG, LON_DEG, ALT_M, "digest")


def test_it_begins_with_the_item_that_is_flown_to_and_ends_as_the_mission_does() -> None:
    remaining = remaining_flight(onboard(), FAR)
    assert remaining is not None
    assert [t.item for t in remaining.targets] == [3, 4]
    assert remaining.end == "rtl"
    assert [t.alt_rel_home_m for t in remaining.raised(5.0).targets] == pytest.approx([19.006, 20.006])


def test_take_offs_landings_and_other_modes_have_no_rest() -> None:
    assert remaining_flight(onboard(), replace(FAR, mission_item=1)) is None
    assert remaining_flight(onboard(), replace(FAR, mission_item=None)) is None
    assert remaining_flight(onboard(), replace(FAR, mode="LOITER")) is None
    assert remaining_flight(None, FAR) is None
    landing = replace(items()[-1], command=21)
    assert remaining_flight(onboard(*items()[:-1], landing), replace(FAR, mission_item=5)) is None


def test_the_way_home_is_one_until_it_is_a_descent() -> None:
    home = replace(FAR, mode="RTL")
    assert remaining_flight(None, home) == RemainingMission((), "rtl")
    assert remaining_flight(onboard(), replace(FAR, mission_item=5)) == RemainingMission((), "rtl")
    assert remaining_flight(None, replace(home, lat_deg=LAT_DEG + 1e-4)) is None
    assert remaining_flight(None, replace(home, home_lat_deg=None)) is None
    assert remaining_flight(onboard(), replace(FAR, mission_item=5, lat_deg=LAT_DEG)) is None


def test_speeds_that_were_set_before_hold_and_splines_cannot_be_gone_on_with() -> None:
    slow = Item(178, 2, (1.0, 1.5, -1.0, 0.0), 0.0, 0.0, 0.0)
    first, *others = items()
    remaining = remaining_from(onboard(first, slow, *others), 4)
    assert remaining is not None
    assert {t.speed_m_s for t in remaining.targets} == {1.5}
    spline = replace(others[0], command=82)
    assert remaining_from(onboard(first, spline, *others), 2) is None
