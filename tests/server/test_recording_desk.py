"""The list of recordings on the event loop: what cannot be read there ends nothing else."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from server.errors import StorageError
from server.flying.recordings import Recording, RecordingDesk
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
        await Recording(2, Path("recordings"), shelf, nodes, Told()).start()
        assert shelf.being_written == {2: Path("recordings/20260101T000000Z.mcap")}
        assert shelf.changed.is_set()

    asyncio.run(play())
