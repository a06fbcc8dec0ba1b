"""What a vehicle says of its own parameters: found by mftp only, checked, bounded, and read over real sockets."""

from __future__ import annotations

import asyncio
import gzip
import json
import lzma
import zlib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from planning.errors import FormatError
from telemetry.errors import RefusedError, SilentError
from telemetry.mavlink.actions import Failed, ended
from telemetry.mavlink.parameters.metadata import ASK_AGAIN_S, TRIES, MetadataAsk
from telemetry.parameters.described import read_descriptions, unpacked
from telemetry.parameters.vehicle_metadata import check_crc, mavlink_crc32, parameter_file, path_of
from telemetry.topics.requests import Connect, ReadMetadata
from tests.telemetry.frames import heard
from tests.telemetry.link_bench import ME, console
from tests.telemetry.simulator_process import simulated_vehicle


def crc_bit_by_bit(content: bytes) -> int:
    """The slow way: polynomial 0x04C11DB7 reflected, from 0 on, not inverted."""
    crc = 0
    for byte in content:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    return crc


def general(*entries: Any) -> bytes:
    return json.dumps({"version": 1, "metadataTypes": entries}).encode()


@given(st.binary(max_size=60))
def test_the_crc_is_that_of_mavlink(content: bytes) -> None:
    assert mavlink_crc32(content) == crc_bit_by_bit(content)


@given(st.binary(min_size=1, max_size=60), st.sampled_from([bytes, gzip.compress, lzma.compress]), st.integers(0, 400))
def test_a_file_that_was_damaged_is_refused(content: bytes, pack: Any, bit: int) -> None:
    packed = pack(b"{" + content)
    for announced in (zlib.crc32(packed), mavlink_crc32(packed), zlib.crc32(b"{" + content), None):
        check_crc("f", packed, announced)
    spoilt = bytearray(packed)
    spoilt[bit % len(packed)] ^= 1 << bit % 8
    with pytest.raises(FormatError):
        check_crc("f", bytes(spoilt), zlib.crc32(packed))


@pytest.mark.parametrize("uri", ["mftp:///etc/a.json.xz", "mftp://etc/a.json.xz", "mftp://[;comp=1]/etc/a.json.xz"])
def test_a_file_on_the_autopilot_is_found(uri: str) -> None:
    assert path_of(uri) == "/etc/a.json.xz"


@pytest.mark.parametrize(
    ("uri", "says"),
    [
        ("https://example.org/a.json", "never looks"),
        ("http://example.org/a.json", "never looks"),
        ("mftp://[;comp=100]/a.json", "no address"),
        ("mftp:///etc/../secret", "no address"),
        ("file:///etc/passwd", "no address"),
        ("", "no address"),
    ],
)
def test_no_other_address_is_followed(uri: str, says: str) -> None:
    with pytest.raises(FormatError, match=says):
        path_of(uri)


def test_the_file_of_parameters_is_named_in_the_general_one() -> None:
    events, parameters = {"type": 4, "uri": "mftp:///e"}, {"type": 1, "uri": "mftp:///p", "fileCrc": 7}
    assert parameter_file(lzma.compress(general(events, parameters))) == ("mftp:///p", 7)
    assert parameter_file(general({"type": 1, "uri": "mftp:///p"})) == ("mftp:///p", None)
    for wrong in (general(events), general(1, {"type": 1, "uri": 5}), b"[]", b"{", b"[" * 5000, b"\xfd7zXZ\x00damaged"):
        with pytest.raises(FormatError):
            parameter_file(wrong)


def test_what_unpacks_to_too_much_or_is_cut_short_is_refused() -> None:
    for pack in (gzip.compress, lzma.compress):
        with pytest.raises(FormatError, match="unpacks to more than"):
            unpacked("f", pack(bytes(21 << 20)))
        with pytest.raises(FormatError, match="cut short"):
            unpacked("f", pack(bytes(1000))[:-10])


def test_a_vehicle_that_refuses_or_is_silent_is_told_apart() -> None:
    refuses = MetadataAsk(target=(1, 1))
    refuses.start(0.0)
    ack = heard(mavlink.MAVLink_command_ack_message(512, 3, 0, 0, 255, 190))
    assert refuses.on_message(ack, 0.1) == []
    assert ended(refuses.on_tick(ASK_AGAIN_S + 0.1)) is None, "it may have been about another message"
    assert refuses.on_message(ack, ASK_AGAIN_S + 0.2) == []
    end = ended(refuses.on_tick(2 * ASK_AGAIN_S + 0.2))
    assert isinstance(end, Failed)
    assert isinstance(end.error, RefusedError)
    silent = MetadataAsk(target=(1, 1))
    actions = silent.start(0.0)
    for step in range(1, TRIES + 2):
        actions += silent.on_tick(step * (ASK_AGAIN_S + 0.01))
    end = ended(actions)
    assert isinstance(end, Failed)
    assert isinstance(end.error, SilentError)
    assert len(actions) == TRIES + 1


def test_the_simulated_px4_describes_itself_and_is_not_read_twice(tmp_path: Path) -> None:
    async def run(port: int) -> None:
        async with console() as bench:
            await bench.handle(Connect(ME, f"tcp:127.0.0.1:{port}", True))
            await bench.live()
            found = await bench.handle(ReadMetadata())
            about = read_descriptions("parameters.json.xz", found.content)["MPC_XY_CRUISE"]
            assert (about.unit, about.low, about.high, about.default) == ("m/s", 3.0, 20.0, 5.0)
            assert (await bench.handle(ReadMetadata((found.crc,)))).content == b""

    with simulated_vehicle(tmp_path, "--boot-s", "0.5", "--autopilot", "px4") as (_, port):
        asyncio.run(run(port))


def test_an_arducopter_says_that_it_has_none(tmp_path: Path) -> None:
    async def run(port: int) -> None:
        async with console() as bench:
            await bench.handle(Connect(ME, f"tcp:127.0.0.1:{port}", True))
            await bench.live()
            with pytest.raises(RefusedError, match="no description of itself"):
                await bench.handle(ReadMetadata())

    with simulated_vehicle(tmp_path, "--boot-s", "0.5") as (_, port):
        asyncio.run(run(port))
