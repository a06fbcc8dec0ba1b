"""Signing against pymavlink's own as the other side: what is proven, what is refused, and what outlives a crash."""

from __future__ import annotations

import os
import stat
import time
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import NotAllowedError, SilentError
from telemetry.link.peers import Source
from telemetry.link.signatures import KeyRing
from telemetry.mavlink.codec import Parser
from telemetry.mavlink.signing import COPY, EPOCH_S, FARTHEST, MOST_WAYS, PER_S, YOUNG, Signing, timestamp_of
from telemetry.simulation.simulator.run import SimOptions, flying
from telemetry.topics.messages import RawFrame
from telemetry.topics.requests import Arm, Connect, SetSigning
from tests.free_ports import free_port
from tests.telemetry.fake_vehicle import UdpVehicle, radio
from tests.telemetry.frames import attitude, heartbeat, packed
from tests.telemetry.link_bench import ME, console, until
from tests.telemetry.own_time import run

KEY = bytes(range(32))
NOW = timestamp_of(EPOCH_S + 400 * 86_400 * 10)
T_UTC_S = NOW / PER_S + EPOCH_S


def other_side(*, key: bytes = KEY, timestamp: int = NOW, link: int = 0, system: int = 1) -> mavlink.MAVLink:
    far = mavlink.MAVLink(None, srcSystem=system, srcComponent=1)
    far.signing.secret_key, far.signing.timestamp, far.signing.link_id = key, timestamp, link
    far.signing.sign_outgoing = True
    return far


def signed(far: mavlink.MAVLink, message: Any = None) -> bytes:
    return bytes((message or heartbeat()).pack(far))


def test_pymavlink_takes_what_is_signed_here_and_the_other_way_round() -> None:
    ours, theirs = Signing(KEY), other_side()
    for k in range(300):
        message = attitude(k) if k % 2 else heartbeat()
        assert ours.verify(signed(theirs, message), now=NOW) == "good"
        frame = ours.sign(packed(message, sequence=k % 256), link=3, now=NOW + k)
        assert theirs.decode(bytearray(frame)).get_type() == message.get_type()
        (found,) = Parser(datagrams=True).feed(frame)
        assert found.get_type() == message.get_type()


@pytest.mark.parametrize("at", [*range(1, 9), 12, -14, -13, -12, -7, -6, -1])
def test_a_frame_of_which_a_bit_is_another_is_wrong(at: int) -> None:
    frame = bytearray(signed(other_side(), attitude(12345)))
    frame[at] ^= 1 if at != 2 else 2
    assert Signing(KEY).verify(bytes(frame), now=NOW) == "wrong"


def test_a_thousand_replays_and_none_is_taken() -> None:
    ours, theirs = Signing(KEY), other_side()
    frames = [signed(theirs, attitude(k)) for k in range(1000)]
    assert [ours.verify(frame, now=NOW) for frame in frames] == ["good"] * 1000
    assert {ours.verify(frame, now=NOW) for frame in frames} == {"replayed"}


def test_a_forged_time_at_the_end_of_all_times_locks_nobody_out() -> None:
    ours, theirs = Signing(KEY), other_side()
    end = 2**48 - 1
    assert ours.verify(signed(other_side(key=bytes(32), timestamp=end)), now=NOW) == "wrong"
    assert ours.verify(signed(other_side(timestamp=end)), now=NOW) == "ahead"
    assert ours.verify(signed(other_side(timestamp=NOW + FARTHEST + 1)), now=NOW) == "ahead"
    assert ours.verify(signed(theirs), now=NOW) == "good"
    assert ours.newest < NOW + 1000


def test_clocks_that_jump() -> None:
    ours = Signing(KEY)
    first = ours.sign(packed(heartbeat()), link=0, now=NOW)
    back = ours.sign(packed(heartbeat()), link=0, now=0)
    assert back[-12:-6] > first[-12:-6] or int.from_bytes(back[-12:-6], "little") == NOW + 1
    assert ours.verify(signed(other_side(timestamp=NOW + 30 * 86_400 * PER_S)), now=0) == "good"
    assert ours.newest == NOW + 30 * 86_400 * PER_S
    old = other_side(timestamp=ours.newest - YOUNG - 2, system=2)
    assert ours.verify(signed(old), now=NOW) == "replayed"
    young = other_side(timestamp=ours.newest - YOUNG + 2, system=2)
    assert ours.verify(signed(young), now=NOW) == "good"


def test_two_links_have_streams_of_their_own() -> None:
    ours, one, two = Signing(KEY), other_side(link=0), other_side(link=1, timestamp=NOW + 50)
    later = [signed(two, attitude(k)) for k in range(20)]
    assert {ours.verify(frame, now=NOW) for frame in later} == {"good"}
    assert ours.verify(signed(one), now=NOW) == "good"
    assert ours.verify(later[-1], now=NOW) == "replayed"


