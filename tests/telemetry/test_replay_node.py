"""The replay node: what it publishes and what it never does."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest

from telemetry.bus.bus import Bus
from telemetry.bus.node import NodeContext
from telemetry.bus.node_lock import NodeLock
from telemetry.errors import RecordingError
from telemetry.nodes.replay import Replayer, live
from telemetry.recording.replay_sources import ReplaySource, open_source
from telemetry.topics.messages import REPLAY_PREFIX, Published, ReplayStatus, ServerAlive, Topic
from telemetry.topics.recording_requests import CloseRecording, OpenRecording, Play, ReplayRequest
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.recordings import T0_UTC_S, write_flight

PATIENCE_S = 60.0


class Spy:
    """Takes the place of the bus."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, Published]] = []

    def publish(self, topic: str, message: Published) -> None:
        self.sent.append((str(topic), message))

    @property
    def status(self) -> ReplayStatus:
        return next(m for _, m in reversed(self.sent) if isinstance(m, ReplayStatus))

    def states(self) -> list[VehicleState]:
        return [m for _, m in self.sent if isinstance(m, VehicleState)]


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not condition():
            await asyncio.sleep(0.01)


def replayed(tmp_path: Path, act: Callable[[Replayer, Spy], Awaitable[None]]) -> Spy:
    """Runs a replayer on a spy while ``act`` asks things of it."""
    spy = Spy()

    async def run() -> None:
        replayer = Replayer(spy.publish)
        context = NodeContext(NodeLock(tmp_path, "replay", []))
        async with asyncio.TaskGroup() as group:
            running = group.create_task(replayer.run(context))
            try:
                await act(replayer, spy)
            finally:
                running.cancel()

    asyncio.run(run())
    return spy


def test_a_whole_recording_is_played_behind_replay_and_nowhere_else(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "a.mcap")

    async def act(replayer: Replayer, spy: Spy) -> None:
        await replayer.handle(OpenRecording(str(path)))
        assert spy.status.recording == "a.mcap"
        assert len(spy.states()) == 1
        await replayer.handle(Play(True, speed=50.0))
        assert spy.status.playing
        await until(lambda: not spy.status.playing)

    spy = replayed(tmp_path, act)
    assert {topic for topic, _ in spy.sent if not topic.startswith(REPLAY_PREFIX)} == {Topic.REPLAY}
    assert {topic.removeprefix(REPLAY_PREFIX) for topic, _ in spy.sent} >= {
        Topic.VEHICLE,
        Topic.TEXT,
        Topic.PLAN,
        Topic.FLIGHT,
        Topic.LINK,
    }
    assert spy.status.at_utc_s == pytest.approx(T0_UTC_S + 20)
    assert spy.states()[-1].lat_deg == pytest.approx(45.0 + 20e-5, abs=1e-9)


def test_seek_pause_and_close(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "a.mcap", finish=False)

    async def act(replayer: Replayer, spy: Spy) -> None:
        await replayer.handle(OpenRecording(str(path)))
        spy.sent.clear()
        await replayer.handle(Play(False, at_utc_s=T0_UTC_S + 12.34))
        assert spy.states()[-1].lat_deg == pytest.approx(45.0 + 12.3e-5, abs=1e-9)
        assert spy.status.at_utc_s == pytest.approx(T0_UTC_S + 12.34)
        await replayer.handle(CloseRecording())
        assert spy.status.recording is None
        with pytest.raises(RecordingError, match="No recording is open"):
            await replayer.handle(Play(True))

    replayed(tmp_path, act)


def test_while_playing_the_status_comes_often(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "a.mcap")

    async def act(replayer: Replayer, spy: Spy) -> None:
        await replayer.handle(OpenRecording(str(path)))
        await replayer.handle(Play(True))
        await until(lambda: len({m.at_utc_s for _, m in spy.sent if isinstance(m, ReplayStatus)}) >= 4)
        assert spy.status.at_utc_s < T0_UTC_S + 20

    replayed(tmp_path, act)


def test_another_file_takes_the_place_of_the_first(tmp_path: Path) -> None:
    paths = [write_flight(tmp_path / name) for name in ("a.mcap", "b.mcap")]

    async def act(replayer: Replayer, spy: Spy) -> None:
        for path in paths:
            await replayer.handle(OpenRecording(str(path)))
            await replayer.handle(Play(True))
            assert spy.status.recording == path.name

    replayed(tmp_path, act)


def test_a_file_that_takes_long_is_opened_once_however_often_it_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, may_open, asked = write_flight(tmp_path / "a.mcap"), threading.Event(), []

    def open_slowly(path: Path, *, raw: bool) -> ReplaySource:
        asked.append(path)
        assert may_open.wait(PATIENCE_S)
        return open_source(path, raw=raw)

    monkeypatch.setattr("telemetry.nodes.replay.open_source", open_slowly)
    monkeypatch.setattr("telemetry.nodes.replay._PATIENCE_S", 0.01)

    async def act(replayer: Replayer, spy: Spy) -> None:
        for _ in range(3):
            await replayer.handle(OpenRecording(str(path)))
        with pytest.raises(RecordingError, match="still being opened"):
            await replayer.handle(Play(True))
        may_open.set()
        await until(lambda: spy.status.recording == "a.mcap")

    replayed(tmp_path, act)
    assert asked == [path]


def test_what_cannot_be_opened_is_answered_and_shown(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("hello")

    async def act(replayer: Replayer, spy: Spy) -> None:
        with pytest.raises(RecordingError, match="text"):
            await replayer.handle(OpenRecording(str(tmp_path / "a.mcap")))
        assert spy.status.error is not None
        assert "text" in spy.status.error.what
        await replayer.handle(OpenRecording(str(write_flight(tmp_path / "b.mcap", seconds=1))))
        assert spy.status.error is None

    replayed(tmp_path, act)


def test_on_the_real_bus(tmp_path: Path) -> None:
    """A server asks, plays and reads; nothing at all comes under a live name but the replay's status."""
    path = write_flight(tmp_path / "a.mcap", seconds=5)
    runtime = tmp_path / "run"

    async def ask(server: Bus, request: ReplayRequest) -> None:
        await server.call("replay", request, result=type(None), timeout_s=PATIENCE_S)

    async def run() -> set[str]:
        topics = set[str]()
        async with await Bus.open(runtime, "server") as server, await Bus.open(runtime, "replay") as bus:
            context = NodeContext(NodeLock(runtime, "replay", []))
            context.note_server(ServerAlive(time.monotonic(), 1))
            everything = server.subscribe("**", keep_all=True)
            async with asyncio.TaskGroup() as group:
                node = group.create_task(live(bus, context))
                await ask(server, OpenRecording(str(path)))
                await ask(server, Play(True, speed=10.0))
                async with asyncio.timeout(PATIENCE_S):
                    async for topic, message in everything:
                        topics.add(str(topic))
                        if isinstance(message, ReplayStatus) and message.at_utc_s > T0_UTC_S + 4.999:
                            break
                node.cancel()
        return topics

    topics = asyncio.run(run())
    assert Topic.REPLAY in topics
    assert REPLAY_PREFIX + Topic.VEHICLE in topics
    assert all(topic.startswith(REPLAY_PREFIX) or topic == Topic.REPLAY for topic in topics)
