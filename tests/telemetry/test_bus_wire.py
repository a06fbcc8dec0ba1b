"""Every message of the table crosses the wire unharmed, and broken ones are refused in words."""

import math
from collections.abc import Callable
from typing import Any

import msgspec
import pytest
from hypothesis import given, reject
from hypothesis import strategies as st

from telemetry.bus.encoding import decode_message, decode_request, encode_message, encode_request
from telemetry.errors import BusError
from telemetry.topics.messages import MESSAGE_TYPES, Published, Topic
from telemetry.topics.recording_requests import OpenRecording, Play, ReplayRequest
from telemetry.topics.requests import LinkRequest
from telemetry.topics.vehicle import VehicleState


def same_after(encode: Callable[[Any], bytes], decode: Callable[[bytes], Any], value: Any) -> bool:
    """Compares what is written, because a NaN equals nothing. Numbers of more than 64 bits are no case."""
    try:
        written = encode(value)
    except OverflowError:
        reject()
    return type(decode(written)) is type(value) and encode(decode(written)) == written


@pytest.mark.parametrize("topic", sorted(MESSAGE_TYPES))
@given(prefix=st.sampled_from(["", "replay/"]), data=st.data())
def test_every_message_crosses_unharmed(topic: str, prefix: str, data: st.DataObject) -> None:
    message: Published = data.draw(st.from_type(MESSAGE_TYPES[topic]))
    name = prefix + topic
    assert same_after(lambda value: encode_message(name, value), lambda wire: decode_message(name, wire), message)


@given(st.from_type(LinkRequest))  # type: ignore[arg-type]
def test_every_request_to_the_link_crosses_unharmed(request: object) -> None:
    assert same_after(encode_request, lambda wire: decode_request(wire, LinkRequest), request)


def is_map(data: bytes) -> bool:
    """What a message without required fields may be read from: its names need not be known."""
    try:
        return isinstance(msgspec.msgpack.decode(data), dict)
    except (msgspec.MsgspecError, TypeError, ValueError):
        return False


@given(st.binary(max_size=200).filter(lambda data: not is_map(data)))
def test_noise_is_refused_in_words(noise: bytes) -> None:
    for topic in MESSAGE_TYPES:
        with pytest.raises(BusError):
            decode_message(topic, noise)
    with pytest.raises(BusError):
        decode_request(noise, LinkRequest)


def test_not_a_number_and_infinity_pass() -> None:
    state = VehicleState(1, 1, lat_deg=math.nan, alt_amsl_m=math.inf)
    found = decode_message(Topic.VEHICLE, encode_message(Topic.VEHICLE, state))
    assert isinstance(found, VehicleState)
    assert found.lat_deg is not None
    assert math.isnan(found.lat_deg)
    assert found.alt_amsl_m == math.inf


def test_a_request_is_told_by_its_name() -> None:
    assert decode_request(encode_request(Play(True)), ReplayRequest) == Play(True)
    assert decode_request(encode_request(Play(True)), Play) == Play(True)
    with pytest.raises(BusError, match="'OpenRecording' is not understood"):
        decode_request(encode_request(OpenRecording("a")), Play)


def test_a_message_of_a_later_version_is_read_as_far_as_it_is_known() -> None:
    later = msgspec.msgpack.encode({"system_id": 1, "component_id": 2, "rotors": 3})
    assert decode_message(Topic.VEHICLE, later) == VehicleState(1, 2)
