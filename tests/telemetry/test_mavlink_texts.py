"""The vehicle's own words, in one or several parts."""

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.texts import Texts
from tests.telemetry.frames import attitude, heard

LONG = "PreArm: " + "compass not calibrated, " * 5


def part(text: str, number: int = 0, chunk: int = 0) -> Any:
    return heard(mavlink.MAVLink_statustext_message(4, text.encode(), number, chunk))


def parts(number: int) -> list[Any]:
    return [part(LONG[at : at + 50], number, k) for k, at in enumerate(range(0, len(LONG), 50))]


def test_a_short_text_comes_at_once() -> None:
    assert Texts().on_message(part("Arm: Need Position Estimate"), 0.0) == [(4, "Arm: Need Position Estimate")]
    assert Texts().on_message(heard(attitude()), 0.0) == []


@pytest.mark.fact("P16")
def test_the_tab_with_which_px4_ends_is_left_out() -> None:
    assert Texts().on_message(part("Armed by external command\t"), 0.0) == [(4, "Armed by external command")]
    texts = Texts()
    assert texts.on_message(part("RTL: start return at 842 m (39 m above destination", 8, 0), 0.0) == []
    assert texts.on_message(part(")\t", 8, 1), 0.0) == [(4, "RTL: start return at 842 m (39 m above destination)")]


def test_parts_are_put_together_in_any_order() -> None:
    texts = Texts()
    first, middle, last = parts(7)
    assert texts.on_message(last, 0.0) == []
    assert texts.on_message(first, 0.0) == []
    assert texts.on_message(middle, 0.1) == [(4, LONG.strip())]
    assert texts.on_tick(99.0) == []


def test_two_texts_at_a_time_do_not_mix() -> None:
    texts = Texts()
    pairs = zip(parts(1), parts(2), strict=True)
    out = [text for a, b in pairs for message in (a, b) for text in texts.on_message(message, 0.0)]
    assert out == [(4, LONG.strip())] * 2


def test_a_text_whose_part_got_lost_is_given_out_all_the_same() -> None:
    texts = Texts()
    texts.on_message(parts(3)[0], 0.0)
    assert texts.on_tick(0.5) == []
    assert texts.on_tick(2.0) == [(4, LONG[:50].strip())]
    assert texts.on_tick(9.0) == []
