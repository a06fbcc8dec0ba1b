"""Bytes to messages: nothing genuine is lost among noise, no exception leaves, memory stays bounded."""

import random
import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.codec import Packer, Parser
from tests.telemetry.frames import attitude, packed

NOISE = st.binary(max_size=40).map(lambda data: data.replace(b"\xfd", b"?").replace(b"\xfe", b"?"))


def boot_times(messages: list) -> list[int]:
    return [message.time_boot_ms for message in messages]


@pytest.mark.fact("A27")
@given(gaps=st.lists(NOISE, min_size=1, max_size=8), cut=st.integers(1, 60))
def test_a_stream_gives_back_every_message_among_text_however_it_is_cut(gaps: list[bytes], cut: int) -> None:
    data = b"".join(gap + packed(attitude(k)) for k, gap in enumerate(gaps))
    parser = Parser(datagrams=False)
    found = [message for at in range(0, len(data), cut) for message in parser.feed(data[at : at + cut])]
    assert boot_times(found) == list(range(len(gaps)))
    assert parser.bad_bytes == sum(map(len, gaps))


@given(junk=st.binary(max_size=300), cut=st.integers(1, 400))
def test_no_noise_raises_or_swallows_what_follows_for_good(junk: bytes, cut: int) -> None:
    """A start byte in the noise may announce a long frame: once as much has come, all behind it is found."""
    genuine = [packed(attitude(k), sequence=k % 256) for k in range(40)]
    data = junk + b"".join(genuine)
    parser = Parser(datagrams=False)
    found = [message for at in range(0, len(data), cut) for message in parser.feed(data[at : at + cut])]
    found += parser.feed(b"\0" * 300)
    times = [message.time_boot_ms for message in found if message.get_type() == "ATTITUDE"]
    assert [t for t in times if t < 40][-40:] == list(range(40))


@given(strays=st.lists(st.binary(min_size=1, max_size=3), min_size=1, max_size=30))
def test_stray_datagrams_cost_and_delay_nothing(strays: list[bytes]) -> None:
    parser = Parser(datagrams=True)
    for k, stray in enumerate([*strays, b"\xfd\xff\x00"]):
        parser.feed(stray)
        assert boot_times(parser.feed(packed(attitude(k)))) == [k]


def test_a_frame_in_two_datagrams_is_put_together() -> None:
    parser, frame = Parser(datagrams=True), packed(attitude(7))
    assert parser.feed(frame[:11]) == []
    assert boot_times(parser.feed(frame[11:] + packed(attitude(8)))) == [7, 8]
    assert parser.bad_bytes == 0


def test_a_frame_that_was_cut_off_does_not_spoil_the_next() -> None:
    parser = Parser(datagrams=True)
    parser.feed(packed(attitude(1))[:20])
    assert boot_times(parser.feed(packed(attitude(2)))) == [2]
    assert parser.bad_bytes == 20


def test_a_flipped_bit_costs_one_message() -> None:
    frames = [bytearray(packed(attitude(k))) for k in range(5)]
    frames[2][15] ^= 0x10
    parser = Parser(datagrams=False)
    found = parser.feed(b"".join(frames))
    found += parser.feed(b"\0" * 300)  # its checksum may look like the start of another, which is waited for
    assert boot_times(found) == [0, 1, 3, 4]


@pytest.mark.fact("P17")
def test_frames_of_another_dialect_are_stepped_over() -> None:
    foreign = bytearray(packed(attitude(0)))
    foreign[7:10] = (0xABCDEF).to_bytes(3, "little")
    parser = Parser(datagrams=False)
    assert boot_times(parser.feed(bytes(foreign) + packed(attitude(1)))) == [1]


def test_old_and_signed_frames_are_read() -> None:
    codec = mavlink.MAVLink(None, 1, 1)
    old = bytes(attitude(1).pack(codec, force_mavlink1=True))
    codec.signing.secret_key, codec.signing.sign_outgoing = b"k" * 32, True
    signed = bytes(attitude(2).pack(codec))
    parser = Parser(datagrams=False)
    assert boot_times(parser.feed(old + signed)) == [1, 2]
    assert parser.bad_bytes == 0


@pytest.mark.parametrize("datagrams", [True, False])
def test_invented_message_ids_cost_no_memory(datagrams: bool) -> None:
    noise = random.Random(1)
    parser = Parser(datagrams=datagrams)
    frame = bytearray(packed(attitude(0)))
    tracemalloc.start()
    for _ in range(20_000):
        frame[7:10] = noise.randbytes(3)
        parser.feed(bytes(frame))
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert grown < 1_000_000


def test_sent_frames_are_a_ground_stations_and_counted() -> None:
    packer, parser = Packer(), Parser(datagrams=False)
    found = parser.feed(b"".join(packer.pack(attitude(k)) for k in range(300)))
    assert {(m.get_srcSystem(), m.get_srcComponent()) for m in found} == {(255, 190)}
    assert [m.get_seq() for m in found] == [k % 256 for k in range(300)]
