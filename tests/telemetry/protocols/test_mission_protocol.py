"""Missions, raw on the wire, against both simulated autopilots: what the standard asks of each of them, and where
ArduCopter and PX4 are known to go ways of their own."""

from __future__ import annotations

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from tests.telemetry.protocols.station import (
    ACCEPTED,
    ALL,
    CANCELLED,
    ERROR,
    FENCE,
    INVALID_SEQUENCE,
    MAKES,
    MISSION,
    NO_SPACE,
    REQUESTS,
    UNSUPPORTED,
    Station,
    place,
    places,
    same_places,
)

ITEMS = 10


@pytest.fixture(params=MAKES)
def station(request: pytest.FixtureRequest) -> Station:
    return Station(request.param)


def begin(station: Station, count: int, arrived: int = 0, kind: int = MISSION) -> None:
    """An upload of which so many items have arrived."""
    station.say(wire.MAVLink_mission_count_message(1, 1, count, kind))
    for seq in range(arrived):
        station.say(place(seq, kind=kind))
    station.forget()


def kinds(answers: list[Any]) -> list[str]:
    return [answer.get_type() for answer in answers]


@pytest.mark.parametrize("count", [1, 2, ITEMS, 100])
def test_what_was_uploaded_is_downloaded(station: Station, count: int) -> None:
    assert station.upload(places(count)) == ACCEPTED
    assert same_places(station, station.download(), places(count))


def test_a_second_mission_replaces_the_first(station: Station) -> None:
    station.upload(places(ITEMS))
    shorter = [place(seq, z=50.0) for seq in range(4)]
    assert station.upload(shorter) == ACCEPTED
    assert same_places(station, station.download(), shorter)


def test_clearing_leaves_nothing_and_may_be_repeated(station: Station) -> None:
    station.upload(places(ITEMS))
    assert [station.clear(), station.clear()] == [ACCEPTED, ACCEPTED]
    assert station.download() == []


def test_a_count_of_nothing_clears(station: Station) -> None:
    station.upload(places(ITEMS))
    answer = station.ask(wire.MAVLink_mission_count_message(1, 1, 0), "MISSION_ACK")
    assert (answer.type, station.download()) == (ACCEPTED, [])


def test_all_lists_at_once_are_cleared_by_px4_alone(station: Station) -> None:
    station.upload(places(ITEMS))
    result = station.clear(ALL)
    left = len(station.download())
    assert (result, left) == ((ACCEPTED, 0) if station.make == "px4" else (UNSUPPORTED, ITEMS))


def test_more_items_than_it_holds_are_refused_and_the_old_ones_stay(station: Station) -> None:
    station.upload(places(3))
    answer = station.ask(wire.MAVLink_mission_count_message(1, 1, 5000), "MISSION_ACK")
    assert answer.type == NO_SPACE
    assert same_places(station, station.download(), places(3))


@pytest.mark.parametrize("kind", [MISSION, FENCE, 2])
def test_every_answer_says_of_which_list_it_is(station: Station, kind: int) -> None:
    count = station.answers(wire.MAVLink_mission_request_list_message(1, 1, kind))
    assert [(one.get_type(), one.mission_type) for one in count] == [("MISSION_COUNT", kind)]
    station.say(wire.MAVLink_mission_ack_message(1, 1, ACCEPTED, kind))
    cleared = station.answers(wire.MAVLink_mission_clear_all_message(1, 1, kind))
    assert [(one.type, one.mission_type) for one in cleared] == [(ACCEPTED, kind)]


def test_a_list_that_does_not_exist_is_unsupported(station: Station) -> None:
    answers = station.answers(wire.MAVLink_mission_count_message(1, 1, 3, 7))
    assert [(one.get_type(), one.type, one.mission_type) for one in answers] == [("MISSION_ACK", UNSUPPORTED, 7)]


def test_a_command_that_it_does_not_know_ends_the_upload(station: Station) -> None:
    begin(station, 3, arrived=1)
    answers = station.answers(place(1, command=60_000))
    assert kinds(answers) == ["MISSION_ACK"]
    assert answers[0].type == UNSUPPORTED


def test_a_place_beyond_the_pole_is_refused(station: Station) -> None:
    begin(station, 3, arrived=1)
    answers = station.answers(place(1, x=910_000_000))
    assert kinds(answers) == ["MISSION_ACK"]
    assert answers[0].type not in (ACCEPTED, ERROR)


