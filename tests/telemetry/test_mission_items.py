"""Items between the plan, the wire and the vehicle."""

from __future__ import annotations

import math

import pytest

from planning.basics.plan_model import Home, Mission, MissionItem
from telemetry.errors import TransferError
from telemetry.mavlink.items import (
    home_message,
    item_from_message,
    item_message,
    items_from_mission,
    mission_from_onboard,
)
from telemetry.topics.onboard_lists import Item, OnboardMission

VEHICLE = (1, 1)
NAN = math.nan
HOME = Home(-37.1, 175.6, 803.15)


def test_a_plan_becomes_items_and_what_is_not_given_is_none() -> None:
    plan = MissionItem(16, 3, (2.0, 0.0, 0.0, NAN), -37.1, 175.6, 13.552, autocontinue=False)
    assert items_from_mission(Mission(HOME, (plan,), "px4")) == (
        Item(16, 3, (2.0, 0.0, 0.0, None), -37.1, 175.6, 13.552, False),
    )


def test_what_was_read_back_becomes_a_mission_again() -> None:
    item = Item(16, 3, (2.0, 0.0, 0.0, None), -37.1, 175.6, 13.55)
    onboard = OnboardMission((item,), -37.0, 175.0, 803.24, "")
    mission = mission_from_onboard(onboard, "ardupilot")
    assert (mission.home.lat_deg, mission.home.alt_dsm_m, mission.home.vertical_datum) == (-37.0, 803.24, "AMSL")
    assert mission.items[0].params[:3] == (2.0, 0.0, 0.0)
    assert math.isnan(mission.items[0].params[3])
    assert mission_from_onboard(onboard, "ardupilot", home=HOME).home == HOME
    assert items_from_mission(mission) == (item,)


def test_a_vehicle_without_a_home_leaves_it_unknown() -> None:
    home = mission_from_onboard(OnboardMission((), None, None, None, ""), "px4").home
    assert math.isnan(home.lat_deg)
    assert math.isnan(home.alt_dsm_m)


def test_places_are_written_in_ten_millionths_of_a_degree_to_the_nearest() -> None:
    item = Item(16, 3, (0.0, 0.0, 0.0, None), -37.1244507, 175.6892879, 13.55)
    message = item_message(item, 4, target=VEHICLE, number=4, firmware="px4")
    assert (message.x, message.y, message.seq, message.frame) == (-371244507, 1756892879, 4, 3)
    assert math.isnan(message.param4)
    assert item_from_message(message) == item


def test_ardupilot_gets_zero_for_what_is_not_given() -> None:
    item = Item(16, 3, (None, 0.0, 0.0, None), -37.1, 175.6, 13.55)
    message = item_message(item, 4, target=VEHICLE, number=4, firmware="ardupilot")
    assert (message.param1, message.param4) == (0.0, 0.0)


def test_commands_without_a_place_keep_their_fifth_and_sixth_parameter() -> None:
    item = Item(206, 2, (5.0, 0.0, 1.0, 0.0), 3.0, 7.0, 0.0)
    message = item_message(item, 1, target=VEHICLE, number=1, firmware="ardupilot")
    assert (message.x, message.y) == (3, 7)
    assert item_from_message(message) == item


@pytest.mark.parametrize(("lat", "lon", "field"), [(NAN, 0.0, "latitude"), (0.0, math.inf, "longitude")])
def test_a_place_that_is_no_number_names_its_item(lat: float, lon: float, field: str) -> None:
    with pytest.raises(TransferError, match=f"{field} of item 7"):
        item_message(Item(16, 3, (0, 0, 0, 0), lat, lon, 1.0), 8, target=VEHICLE, number=7, firmware="ardupilot")


def test_the_home_row_is_a_waypoint_above_sea_level() -> None:
    row = home_message(-37.1, NAN, 803.15, target=VEHICLE)
    assert (row.seq, row.command, row.frame, row.x, row.y) == (0, 16, 0, -371000000, 0)
    assert row.z == pytest.approx(803.15)
