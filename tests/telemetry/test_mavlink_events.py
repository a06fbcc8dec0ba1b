"""Events: in their order over a lossy link, in words, and told once."""

import struct
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.codec import Parser
from telemetry.mavlink.texts import Speech, VehicleWords
from telemetry.mavlink.texts import event_messages as wire
from telemetry.mavlink.texts.event_reader import MOST_REQUESTS, EventReader, LostEvents, VehicleEvent
from telemetry.mavlink.texts.event_words import ARMING_SUMMARY, HEALTH_SUMMARY, event_id
from telemetry.recording.frame_facts import FrameFacts
from tests.telemetry.frames import heard

VEHICLE = (1, 1)
ADDED = (wire.EventMessage, wire.CurrentEventSequence, wire.RequestEvent, wire.ResponseEventError)


def event(number: int, name_or_id: str | int = 5, arguments: bytes = b"", *, level: int = 6, to: int = 0) -> Any:
    identity = event_id(name_or_id) if isinstance(name_or_id, str) else name_or_id
    return heard(wire.EventMessage(0, to, identity, 1000, number % 65536, level, arguments.ljust(40, b"\0")))


def newest(number: int, flags: int = 0) -> Any:
    return heard(wire.CurrentEventSequence(number, flags))


def check(name: str | int, number: int, more: bytes = b"", *, modes: int = 0xFFFFFFFF, level: int = 3) -> Any:
    return event(number, name, struct.pack("<IB", modes, 3) + more, level=level)


def report(first: int, *checks: Any) -> list[Any]:
    ends = event(first, ARMING_SUMMARY, level=8), event(first + len(checks) + 1, HEALTH_SUMMARY, level=8)
    return [ends[0], *checks, ends[1]]


def ids(out: list[VehicleEvent | LostEvents]) -> list[int]:
    return [-each.count if isinstance(each, LostEvents) else each.id for each in out]


@pytest.mark.parametrize("kind", ADDED)
def test_the_seeds_of_the_checksums_follow_from_the_fields(kind: Any) -> None:
    crc = mavlink.x25crc()
    words = [kind.msgname]
    for name in kind.ordered_fieldnames:
        words += [kind.fieldtypes[kind.fieldnames.index(name)], name]
    crc.accumulate("".join(f"{word} " for word in words).encode())
    for length in filter(None, kind.array_lengths):
        crc.accumulate(bytes([length]))
    assert (crc.crc & 255) ^ (crc.crc >> 8) == kind.crc_extra


@pytest.mark.fact("P18")
def test_frames_of_events_are_no_bad_bytes() -> None:
    parser = Parser(datagrams=True)
    frame = wire.EventMessage(0, 0, 77, 1, 9, 0x64, b"\x01\x02".ljust(40, b"\0")).pack(mavlink.MAVLink(None, 1, 1))
    (message,) = parser.feed(frame)
    assert (message.get_type(), message.id, message.sequence, parser.bad_bytes) == ("EVENT", 77, 9, 0)
    assert bytes(message.arguments[:3]) == b"\x01\x02\x00"


def test_lost_events_are_asked_for_and_come_in_their_order() -> None:
    reader = EventReader(VEHICLE)
    assert ids(reader.on_message(event(65534, 1), 0.0)) == [1]
    assert ids(reader.on_message(event(1, 4), 0.1)) == []
    (request,) = reader.take_requests()
    assert (request.target_system, request.first_sequence, request.last_sequence) == (1, 65535, 0)
    assert ids(reader.on_message(event(0, 3), 0.2)) == []
    assert ids(reader.on_message(event(65535, 2), 0.3)) == [2, 3, 4]
    assert ids(reader.on_message(event(65535, 2), 0.4)) == []
    assert not reader.take_requests()


def test_the_newest_number_shows_that_the_last_one_is_missing() -> None:
    reader = EventReader(VEHICLE)
    reader.on_message(newest(7), 0.0)
    assert not reader.take_requests()
    reader.on_message(newest(8), 3.0)
    assert [(each.first_sequence, each.last_sequence) for each in reader.take_requests()] == [(8, 8)]
    assert ids(reader.on_message(event(8, 2), 3.1)) == [2]


def test_what_is_not_given_counts_as_lost_and_holds_up_nothing() -> None:
    reader = EventReader(VEHICLE)
    reader.on_message(event(0, 1), 0.0)
    reader.on_message(event(3, 4), 0.0)
    asked, out, now_s = 0, list[VehicleEvent | LostEvents](), 0.0
    while not out and now_s < 60:
        asked += len(reader.take_requests())
        now_s += 0.1
        out = reader.on_tick(now_s)
    assert (ids(out), asked) == ([-2, 4], MOST_REQUESTS)


def test_the_vehicles_word_that_it_has_no_more_is_taken() -> None:
    reader = EventReader(VEHICLE)
    reader.on_message(event(0, 1), 0.0)
    reader.on_message(event(4, 5), 0.0)
    assert ids(reader.on_message(heard(wire.ResponseEventError(255, 190, 1, 3, 0)), 0.1)) == [-2]
    assert ids(reader.on_message(event(3, 4), 0.2)) == [4, 5]


