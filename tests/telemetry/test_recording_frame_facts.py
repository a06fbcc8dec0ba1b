"""What single frames tell."""

from __future__ import annotations

from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.recording.frame_facts import FrameFacts, decode_frame
from tests.telemetry.recordings import heartbeat


def frame(message: Any, source: tuple[int, int] = (1, 1)) -> Any:
    """A message as it comes from the wire."""
    decoder = mavlink.MAVLink(None)
    return decode_frame(decoder, bytes(message.pack(mavlink.MAVLink(None, *source))))


def text(content: bytes, number: int = 0, part: int = 0) -> Any:
    return frame(mavlink.MAVLink_statustext_message(4, content, number, part))


def sim_state(lat: float, lon: float, lat_int: int, lon_int: int) -> Any:
    values: list[Any] = [*[0.0] * 13, lat, lon, 100.0, *[0.0] * 5, lat_int, lon_int]
    return frame(mavlink.mavlink_map[108](*values))


def test_long_texts_are_put_together() -> None:
    facts = FrameFacts(1, 1)
    facts.on_message(text(b"x" * 50, number=7), 1.0)
    facts.on_message(text(b"short"), 1.2)
    facts.on_message(text(b"end", number=7, part=1), 1.5)
    facts.on_message(text(b"y" * 50, number=8), 4.0)
    assert [t.text for t in facts.texts()] == ["short", "x" * 50 + "end", "y" * 50]
    assert [t.t_utc_s for t in facts.texts()] == sorted(t.t_utc_s for t in facts.texts())


def test_bytes_that_are_no_text_do_no_harm() -> None:
    facts = FrameFacts(1, 1)
    facts.on_message(text(b"\xff\xfe ok"), 1.0)
    assert facts.texts()[0].text.endswith(" ok")


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((4.5e8, 1e8, 450_000_001, 100_000_001), (45.0000001, 10.0000001)),
        ((45.5, 10.5, 0, 0), (45.5, 10.5)),
        ((4.5e8, 1e8, 0, 0), None),
        ((0.0, 0.0, 0, 0), None),
    ],
)
def test_the_true_position(values: tuple[float, float, int, int], expected: tuple[float, float] | None) -> None:
    facts = FrameFacts(1, 1)
    facts.on_message(sim_state(*values), 1.0)
    found = [(place.lat_deg, place.lon_deg) for place in facts.truth]
    assert found == ([] if expected is None else [pytest.approx(expected, abs=1e-9)])


def target(mask: int, system: int = 1) -> Any:
    message = mavlink.MAVLink_set_position_target_global_int_message(
        0, system, 1, 6, mask, 450_000_000, 100_000_000, 12.5, *[0.0] * 8
    )
    return frame(message, (255, 190))


def test_only_positions_sent_to_the_vehicle_are_targets() -> None:
    facts = FrameFacts(1, 1)
    for message in (target(0b110111111000), target(0b110111000111), target(0b110111111000, system=9)):
        facts.on_message(message, 1.0)
    assert [(t.lat_deg, t.alt_m, t.frame) for t in facts.targets] == [(45.0, 12.5, 6)]


def test_reached_items_of_another_vehicle_do_not_count() -> None:
    facts = FrameFacts(1, 1)
    for source in ((1, 1), (2, 1)):
        facts.on_message(frame(mavlink.MAVLink_mission_item_reached_message(3), source), 1.0)
    assert facts.reached == [(1.0, 3)]


def test_damaged_and_unknown_frames_are_no_messages() -> None:
    decoder, good = mavlink.MAVLink(None), heartbeat(0)
    assert decode_frame(decoder, good) is not None
    assert decode_frame(decoder, good[:-1] + bytes([good[-1] ^ 1])) is None
    unknown = bytearray(good)
    unknown[7:10] = (60_000).to_bytes(3, "little")
    assert decode_frame(decoder, bytes(unknown)) is None
