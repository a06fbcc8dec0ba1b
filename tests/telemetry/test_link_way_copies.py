"""What comes over several ways is used once."""

from __future__ import annotations

import random
from collections import Counter

from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.link.ways.copies import ANSWERS, KEEP_S, MOST, Copies
from tests.telemetry.frames import heard
from tests.telemetry.way_carriers import LTE, RADIO, WIFI


@given(
    said=st.lists(st.integers(0, 5), max_size=60),
    losses=st.tuples(st.floats(0, 0.9), st.floats(0, 0.9)),
    late=st.integers(0, 20),
    seed=st.integers(0, 999),
)
def test_everything_that_comes_by_any_way_is_used_and_nothing_more_often_than_it_was_said(
    said: list[int], losses: tuple[float, float], late: int, seed: int
) -> None:
    """Slow oracle: of each content no more than was said, no less than the way that brought most of it brought."""
    chance, copies = random.Random(seed), Copies()
    arrivals = [
        (at + (late if way else 0), way, what)
        for at, what in enumerate(said)
        for way in (0, 1)
        if chance.random() >= losses[way]
    ]
    used: Counter[int] = Counter()
    for at, way, what in sorted(arrivals):
        message = heard(mavlink.MAVLink_command_ack_message(what, 0, 0, 0, 255, 190), sequence=at % 256)
        used[what] += copies.is_new(f"way {way}", message, at / 10)
    for what in range(6):
        by_way = [sum(w == way and content == what for _, w, content in arrivals) for way in (0, 1)]
        assert max(by_way) <= used[what] <= said.count(what)


def test_copies_are_forgotten_and_bounded() -> None:
    copies = Copies()
    text = heard(mavlink.MAVLink_statustext_message(6, b"Arming motors"))
    assert copies.is_new(WIFI, text, 0.0)
    assert not copies.is_new(LTE, text, KEEP_S)
    assert copies.is_new(LTE, text, 2 * KEEP_S)
    for number in range(2 * MOST):
        copies.is_new(WIFI, heard(mavlink.MAVLink_log_data_message(1, number, 1, [0] * 90)), 2 * KEEP_S)
    assert copies.is_new(WIFI, text, 2 * KEEP_S)


def test_an_answer_in_the_old_dialect_is_the_same_answer() -> None:
    message = mavlink.MAVLink_mission_count_message(255, 190, 3)
    old = mavlink.MAVLink(None, 1, 1)
    first = old.decode(bytearray(message.pack(old, force_mavlink1=True)))
    copies = Copies()
    assert copies.is_new(RADIO, first, 0.0)
    assert not copies.is_new(WIFI, heard(message), 0.1)


def test_only_what_the_dialect_has_is_listed() -> None:
    assert {kind.msgname for kind in mavlink.mavlink_map.values()} >= ANSWERS