def test_the_copy_over_a_second_way_is_good_once_and_not_late() -> None:
    ours, theirs = Signing(KEY), other_side()
    frames = [signed(theirs, attitude(k)) for k in range(100)]
    assert {ours.verify(frame, now=NOW, way="radio") for frame in frames} == {"good"}
    for way in ("wifi", "lte"):
        assert {ours.verify(frame, now=NOW, way=way) for frame in frames} == {"good"}
        assert {ours.verify(frame, now=NOW, way=way) for frame in frames} == {"replayed"}
    assert {ours.verify(frame, now=NOW, way="radio") for frame in frames} == {"replayed"}
    assert ours.verify(signed(other_side(timestamp=NOW + COPY + 200)), now=NOW, way="radio") == "good"
    assert ours.verify(frames[-1], now=NOW, way="another") == "replayed"


def test_long_after_the_newest_nothing_is_a_copy_whatever_the_vehicles_clock_says() -> None:
    ours, theirs = Signing(KEY), other_side()
    frames = [signed(theirs, attitude(k)) for k in range(20)]
    assert {ours.verify(frame, now=NOW, way="radio") for frame in frames} == {"good"}
    assert ours.verify(frames[5], now=NOW + COPY, way="wifi") == "good"
    assert ours.verify(frames[6], now=NOW + COPY + 1, way="wifi") == "replayed"
    assert ours.verify(frames[6], now=NOW - 1, way="wifi") == "replayed", "our clock was set back"
    assert ours.verify(signed(theirs), now=NOW + COPY + 1, way="wifi") == "good"


def test_copies_are_taken_from_so_many_at_once_and_from_the_next_when_those_are_old() -> None:
    ours, theirs = Signing(KEY), other_side()
    frames = [signed(theirs, attitude(k)) for k in range(3)]
    assert ours.verify(frames[2], now=NOW, way="radio") == "good"
    found = [ours.verify(frames[1], now=NOW, way=f"port {k}") for k in range(2 * MOST_WAYS)]
    assert found == ["good"] * (MOST_WAYS - 1) + ["replayed"] * (MOST_WAYS + 1)
    later = other_side(timestamp=NOW + COPY + 100)
    first, second = signed(later), signed(later)
    assert {ours.verify(frame, now=NOW, way="radio") for frame in (first, second)} == {"good"}
    assert ours.verify(first, now=NOW, way="wifi") == "good"


def test_what_another_sends_to_a_way_silences_nobody_there() -> None:
    async def whole() -> None:
        keys = KeyRing(None, clock=lambda: T_UTC_S)
        keyed = keys.new_key(1)
        keyed.mode = "on"
        theirs, parser = other_side(key=keyed.signing.key), Parser(datagrams=True)
        async with console(keys=keys) as bench:
            await bench.handle(Connect(ME, address := f"udpin:127.0.0.1:{free_port()}"))
            await bench.handle(Connect(ME, other := f"udpin:127.0.0.1:{free_port()}"))
            (message,) = parser.feed(signed(theirs))
            for at, peer in ((address, "10.0.0.2:1"), (other, "10.0.0.66:6"), (other, "10.0.0.2:2")):
                bench.link._heard(bench.link.lines[at], Source(at, peer, 1, 1), message)
            assert keyed.status.replayed == 0
            assert {candidate.peer for candidate in bench.link.peers.candidates(time.monotonic())} >= {"10.0.0.2:2"}

    run(whole)


def test_what_was_proven_before_a_restart_is_no_copy() -> None:
    before, theirs = Signing(KEY), other_side()
    frames = [signed(theirs, attitude(k)) for k in range(20)]
    assert {before.verify(frame, now=NOW, way="radio") for frame in frames} == {"good"}
    after = Signing(KEY, before.newest, dict(before.streams))
    assert {after.verify(frame, now=NOW, way="wifi") for frame in frames} == {"replayed"}
    assert after.verify(signed(theirs), now=NOW, way="wifi") == "good"


async def ring_with(file: Path) -> KeyRing:
    ring = KeyRing(file, clock=lambda: T_UTC_S)
    ring.new_key(1)
    await ring.save()
    return ring


def judged(ring: KeyRing, frame: bytes, number: int = 0) -> str:
    return ring.judge(1, number, frame, 0.0)