def test_an_item_out_of_its_order_is_not_taken(station: Station) -> None:
    begin(station, ITEMS, arrived=3)
    answers = station.answers(place(7), for_s=0.2)
    refused = [one.type for one in answers if one.get_type() == "MISSION_ACK"]
    assert refused == ([INVALID_SEQUENCE] if station.make == "ardupilot" else [])
    assert station.expect(*REQUESTS).seq == 3


def test_an_item_that_comes_twice_is_kept_once(station: Station) -> None:
    begin(station, 4)
    for seq in (0, 0, 1, 2, 2, 3):
        station.say(place(seq))
    station.bench.advance(0.3)
    assert same_places(station, station.download(), places(4))


def test_an_item_without_an_upload_is_an_error(station: Station) -> None:
    answers = station.answers(place(2))
    assert [(one.get_type(), one.type) for one in answers] == [("MISSION_ACK", ERROR)]


def test_the_last_item_once_more_is_confirmed_by_px4(station: Station) -> None:
    """Its answer may have been lost. ArduCopter calls it an error."""
    station.upload(places(4))
    expected = ACCEPTED if station.make == "px4" else ERROR
    assert [one.type for one in station.answers(place(3))] == [expected]
    assert same_places(station, station.download(), places(4))


def test_a_silent_station_is_asked_again_and_then_given_up(station: Station) -> None:
    begin(station, ITEMS, arrived=2)
    again = station.expect(*REQUESTS)
    assert again.seq == 2
    station.bench.advance(10.0)
    station.forget()
    assert station.hear(*REQUESTS, limit_s=3.0) is None
    assert station.upload(places(3)) == ACCEPTED


def test_a_broken_off_upload_leaves_the_old_mission_on_px4_and_a_mixture_on_ardupilot(station: Station) -> None:
    station.upload(places(5))
    begin(station, 5)
    for seq in range(3):
        station.say(place(seq, z=90.0))
    station.bench.advance(10.0)
    heights_m = [round(one.z, 2) for one in station.download()][1:]
    assert heights_m == ([11.0, 12.0, 13.0, 14.0] if station.make == "px4" else [90.0, 90.0, 13.0, 14.0])


def test_a_cancelled_upload_ends_on_px4_and_is_asked_for_further_by_ardupilot(station: Station) -> None:
    begin(station, ITEMS, arrived=2)
    station.say(wire.MAVLink_mission_ack_message(1, 1, CANCELLED))
    asked = station.hear(*REQUESTS, limit_s=3.0)
    assert (asked is None) is (station.make == "px4")


def test_a_stranger_cannot_cancel(station: Station) -> None:
    begin(station, ITEMS, arrived=2)
    station.say(wire.MAVLink_mission_ack_message(1, 1, CANCELLED), system=77)
    assert station.expect(*REQUESTS, limit_s=3.0).seq == 2


def test_nothing_is_cleared_while_a_mission_comes(station: Station) -> None:
    begin(station, 4, arrived=2)
    answers = station.answers(wire.MAVLink_mission_clear_all_message(1, 1), for_s=0.1)
    results = [one.type for one in answers if one.get_type() == "MISSION_ACK"]
    assert results == ([ERROR] if station.make == "ardupilot" else [])
    station.say(place(2))
    station.say(place(3))
    assert station.expect("MISSION_ACK").type == ACCEPTED
    assert same_places(station, station.download(), places(4))


def test_a_download_that_is_confirmed_frees_the_list(station: Station) -> None:
    station.upload(places(3))
    station.download()
    assert [one.type for one in station.answers(wire.MAVLink_mission_clear_all_message(1, 1))] == [ACCEPTED]


def test_a_download_that_is_left_off_holds_up_px4s_clearing_for_five_seconds(station: Station) -> None:
    station.upload(places(3))
    station.say(wire.MAVLink_mission_request_list_message(1, 1))
    at_once = station.answers(wire.MAVLink_mission_clear_all_message(1, 1))
    assert len(at_once) == (0 if station.make == "px4" else 1)
    station.bench.advance(6.0)
    assert [one.type for one in station.answers(wire.MAVLink_mission_clear_all_message(1, 1))] == [ACCEPTED]


def test_items_are_read_in_any_order_from_ardupilot_and_in_order_only_from_px4(station: Station) -> None:
    station.upload(places(5))
    station.answers(wire.MAVLink_mission_request_list_message(1, 1))
    answers = station.answers(wire.MAVLink_mission_request_int_message(1, 1, 3))
    assert kinds(answers) == (["MISSION_ACK"] if station.make == "px4" else ["MISSION_ITEM_INT"])


