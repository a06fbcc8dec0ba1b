"""Lost packets, round trips and rates."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.ways.quality import MOST_QUESTIONS, WINDOW_S, RateMeter, RoundTripClock, SequenceQuality
from tests.telemetry.frames import heard


def test_nothing_is_known_before_the_first_packet() -> None:
    assert SequenceQuality().share(0.0) is None


def test_every_packet_that_is_missing_counts() -> None:
    quality = SequenceQuality()
    for sequence in (250, 251, 254, 255, 0, 2):
        quality.hear(sequence, 0.0)
    assert quality.share(0.0) == pytest.approx(6 / 9)


@given(st.lists(st.integers(0, 255), min_size=1, max_size=200))
def test_quality_is_a_share_whatever_comes(sequences: list[int]) -> None:
    quality = SequenceQuality()
    for sequence in sequences:
        quality.hear(sequence, 0.0)
    share = quality.share(0.0)
    assert share is not None
    assert 0 < share <= 1


def test_repeated_late_and_restarted_packets_are_no_losses() -> None:
    quality = SequenceQuality()
    for sequence in (10, 11, 11, 9, 12, 150, 151):
        quality.hear(sequence, 0.0)
    assert quality.share(0.0) == 1.0


def test_old_losses_are_forgotten() -> None:
    quality = SequenceQuality()
    quality.hear(0, 0.0)
    quality.hear(5, 0.0)
    quality.hear(6, WINDOW_S + 1)
    assert quality.share(WINDOW_S + 1) == 1.0
    assert quality.share(3 * WINDOW_S) is None


def test_the_round_trip_is_measured_by_our_own_question_only() -> None:
    clock = RoundTripClock()
    question = clock.ask(100.0)
    assert clock.on_message(heard(mavlink.MAVLink_timesync_message(0, question.ts1)), 100.1) is None
    assert clock.on_message(heard(mavlink.MAVLink_timesync_message(9, 12345)), 100.1) is None
    assert clock.round_trip_s is None
    answer = heard(mavlink.MAVLink_timesync_message(7_000_000_000, question.ts1))
    reading = clock.on_message(answer, 100.25)
    assert reading is not None
    assert reading == clock.reading(question.ts1)
    assert (reading.round_trip_s, reading.ahead_s) == (pytest.approx(0.25), pytest.approx(7.0 - 100.125))
    assert clock.on_message(answer, 103.0) is None
    assert clock.round_trip_s == pytest.approx(0.25)


def test_an_answer_that_takes_longer_than_the_next_question_is_still_measured() -> None:
    clock = RoundTripClock()
    first, _ = clock.ask(100.0), clock.ask(101.0)
    assert clock.on_message(heard(mavlink.MAVLink_timesync_message(9, first.ts1)), 102.5) is not None
    assert clock.round_trip_s == pytest.approx(2.5)
    late = [clock.ask(float(second)) for second in range(102, 102 + 2 * MOST_QUESTIONS)][-1]
    assert clock.reading(first.ts1) is None
    assert clock.on_message(heard(mavlink.MAVLink_timesync_message(9, late.ts1)), 1000.0) is None


def test_answers_are_counted_against_questions_that_are_due() -> None:
    clock = RoundTripClock(number=3)
    assert (clock.share(100.0), clock.unanswered(100.0)) == (None, 0)
    questions = [clock.ask(100.0 + k) for k in range(6)]
    assert (clock.share(100.5), clock.unanswered(105.5)) == (None, 5)
    other = heard(mavlink.MAVLink_timesync_message(9, questions[3].ts1 - 1))
    assert clock.on_message(other, 103.2) is None, "of another way"
    answer = heard(mavlink.MAVLink_timesync_message(9, questions[3].ts1))
    assert clock.on_message(answer, 103.2) is not None
    assert (clock.share(105.5), clock.unanswered(105.5)) == (pytest.approx(1 / 5), 1)
    clock.forget_unanswered(105.5)
    assert (clock.share(105.5), clock.unanswered(105.5), clock.round_trip_s) == (1.0, 0, pytest.approx(0.2))
    assert clock.unanswered(110.0) == 1, "the last one was not due"


def test_the_rate_is_what_really_happened() -> None:
    meter = RateMeter()
    for k in range(11):
        meter.count(float(k))
    assert meter.hz(10.0) == pytest.approx(1.0)
    assert meter.hz(15.0) < 0.6
    assert meter.hz(60.0) == 0.0
