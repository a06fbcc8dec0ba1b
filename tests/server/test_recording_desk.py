"""The list of recordings on the event loop: what cannot be read there ends nothing else."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from server.errors import StorageError
from server.flying.recordings import Recording, RecordingDesk
from telemetry.topics.messages import RecorderStatus
from tests.server.fakes import Told


def test_a_folder_that_cannot_be_listed_ends_no_flight_and_is_listed_again() -> None:
    async def play() -> None:
        answers: list[Any] = [StorageError("The disk fails."), []]

        def docs() -> list[Any]:
            answer = answers.pop(0)
            if isinstance(answer, Exception):
                raise answer
            return answer

        shelf: Any = SimpleNamespace(docs=docs, changed=asyncio.Event())
        nothing: Any = None
        pages = Told()
        running = asyncio.create_task(RecordingDesk(shelf, nothing, nothing, pages).run())
        while len(answers) > 1:
            await asyncio.sleep(0)
        shelf.changed.set()
        while not pages and not running.done():
            await asyncio.sleep(0)
        assert [message.recordings for message in pages] == [[]]
        running.cancel()

    asyncio.run(play())


def test_a_recording_that_has_just_begun_counts_as_being_written_before_its_recorder_says_so() -> None:
    async def begins(request: object) -> str:
        return "20260101T000000Z.mcap"

    async def play() -> None:
        shelf: Any = SimpleNamespace(being_written={}, changed=asyncio.Event())
        nodes: Any = SimpleNamespace(ask_recorder=begins)
        recording = Recording(2, Path("recordings"), shelf, nodes, Told())
        before_s = time.monotonic()
        await recording.start()
        written = {2: Path("recordings/20260101T000000Z.mcap")}
        assert shelf.being_written == written
        assert shelf.changed.is_set()
        # Under way since before it began; the first word of this recorder, so that it is news.
        recording.on_status(RecorderStatus(before_s - 1.0, recording=False))
        assert shelf.being_written == written
        recording.on_status(RecorderStatus(time.monotonic(), recording=True, name="20260101T000000Z.mcap"))
        assert shelf.being_written == written
        recording.on_status(RecorderStatus(time.monotonic(), recording=False))
        assert shelf.being_written == {}

    asyncio.run(play())