def test_a_vehicle_that_begins_anew_is_heard_from_its_beginning() -> None:
    reader = EventReader(VEHICLE)
    reader.on_message(event(900, 1), 0.0)
    reader.on_message(newest(4, wire.RESET), 1.0)
    assert ids(reader.on_message(event(4, 2), 1.1)) == [2]
    assert ids(reader.on_message(event(30000, 3), 1.2)) == [3]
    assert not reader.take_requests()


def test_answers_to_others_are_not_taken() -> None:
    assert ids(EventReader(VEHICLE).on_message(event(4, 2, to=7), 0.0)) == []


def said(speech: Speech, *messages: Any, now_s: float = 0.0) -> list[tuple[int, str]]:
    return [text for message in messages for text in speech.on_message(message, now_s).texts]


def test_known_events_are_words_and_unknown_ones_say_so() -> None:
    failsafe = struct.pack("<IBB", 0, 6, 2)
    told = said(
        Speech(VEHICLE),
        event(0, "commander_armed_by", b"\x04"),
        event(1, "commander_failsafe_enter", failsafe, level=2),
        event(2, "commander_modeswitch_not_avail", struct.pack("<IB", 0, 3), level=2),
        event(3, "navigator_mis_unsup_cmd", struct.pack("<HH", 4, 530), level=3),
        event(4, 4711, b"\x07\x00\x01", level=4),
        event(5, 4712, level=8),
    )
    assert told == [
        (6, "Armed by external command"),
        (2, "Failsafe activated due to GCS connection loss, triggering Return"),
        (2, "Switching to Mission is currently not available"),
        (3, "Mission rejected: item 4: unsupported cmd: 530"),
        (4, "Event 4711 of the vehicle (no words known), arguments 07 00 01"),
    ]


def test_what_is_said_by_a_text_and_by_an_event_is_told_once() -> None:
    speech = Speech(VEHICLE)
    text = heard(mavlink.MAVLink_statustext_message(6, b"Takeoff detected\t", 0, 0))
    assert said(speech, text, event(0, "commander_takeoff_detected")) == [(6, "Takeoff detected")]
    assert said(speech, event(1, "commander_takeoff_detected"), text, now_s=9.0) == [(6, "Takeoff detected")]
    assert len(said(speech, text, text, now_s=20.0)) == 2


def test_a_report_is_all_that_keeps_from_arming() -> None:
    speech = Speech(VEHICLE)
    manual = check("check_modes_manual_control", 2, modes=0b111)
    compass, unknown = check("check_mag_not_calibrated", 1, b"\x01"), check(4711, 3)
    messages = report(0, compass, manual, unknown)
    assert [speech.on_message(each, 0.0).reasons for each in messages[:-1]] == [None] * 4
    last = speech.on_message(messages[-1], 0.0)
    assert last.reasons is not None
    assert last.reasons[0] == "Compass 1 uncalibrated"
    assert last.reasons[1].startswith("Event 4711 of the vehicle (no words known)")
    assert last.reasons[1].endswith("about: GPS")
    assert last.texts == ((3, last.reasons[0]), (3, last.reasons[1]))
    again = [speech.on_message(each, 5.0) for each in report(5, check("check_mag_not_calibrated", 6, b"\x01"))]
    assert (again[-1].reasons, again[-1].texts) == (("Compass 1 uncalibrated",), ())
    assert [speech.on_message(each, 9.0).reasons for each in report(8)][-1] == ()


def test_a_report_with_a_hole_is_none_and_another_is_wanted() -> None:
    speech = Speech(VEHICLE)
    first, _, last = report(0, check("check_battery_low", 1))
    speech.on_message(first, 0.0)
    assert (speech.take_wish(), speech.take_wish()) == (True, False)
    assert speech.on_message(last, 0.0).reasons is None
    heard_at_last = speech.on_tick(float("inf"))
    assert heard_at_last.reasons is None
    assert heard_at_last.texts == ((5, "1 event of the vehicle got lost."),)
    assert speech.take_wish()


def test_a_refusal_is_quoted_from_an_event_once() -> None:
    words = VehicleWords()
    words.on_message(heard(mavlink.MAVLink_statustext_message(2, b"Arming denied: calibrating\t", 0, 0)))
    words.on_message(event(0, "commander_arm_denied_calibrating", level=2))
    words.on_message(event(1, "commander_arm_denied_throttle_high", level=2))
    words.on_message(event(2, "commander_armed_by", b"\x04"))
    assert words.texts == ("Arming denied: calibrating", "Arming denied: high throttle")


def test_recordings_tell_the_events_of_a_flight() -> None:
    facts = FrameFacts(*VEHICLE)
    facts.on_message(event(0, "commander_takeoff_detected"), 10.0)
    facts.on_message(event(2, "commander_landing_detected"), 20.0)
    assert [text.text for text in facts.texts()] == [
        "Takeoff detected",
        "1 event of the vehicle got lost.",
        "Landing detected",
    ]
