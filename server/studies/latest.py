"""Of what a page asks for in quick succession only the newest is worked out."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

from server.errors import JobCancelledError
from server.work.jobs import Lane

SUPERSEDE_AFTER_S = 1.0
"""A newer question ends a call of the same page that has run longer; shorter ones may finish, which is cheaper than
another process."""


class Latest:
    """One call at a time; what a page no longer wants is dropped before its turn, with ``JobCancelledError``."""

    def __init__(self, lane: Lane, *, supersede_after_s: float = SUPERSEDE_AFTER_S) -> None:
        self._lane, self._supersede_after_s = lane, supersede_after_s
        self._turn = asyncio.Lock()
        self._newest: dict[str, object] = {}
        self._running: tuple[str, float] | None = None

    async def call(self, page: str, function: Callable[..., Any], /, *args: Any) -> Any:
        mine = self._newest[page] = object()
        if self._is_overdue(page):
            self._lane.cancel()
        try:
            async with self._turn:
                if self._newest.get(page) is not mine:
                    raise JobCancelledError("Something else was asked for meanwhile.")
                return await self._run(page, function, args)
        finally:
            if self._newest.get(page) is mine:
                del self._newest[page]

    def _is_overdue(self, page: str) -> bool:
        """Whether this page's own call has run for long."""
        if self._running is None or self._running[0] != page:
            return False
        return time.monotonic() - self._running[1] > self._supersede_after_s

    async def _run(self, page: str, function: Callable[..., Any], args: tuple[Any, ...]) -> Any:
        self._running = page, time.monotonic()
        try:
            return await self._lane.call(function, *args)
        finally:
            self._running = None