def test_an_item_beyond_the_last_is_refused(station: Station) -> None:
    station.upload(places(3))
    station.answers(wire.MAVLink_mission_request_list_message(1, 1))
    answers = station.answers(wire.MAVLink_mission_request_int_message(1, 1, 3))
    assert answers[-1].get_type() == "MISSION_ACK"
    assert answers[-1].type != ACCEPTED


def test_a_lost_item_is_given_once_more(station: Station) -> None:
    station.upload(places(3))
    station.answers(wire.MAVLink_mission_request_list_message(1, 1))
    asked = wire.MAVLink_mission_request_int_message(1, 1, 0)
    assert [kinds(station.answers(asked)) for _ in range(2)] == [["MISSION_ITEM_INT"]] * 2


def test_whoever_asks_in_degrees_is_answered_in_degrees(station: Station) -> None:
    station.upload(places(3))
    station.answers(wire.MAVLink_mission_request_list_message(1, 1))
    found = [station.answers(wire.MAVLink_mission_request_message(1, 1, seq)) for seq in range(2)]
    assert [kinds(each) for each in found] == [["MISSION_ITEM"]] * 2
    assert found[1][0].x == pytest.approx(place(1).x / 1e7, abs=1e-5)


def test_a_part_is_replaced_by_ardupilot_alone(station: Station) -> None:
    station.upload(places(6))
    answers = station.answers(wire.MAVLink_mission_write_partial_list_message(1, 1, 2, 3), for_s=0.1)
    if station.make == "px4":
        assert answers == []
        return
    assert [(one.get_type(), one.seq) for one in answers] == [("MISSION_REQUEST", 2)]
    station.say(place(2, z=77.0))
    station.say(place(3, z=77.0))
    assert station.expect("MISSION_ACK").type == ACCEPTED
    assert [round(one.z) for one in station.download()][1:] == [11, 77, 77, 14, 15]


def test_the_current_item_is_set_and_a_wrong_one_is_not(station: Station) -> None:
    station.upload(places(ITEMS))
    station.bench.stream(wire.MAVLINK_MSG_ID_MISSION_CURRENT, 10)
    station.say(wire.MAVLink_mission_set_current_message(1, 1, 2))
    station.bench.advance(0.5)
    assert station.bench.last("MISSION_CURRENT").seq == 2
    station.say(wire.MAVLink_mission_set_current_message(1, 1, 101))
    station.bench.advance(0.5)
    assert station.bench.last("MISSION_CURRENT").seq == 2
    assert [station.bench.command(224, 3), station.bench.command(224, 101)] == [0, 2]


def test_a_message_that_sets_a_wrong_item_is_not_answered(station: Station) -> None:
    station.upload(places(ITEMS))
    before = len(station.bench.heard)
    assert station.bench.send(wire.MAVLink_mission_set_current_message(1, 1, 101)) == []
    assert len(station.bench.heard) == before
    assert station.bench.send(wire.MAVLink_mission_set_current_message(1, 1, 4))[0].seq == 4


def test_another_vehicles_messages_are_not_its_own(station: Station) -> None:
    station.upload(places(3))
    for message in (
        wire.MAVLink_mission_clear_all_message(9, 1),
        wire.MAVLink_mission_count_message(9, 1, 0),
        wire.MAVLink_mission_request_list_message(9, 1),
    ):
        assert station.answers(message, for_s=0.1) == []
    assert same_places(station, station.download(), places(3))


def test_px4_takes_no_mission_that_is_for_another_component() -> None:
    station = Station("px4")
    station.upload(places(3))
    assert station.answers(wire.MAVLink_mission_clear_all_message(1, 100)) == []
    assert same_places(station, station.download(), places(3))


@pytest.mark.parametrize("loss", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("make", MAKES)
def test_a_mission_arrives_over_a_link_that_loses(make: str, loss: float) -> None:
    station = Station(make, loss=loss, seed=int(loss * 100))
    items = places(20)
    results = [station.upload(items)]
    while results[-1] != ACCEPTED and len(results) < 12:  # ArduCopter's last answer was lost
        results.append(station.upload(items))
    assert results[-1] == ACCEPTED
    assert same_places(station, station.download(), items)
    assert station.sent > 42
