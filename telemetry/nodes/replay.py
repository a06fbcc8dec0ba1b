"""The replay node: ``python -m telemetry.nodes.replay --runtime DIR``.

It publishes what a recording holds behind ``replay/`` and its own status, nothing else.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from telemetry.bus.bus import Bus
from telemetry.bus.node import NodeContext, run_node
from telemetry.errors import RecordingError
from telemetry.recording.player import STATUS_EVERY_S, Due, Player
from telemetry.recording.replay_sources import ReplaySource, open_source
from telemetry.topics.messages import REPLAY_PREFIX, ErrorInfo, Published, ReplayStatus, Topic
from telemetry.topics.recording_requests import CloseRecording, OpenRecording, Play, ReplayRequest

_IDLE_STATUS_EVERY_S = 1.0
_PATIENCE_S = 3.0
"""How long a caller waits for a file to open; after that the status tells how it went."""
_LONGEST_STRETCH = 500
"""Messages published in a row before the event loop gets its turn."""


class Replayer:
    """Answers requests and plays; ``publish`` takes topic and message."""

    def __init__(self, publish: Callable[[str, Published], None], *, raw: bool = False) -> None:
        self._publish, self._raw = publish, raw
        self._player: Player | None = None
        self._opening: asyncio.Task[ReplaySource] | None = None
        self._path = Path()
        """Of what is being opened, or was last."""
        self._error: ErrorInfo | None = None
        self._changed = asyncio.Event()
        self._turn = asyncio.Lock()
        """Held while messages go out, so that those of one moment never mix with those of another."""
        self._status_s = 0.0

    async def run(self, context: NodeContext) -> None:
        """Until there has been no server for long."""
        try:
            while context.is_needed():
                await self._step()
        finally:
            async with self._turn:
                self._close()

    async def _step(self) -> None:
        now_s, player = time.monotonic(), self._player
        if player is not None:
            async with self._turn:
                was_playing = player.playing
                await self._give(player.on_tick(now_s))
            if was_playing and not player.playing:
                self._tell()
        every_s = STATUS_EVERY_S if player is not None and player.playing else _IDLE_STATUS_EVERY_S
        if now_s - self._status_s >= every_s:
            self._tell()
        self._changed.clear()
        try:
            async with asyncio.timeout(STATUS_EVERY_S if player is None else player.wait_s()):
                await self._changed.wait()
        except TimeoutError:
            return

    async def handle(self, request: ReplayRequest) -> None:
        """Raises RecordingError."""
        self._error = None
        if isinstance(request, OpenRecording):
            await self._open(Path(request.path))
        elif isinstance(request, CloseRecording):
            async with self._turn:
                self._close()
        else:
            async with self._turn:
                await self._play(self._opened(), request)
        self._tell()
        self._changed.set()

    async def _play(self, player: Player, request: Play) -> None:
        now_s = time.monotonic()
        # In a thread: adding up the maps of a long flight takes a while.
        due = await asyncio.to_thread(
            player.play, now_s, playing=request.playing, at_utc_s=request.at_utc_s, speed=request.speed
        )
        await self._give(due)

    async def _open(self, path: Path) -> None:
        """A file that is being opened already goes on: one that takes long, asked for again, would never be open."""
        opening = self._opening
        if opening is None or opening.done() or path != self._path:
            async with self._turn:
                self._close()
            self._path = path
            opening = self._opening = asyncio.ensure_future(asyncio.to_thread(open_source, path, raw=self._raw))
            opening.add_done_callback(self._on_opened)
        await asyncio.wait((opening,), timeout=_PATIENCE_S)
        if opening.done() and not opening.cancelled():
            opening.result()

    def _on_opened(self, opening: asyncio.Task[ReplaySource]) -> None:
        """Also when the caller has gone, or has opened another file in the meantime."""
        error = None if opening.cancelled() else opening.exception()
        if opening.cancelled() or error is not None:
            if isinstance(error, RecordingError) and opening is self._opening:
                self._error = ErrorInfo.of(error)
                self._tell()
            return
        if opening is not self._opening:
            opening.result().close()
            return
        self._player = player = Player(opening.result(), time.monotonic())
        self._put(player.open(time.monotonic()))
        self._tell()
        self._changed.set()

    def _opened(self) -> Player:
        if self._player is not None:
            return self._player
        if self._opening is not None and not self._opening.done():
            raise RecordingError("The recording is still being opened.", advice="Wait a moment and try again.")
        raise RecordingError("No recording is open.", advice="Open one first.")

    def _close(self) -> None:
        player, self._player, self._opening = self._player, None, None
        if player is not None:
            player.close()

    async def _give(self, due: list[Due]) -> None:
        for start in range(0, len(due), _LONGEST_STRETCH):
            self._put(due[start : start + _LONGEST_STRETCH])
            if start:
                await asyncio.sleep(0)

    def _put(self, due: Iterable[Due]) -> None:
        for topic, message in due:
            self._publish(REPLAY_PREFIX + topic, message)

    def _tell(self) -> None:
        now_s = self._status_s = time.monotonic()
        status = ReplayStatus(t_mono_s=now_s, error=self._error)
        if self._player is not None:
            status = self._player.status(now_s)
        self._publish(Topic.REPLAY, status)


async def live(bus: Bus, context: NodeContext) -> None:
    """The whole node on an open bus."""
    replayer = Replayer(bus.publish)
    await bus.serve("replay", replayer.handle, ReplayRequest)
    await replayer.run(context)


def main() -> int:
    parser = argparse.ArgumentParser(prog="replay", description="Plays recordings again.")
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    options = parser.parse_args()
    return run_node("replay", options.runtime, live)


if __name__ == "__main__":
    sys.exit(main())
