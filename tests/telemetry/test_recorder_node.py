"""The recorder node as a process: it records what comes over the bus and outlives servers."""

from __future__ import annotations

import asyncio
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from telemetry.bus.bus import Bus
from telemetry.nodes.recorder import mend_all
from telemetry.recording.flight_log import read_flight_log
from telemetry.topics.messages import RawFrame, RecorderStatus, ServerAlive, Topic
from telemetry.topics.recording_requests import StartRecording, StopRecording
from tests.telemetry.recordings import PLAN, heartbeat, state_at, write_flight

PATIENCE_S = 90.0


@contextmanager
def recorder_node(tmp_path: Path) -> Iterator[subprocess.Popen[bytes]]:
    command = [sys.executable, "-m", "telemetry.nodes.recorder", "--runtime", str(tmp_path / "run")]
    command += ["--recordings", str(tmp_path / "recordings")]
    with subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True) as process:
        try:
            yield process
        finally:
            process.kill()
            process.communicate(timeout=PATIENCE_S)


async def status_until(bus: Bus, condition: Callable[[RecorderStatus], bool]) -> RecorderStatus:
    subscription = bus.subscribe(Topic.RECORDER)
    try:
        async with asyncio.timeout(PATIENCE_S):
            async for _, message in subscription:
                if isinstance(message, RecorderStatus) and condition(message):
                    return message
    finally:
        subscription.close()
    raise AssertionError("the bus was closed")


async def publish_until(bus: Bus, armed: bool, condition: Callable[[RecorderStatus], bool]) -> RecorderStatus:
    """A flight at 50 Hz until the recorder says what is waited for."""
    waiting = asyncio.ensure_future(status_until(bus, condition))
    begin_s = time.monotonic()
    try:
        while not waiting.done():
            t_s = time.monotonic() - begin_s
            bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), 1))
            bus.publish(Topic.RAW, RawFrame(time.time(), False, "udp", heartbeat(0)))
            bus.publish(Topic.VEHICLE, state_at(t_s, armed=armed))
            await asyncio.sleep(0.02)
        return waiting.result()
    finally:
        waiting.cancel()


def test_a_flight_is_recorded_and_kept_when_the_node_is_killed(tmp_path: Path) -> None:
    async def fly() -> str:
        async with await Bus.open(tmp_path / "run", "link") as bus:
            bus.publish(Topic.PLAN, PLAN)
            await publish_until(bus, False, lambda status: not status.recording)
            status = await publish_until(bus, True, lambda status: status.messages > 100)
            assert status.recording
            assert status.free_bytes is not None
            assert status.name is not None
            return status.name

    with recorder_node(tmp_path) as process:
        name = asyncio.run(fly())
        process.send_signal(signal.SIGKILL)
    path = tmp_path / "recordings" / name
    log = read_flight_log(path)
    assert log.plan == PLAN
    assert any(armed for _, armed in log.armed)
    assert len(log.faults) == 1
    mend_all(path.parent)
    mended = read_flight_log(path)
    assert mended.faults == ()
    assert mended.states == log.states


def test_a_recorder_that_is_started_again_goes_on_with_the_flight_in_the_same_file(tmp_path: Path) -> None:
    async def fly(messages: int) -> str:
        async with await Bus.open(tmp_path / "run", "link") as bus:
            status = await publish_until(bus, True, lambda status: status.messages > messages)
            assert status.name is not None
            return status.name

    async def plan() -> None:
        async with await Bus.open(tmp_path / "run", "server") as bus:
            waiting = asyncio.ensure_future(status_until(bus, lambda status: True))
            while not waiting.done():
                bus.publish(Topic.PLAN, PLAN)
                await asyncio.sleep(0.02)

    with recorder_node(tmp_path) as process:
        asyncio.run(plan())
        name = asyncio.run(fly(100))
        process.send_signal(signal.SIGKILL)
        process.wait(PATIENCE_S)
    before = read_flight_log(tmp_path / "recordings" / name)
    with recorder_node(tmp_path) as process:
        assert asyncio.run(fly(50)) == name
        process.terminate()
        assert process.wait(timeout=PATIENCE_S) == 0
    assert [path.name for path in (tmp_path / "recordings").iterdir()] == [name]
    log = read_flight_log(tmp_path / "recordings" / name)
    assert log.plan == PLAN
    assert log.states[: len(before.states)] == before.states
    assert len(log.states) > len(before.states)
    (gap,) = log.faults
    assert re.fullmatch(r"Nothing was recorded for \d+\.\d s from .* UTC: the recorder had died and was .*", gap)


def test_by_hand_and_through_the_death_of_a_server(tmp_path: Path) -> None:
    """The first server starts the recording and goes; the second finds it running and stops it."""

    async def start() -> str:
        async with await Bus.open(tmp_path / "run", "server") as server:
            name = await server.call("recorder", StartRecording("bench"), result=str, timeout_s=PATIENCE_S)
            await publish_until(server, False, lambda status: status.messages > 20)
            return name

    async def stop() -> RecorderStatus:
        async with await Bus.open(tmp_path / "run", "server") as server:
            status = await status_until(server, lambda status: status.recording)
            await server.call("recorder", StopRecording(), result=type(None), timeout_s=PATIENCE_S)
            await status_until(server, lambda status: not status.recording)
            return status

    with recorder_node(tmp_path) as process:
        name = asyncio.run(start())
        assert asyncio.run(stop()).name == name
        assert process.poll() is None
    assert "_bench" in name
    log = read_flight_log(tmp_path / "recordings" / name)
    assert log.faults == ()
    assert len(log.track) > 10


def test_asked_to_end_it_finishes_the_recording(tmp_path: Path) -> None:
    async def start() -> str:
        async with await Bus.open(tmp_path / "run", "server") as server:
            name = await server.call("recorder", StartRecording(), result=str, timeout_s=PATIENCE_S)
            await publish_until(server, False, lambda status: status.messages > 20)
            return name

    with recorder_node(tmp_path) as process:
        name = asyncio.run(start())
        process.terminate()
        assert process.wait(timeout=PATIENCE_S) == 0
    assert read_flight_log(tmp_path / "recordings" / name).faults == ()


def test_only_what_can_be_mended_is_touched(tmp_path: Path) -> None:
    killed = write_flight(tmp_path / "killed.mcap", finish=False, seconds=2)
    (tmp_path / "foreign.mcap").write_text("hello")
    (tmp_path / "cut.mcap").write_bytes(killed.read_bytes()[:500])
    mend_all(tmp_path)
    assert read_flight_log(killed).faults == ()
    assert (tmp_path / "foreign.mcap").read_text() == "hello"
    assert (tmp_path / "cut.mcap").stat().st_size == 500
