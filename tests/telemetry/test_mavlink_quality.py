"""Lost packets, round trips and rates."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.quality import WINDOW_S, RateMeter, RoundTripClock, SequenceQuality
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
    (question,) = clock.on_tick(100.0)
    assert clock.on_tick(100.5) == []
    clock.on_message(heard(mavlink.MAVLink_timesync_message(0, 5)), 100.1)
    clock.on_message(heard(mavlink.MAVLink_timesync_message(9, 12345)), 100.1)
    assert clock.round_trip_s is None
    clock.on_message(heard(mavlink.MAVLink_timesync_message(9, question.ts1)), 100.25)
    assert clock.round_trip_s == pytest.approx(0.25)
    assert len(clock.on_tick(102.0)) == 1


def test_the_rate_is_what_really_happened() -> None:
    meter = RateMeter()
    for k in range(11):
        meter.count(float(k))
    assert meter.hz(10.0) == pytest.approx(1.0)
    assert meter.hz(15.0) < 0.6
    assert meter.hz(60.0) == 0.0