def test_after_a_crash_nothing_is_taken_twice_and_no_time_is_used_twice(tmp_path: Path) -> None:
    async def whole() -> None:
        file = tmp_path / "keys" / "signing.json"
        ring = await ring_with(file)
        keyed = ring.of(1)
        assert keyed is not None
        theirs = other_side(key=keyed.signing.key)
        frames = [signed(theirs, attitude(k)) for k in range(1000)]
        assert judged(ring, frames[0]) == "good"
        await ring.save()  # and from here on nothing is saved any more
        assert {judged(ring, frame) for frame in frames[1:]} == {"good"}
        sent = [ring.seal(1, packed(heartbeat()), 0) for _ in range(100)]
        again = KeyRing(file, clock=lambda: 0.0)  # its clock has gone, too
        assert {judged(again, frame) for frame in frames} == {"replayed"}
        new = again.seal(1, packed(heartbeat()), 0)
        assert int.from_bytes(new[-12:-6], "little") > int.from_bytes(sent[-1][-12:-6], "little")
        theirs.decode(bytearray(new))  # the vehicle hears it, and its time follows
        assert judged(again, signed(theirs)) == "good"

    run(whole)


def test_keys_are_for_nobody_else_and_a_broken_file_is_said(tmp_path: Path) -> None:
    async def whole() -> None:
        file = tmp_path / "keys" / "signing.json"
        before = os.umask(0)
        try:
            await ring_with(file)
        finally:
            os.umask(before)
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert stat.S_IMODE(file.parent.stat().st_mode) == 0o700
        file.write_text("[{")
        assert "cannot be read" in KeyRing(file).warnings(None, 0.0)[0]

    run(whole)


def test_what_passes_before_during_and_after_signing(tmp_path: Path) -> None:
    async def whole() -> None:
        ring = KeyRing(None, clock=lambda: T_UTC_S)
        plain = packed(heartbeat())
        assert judged(ring, plain) == "good"
        keyed = ring.new_key(1)
        assert judged(ring, plain) == "good"
        assert judged(ring, signed(other_side(key=keyed.signing.key))) == "good"
        assert keyed.mode == "on"
        assert judged(ring, plain) == "unsigned"
        assert judged(ring, plain, mavlink.MAVLINK_MSG_ID_RADIO_STATUS) == "good"
        assert judged(ring, signed(other_side())) == "wrong"
        assert ring.judge(2, 0, plain, 0.0) == "good"
        assert (keyed.status.unsigned, keyed.status.wrong) == (1, 1)
        assert "refused" in ring.warnings(1, 0.0)[0]
        keyed.mode = "let"
        assert judged(ring, plain) == "good"
        assert judged(ring, signed(other_side())) == "good"

    run(whole)


def test_a_vehicle_is_given_a_key_signs_and_keeps_signing_over_a_restart_of_the_link(tmp_path: Path) -> None:
    file = tmp_path / "keys" / "signing.json"

    async def whole() -> None:
        port = free_port()
        options = SimOptions(47.0, 8.0, 500.0, link=f"udpout:127.0.0.1:{port}", boot_s=0.5)
        async with flying(options) as simulator:
            async with console(keys=KeyRing(file)) as bench:
                await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", True))
                await bench.live()
                assert bench.status.signing.mode == "off"
                await bench.handle(SetSigning(ME, True))
                assert bench.status.signing.mode == "on"
                captured = bench.published
                key = KeyRing(file).of(1)
                assert key is not None
                assert not any(key.signing.key in one.frame for _, one in captured if isinstance(one, RawFrame))
                first = len(bench.frames(sent=False))
                await until(lambda: len(bench.frames(sent=False)) > first + 50)
                assert all(frame[2] & 1 for frame in bench.frames(sent=False)[first:])
                forger = UdpVehicle(port)
                before = bench.status.signing.unsigned
                forger.send(heartbeat())
                for frame in bench.frames(sent=False)[-20:]:
                    forger.send_bytes(frame)
                await until(lambda: bench.status.signing.unsigned > before)
                await until(lambda: bench.status.signing.replayed >= 20)
                assert bench.status.candidates == ()
                forger.close()
                await until(lambda: bench.state.ready_to_arm)
            async with console(keys=KeyRing(file)) as bench:
                await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", True))
                await bench.live()
                await until(lambda: bench.state.ready_to_arm)
                assert bench.status.signing.mode == "on"
                await bench.handle(Arm(ME))
                await until(lambda: bench.state.armed)
                with pytest.raises(NotAllowedError, match="on the ground only"):
                    await bench.handle(SetSigning(ME, True))
                await until(lambda: not simulator.vehicle.autopilot.armed)
                await bench.handle(SetSigning(ME, False))
                assert bench.status.signing.mode == "let"
                await until(lambda: not bench.frames(sent=False)[-1][2] & 1)
                await bench.live()

    run(whole)


def test_a_vehicle_that_does_not_sign_is_said_and_goes_on_unsigned() -> None:
    async def whole() -> None:
        port = free_port()
        async with console() as bench:
            await bench.handle(Connect(ME, f"udpin:127.0.0.1:{port}", True))
            async with radio(port):
                await bench.live()
                with pytest.raises(SilentError, match="has not begun to sign"):
                    await bench.handle(SetSigning(ME, True))
                assert bench.status.signing.mode == "asked"
                assert bench.status.state == "live"

    run(whole)
