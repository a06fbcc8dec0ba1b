"""The list of recordings on the event loop: what cannot be read there ends nothing else."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

from server.errors import StorageError
from server.flying.recordings import RecordingDesk
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
