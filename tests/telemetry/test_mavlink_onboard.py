"""What is known of the mission on board, and what makes it unknown again."""

from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.onboard import SETTLE_S, OnBoard
from telemetry.topics.onboard_lists import Item, OnboardMission
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.frames import attitude, heard

ITEM = Item(16, 3, (0.0, 0.0, 0.0, 0.0), -37.0, 175.0, 10.0)
MISSION = OnboardMission((ITEM,), None, None, None, "digest")
EMPTY = OnboardMission((), None, None, None, "nothing")
STATE = VehicleState(1, 1, mission_item=0, mission_items=1, mission_id=77)
LATER_S = 10 * SETTLE_S


def known() -> OnBoard:
    onboard = OnBoard()
    onboard.transfer_begins(replaces=True)
    onboard.transfer_ends(MISSION, 0.0)
    return onboard


def test_nothing_is_known_at_first() -> None:
    assert (OnBoard().state, OnBoard().digest) == ("unknown", None)


def test_a_read_back_makes_it_known() -> None:
    assert (known().state, known().digest) == ("verified", "digest")
    onboard = OnBoard()
    onboard.transfer_ends(EMPTY, 0.0)
    assert onboard.state == "none"


def test_from_the_first_item_of_an_upload_on_it_is_unknown_and_stays_so_when_that_fails() -> None:
    onboard = known()
    onboard.transfer_begins(replaces=True)
    assert onboard.state == "unknown"
    onboard.transfer_ends(None, 5.0)
    assert onboard.state == "unknown"


def test_a_read_back_that_fails_changes_nothing() -> None:
    onboard = known()
    onboard.transfer_begins(replaces=False)
    onboard.transfer_ends(None, 5.0)
    assert onboard.state == "verified"


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_mission_request_message(254, 190, 3),
        mavlink.MAVLink_mission_request_int_message(254, 190, 3),
        mavlink.MAVLink_mission_ack_message(254, 190, 0),
    ],
)
def test_another_ground_stations_upload_is_noticed(message: object) -> None:
    onboard = known()
    assert not onboard.on_message(heard(message), SETTLE_S / 2)
    assert onboard.on_message(heard(message), LATER_S)
    assert onboard.state == "unknown"
    assert not onboard.on_message(heard(message), LATER_S)


@pytest.mark.parametrize(
    ("message", "lost"),
    [
        (mavlink.MAVLink_mission_count_message(1, 1, 7), True),
        (mavlink.MAVLink_mission_clear_all_message(0, 0), True),
        (mavlink.MAVLink_mission_count_message(2, 1, 7), False),
        (mavlink.MAVLink_mission_count_message(1, 1, 7, mavlink.MAV_MISSION_TYPE_FENCE), False),
        (mavlink.MAVLink_mission_request_list_message(1, 1), False),
    ],
)
def test_another_ground_station_that_is_heard_to_write_is_noticed(message: object, lost: bool) -> None:
    onboard = known()
    assert onboard.on_foreign(heard(message), 1) is lost
    assert (onboard.state == "unknown") is lost


def test_a_count_that_does_not_fit_what_was_read_back_is_noticed_whenever_it_changed() -> None:
    onboard, counts = known(), heard(mavlink.MAVLink_mission_current_message(0, 2))
    two = replace(STATE, mission_items=2)
    assert not onboard.on_state(two, LATER_S)  # a figure from before the transfer
    onboard.on_message(counts, LATER_S)
    assert onboard.on_state(two, LATER_S)
    assert onboard.state == "unknown"


def test_the_vehicles_own_words_about_it_count_at_once() -> None:
    words = heard(mavlink.MAVLink_statustext_message(6, b"Flight plan received"))
    onboard = known()
    assert onboard.on_message(words, 0.1)
    assert onboard.state == "unknown"
    onboard.transfer_begins(replaces=True)
    assert not onboard.on_message(words, 0.2)


def test_what_has_nothing_to_do_with_it_changes_nothing() -> None:
    onboard = known()
    fence = mavlink.MAVLink_mission_ack_message(254, 190, 0, mavlink.MAV_MISSION_TYPE_FENCE)
    assert not onboard.on_message(heard(fence), LATER_S)
    assert not onboard.on_message(heard(attitude()), LATER_S)
    assert onboard.state == "verified"


@pytest.mark.parametrize("changes", [{"mission_items": 2}, {"mission_id": 78}])
def test_other_figures_of_the_vehicle_make_it_unknown(changes: dict[str, int]) -> None:
    onboard = known()
    assert not onboard.on_state(STATE, LATER_S)
    assert not onboard.on_state(replace(STATE, mission_item=1), LATER_S)
    assert onboard.on_state(replace(STATE, mission_item=1, **changes), LATER_S)
    assert onboard.state == "unknown"


def test_figures_that_lag_behind_our_own_transfer_do_not_count() -> None:
    onboard = known()
    assert not onboard.on_state(STATE, 0.1)
    assert not onboard.on_state(replace(STATE, mission_items=9), 0.2)
    assert not onboard.on_state(replace(STATE, mission_items=9), LATER_S)
    assert onboard.state == "verified"


def test_a_restart_makes_it_unknown() -> None:
    onboard = known()
    onboard.forget()
    assert onboard.state == "unknown"
