"""Only cameras, clicks and drags pass, whole and finite."""

from __future__ import annotations

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from server.scene.filter import ALLOWED, MESSAGE_LIMIT_BYTES, MessageFilter

CLICK = {
    "type": "ScenePointerMessage",
    "event_type": "click",
    "ray_origin": (0.0, 1, 2.5),
    "ray_direction": None,
    "screen_pos": ((0.5, 0.5),),
    "modifier": None,
}


def test_a_click_passes() -> None:
    assert MessageFilter().lets_through(msgspec.msgpack.encode(CLICK))


@given(st.binary(max_size=200))
def test_noise_passes_not_and_raises_not(raw: bytes) -> None:
    assert not MessageFilter().lets_through(raw)


@given(st.dictionaries(st.sampled_from(list(CLICK)), st.none() | st.text() | st.lists(st.integers(-100, 100))))
def test_a_twisted_click_passes_only_if_it_is_still_one(changes: dict) -> None:
    twisted = CLICK | changes
    passed = MessageFilter().lets_through(msgspec.msgpack.encode(twisted))
    assert not passed or twisted["type"] == "ScenePointerMessage"
    assert not passed or twisted["event_type"] == "click"


def test_what_is_too_big_or_infinite_stays_out() -> None:
    messages = MessageFilter()
    assert not messages.lets_through(None)
    assert not messages.lets_through(msgspec.msgpack.encode(CLICK | {"extra": b"x" * MESSAGE_LIMIT_BYTES}))
    assert not messages.lets_through(msgspec.msgpack.encode(CLICK | {"screen_pos": ((float("inf"), 0.0),)}))
    assert sum(messages.dropped.values()) == 3


def test_invented_names_do_not_pile_up() -> None:
    messages = MessageFilter()
    for number in range(1000):
        messages.lets_through(msgspec.msgpack.encode({"type": f"T{number}"}))
    assert len(messages.dropped) <= 51
    assert sum(messages.dropped.values()) == 1000


def test_nothing_that_presses_uploads_or_opens_tunnels_is_allowed() -> None:
    names = {message.__name__ for message in ALLOWED}
    assert not any(word in name for name in names for word in ("Gui", "Share", "File", "Command", "Javascript"))
