"""Coroutines that live and end together."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

from server.errors import BusyError


async def until_first(*coroutines: Coroutine[Any, Any, object]) -> None:
    """Runs them until one returns or fails; the others are cancelled and awaited, and the failure comes out."""
    tasks = [asyncio.create_task(coroutine) for coroutine in coroutines]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


class Background:
    """Tasks that run until the app stops; made inside the one ``TaskGroup`` that the app's lifespan owns."""

    def __init__(self, group: asyncio.TaskGroup) -> None:
        self._group = group
        self._stopped = False
        self._tasks: set[asyncio.Task[Any]] = set()

    def spawn(self, coroutine: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
        """Raises BusyError once the app is stopping."""
        if self._stopped:
            coroutine.close()
            raise BusyError("Hedgehop is shutting down.", advice="Start it again.")
        task = self._group.create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def stop(self) -> None:
        self._stopped = True
        for task in list(self._tasks):
            task.cancel()
