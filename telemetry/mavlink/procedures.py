"""One procedure of the pilot's at a time: a newer one ends the older, whose caller is told so."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from telemetry.errors import NotAllowedError, TelemetryError

Accepted = Callable[[], None]
"""To be called when the vehicle has taken the order: from then on nobody waits for the rest."""
Procedure = Callable[[Accepted], Coroutine[Any, Any, None]]
Spawn = Callable[[Coroutine[Any, Any, None]], asyncio.Task[None]]


class Procedures:
    """``say``: what went wrong after a procedure had been accepted."""

    def __init__(self, spawn: Spawn, say: Callable[[str], None]) -> None:
        self._spawn, self._say = spawn, say
        self._current: asyncio.Task[None] | None = None

    @property
    def is_under_way(self) -> bool:
        return self._current is not None and not self._current.done()

    def end(self) -> None:
        if self._current is not None:
            self._current.cancel()
            self._current = None

    async def take_over(self, procedure: Procedure) -> None:
        """Ends what was under way, then waits until ``procedure`` is accepted or over; it may go on after that."""
        self.end()
        started: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        task = self._current = self._spawn(self._carry_out(procedure, started))
        task.add_done_callback(lambda _: _refuse_if_open(started))
        await started

    async def _carry_out(self, procedure: Procedure, started: asyncio.Future[None]) -> None:
        def accepted() -> None:
            if not started.done():
                started.set_result(None)

        try:
            await procedure(accepted)
        except TelemetryError as error:
            if started.done():
                self._say(str(error))
            else:
                started.set_exception(error)
        else:
            accepted()


def _refuse_if_open(started: asyncio.Future[None]) -> None:
    if not started.done():
        started.set_exception(NotAllowedError("Another command was given before this one was carried out."))
