"""Keeps the answer to the present document up to date: the latest edit wins, the last answer stays in sight."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from server.errors import JobCancelledError, NotFoundError, NotReadyError, reported
from server.library import Library
from server.library.documents import missing
from server.plan import tasks
from server.scene.geometry.payload import PlanScene
from server.schemas import Computation, PlanDoc
from server.work.jobs import Lane

log = logging.getLogger("hedgehop.plan")

SUPERSEDE_AFTER_S = 2.0
"""A newer edit ends a computation that has run longer; shorter ones may finish, which is cheaper."""
TRADE_WHEN_IDLE_S = 0.4


class Computing:
    """One loop, one lane. ``changed()`` is called whenever ``state`` or ``scene`` is new."""

    def __init__(
        self,
        lane: Lane,
        library: Library,
        *,
        changed: Callable[[], None],
        supersede_after_s: float = SUPERSEDE_AFTER_S,
        trade_when_idle_s: float = TRADE_WHEN_IDLE_S,
    ) -> None:
        self._lane, self._library, self._changed = lane, library, changed
        self._supersede_after_s, self._trade_when_idle_s = supersede_after_s, trade_when_idle_s
        self._wanted: tuple[int, PlanDoc] | None = None
        self._wake = asyncio.Event()
        self._started_mono_s: float | None = None
        self.state = Computation(revision=0, state="empty", hint=missing(PlanDoc()))
        self.scene: PlanScene | None = None

    def request(self, revision: int, document: PlanDoc, *, forget: bool = False) -> None:
        """Asks for the answer to ``document``; ``forget`` drops the last one (another plan was opened)."""
        self._wanted = (revision, document)
        hint = missing(document)
        if forget or hint:
            self.scene = None
        if hint:
            self.state = Computation(revision=revision, state="empty", hint=hint)
        else:
            last = None if forget else self.state.result
            self.state = Computation(revision=revision, state="running", result=last)
        if self._started_mono_s is not None and time.monotonic() - self._started_mono_s > self._supersede_after_s:
            self._lane.cancel()
        self._wake.set()

    async def run(self) -> None:
        """Until cancelled; whatever goes wrong with one document, the next is answered."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            if self._wanted is not None and not missing(self._wanted[1]):
                await self._answer(*self._wanted)

    async def _answer(self, revision: int, document: PlanDoc) -> None:
        try:
            directory = self._directory(document)
            result, scene = await self._call(tasks.compute_plan, directory, document)
        except JobCancelledError:
            return
        except Exception as error:
            doc = reported(error, log, "Planning")
            self._settle(revision, Computation(revision=revision, state="error", error=doc), None)
            return
        self._settle(revision, Computation(revision=revision, state="ready", result=result), scene)
        await self._add_trade(revision, document, directory)

    def _directory(self, document: PlanDoc) -> Path:
        try:
            return self._library.terrain_dir(document.terrain_id or "")
        except NotFoundError:
            raise NotReadyError(
                "The surface model of this plan has been deleted.", advice="Choose another surface model."
            ) from None

    async def _call(self, function: Callable[..., Any], directory: Path, document: PlanDoc) -> Any:
        try:
            return await self._lane.call(function, directory, document, progress=lambda step, share: self._note_start())
        finally:
            self._started_mono_s = None

    def _note_start(self) -> None:
        """The lane may have been busy with something else until now: its time does not count."""
        if self._started_mono_s is None:
            self._started_mono_s = time.monotonic()

    def _settle(self, revision: int, state: Computation, scene: PlanScene | None) -> None:
        if self._wanted is None or self._wanted[0] != revision:
            return
        self.state, self.scene = state, scene
        self._changed()

    async def _add_trade(self, revision: int, document: PlanDoc, directory: Path) -> None:
        try:
            async with asyncio.timeout(self._trade_when_idle_s):
                await self._wake.wait()
            return
        except TimeoutError:
            pass
        try:
            trade = await self._call(tasks.compute_trade, directory, document)
        except JobCancelledError:
            return
        except Exception as error:
            # The plan itself stands; the table of alternatives is left out.
            reported(error, log, "The trade table")
            return
        result = self.state.result
        if result is not None and self.state.revision == revision:
            with_trade = result.model_copy(update={"trade": trade})
            self._settle(revision, self.state.model_copy(update={"result": with_trade}), self.scene)
