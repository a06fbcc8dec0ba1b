"""The one open plan: its document, its history, and that both are on disk.

Every change is on disk before it is acknowledged. When the disk refuses, the change stays in memory, the
operator is told, and saving is tried again until it succeeds; no other plan is opened before that.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Literal

from server.errors import InUseError, StaleRevisionError, StorageFullError, error_doc, reported
from server.library import Library
from server.library.history import History
from server.library.planned_on import on_another_model
from server.library.whole_files import new_id
from server.schemas import ErrorDoc, NoticeMessage, Pages, PlanDoc, PlanEdit

log = logging.getLogger("hedgehop.plan")

RETRY_S = 5.0

Proposal = Callable[[PlanDoc], tuple[str, PlanDoc] | None]
"""(undo label, new document) for the document that is open when its turn comes; None: nothing to change."""


class PlanDesk:
    """``changed(forget)`` follows every new revision, ``forget`` when it is another plan's."""

    def __init__(
        self,
        library: Library,
        pages: Pages,
        *,
        changed: Callable[[bool], None],
        saved: Callable[[], None],
        retry_s: float = RETRY_S,
    ) -> None:
        self._library, self._pages, self._changed, self._saved = library, pages, changed, saved
        self._retry_s = retry_s
        self.editing = asyncio.Lock()
        """Held while the plan changes, or while something is deleted that it may need."""
        self._unsaved = asyncio.Event()
        self.plan_id, self.revision, self.saved_utc = "", 0, ""
        self.history = History()

    @property
    def document(self) -> PlanDoc:
        return self.history.present

    async def run(self) -> None:
        """Until cancelled: saves again what could not be saved."""
        while True:
            await self._unsaved.wait()
            await asyncio.sleep(self._retry_s)
            async with self.editing:
                if self._unsaved.is_set() and await self._save():
                    self._saved()

    async def close(self) -> None:
        """One last try."""
        async with self.editing:
            if self._unsaved.is_set() and not await self._save():
                log.error("The last changes of plan %s could not be saved.", self.plan_id)

    # Edits

    async def edit(self, edit: PlanEdit) -> None:
        """Raises StaleRevisionError when the plan has changed since ``base_revision``."""
        async with self.editing:
            if edit.base_revision != self.revision:
                raise StaleRevisionError(
                    f"The plan has changed meanwhile (revision {self.revision}, edit of {edit.base_revision}).",
                    advice="Look at the present plan and make the change again.",
                )
            await self._commit(edit.label, edit.document, coalesce=edit.coalesce)

    async def propose(self, proposal: Proposal) -> None:
        """An edit that the server makes itself. Raises ValidationError when it breaks a limit of the document."""
        async with self.editing:
            if (change := proposal(self.document)) is not None:
                label, document = change
                # Copies are made unchecked: a document beyond its limits could be saved, but never be read again.
                await self._commit(label, PlanDoc.model_validate(document.model_dump()))

    async def undo(self) -> None:
        await self._travel(History.undo)

    async def redo(self) -> None:
        await self._travel(History.redo)

    async def _travel(self, step: Callable[[History], bool]) -> None:
        async with self.editing:
            if step(self.history):
                await self._follow()

    async def _commit(self, label: str, document: PlanDoc, *, coalesce: bool = False) -> None:
        if document == self.document:
            return
        self._check_references(document)
        document = on_another_model(self.document, document, self._library.terrains())
        self.history.edit(label, document, coalesce=coalesce, now_mono_s=time.monotonic())
        await self._follow()

    def _check_references(self, document: PlanDoc) -> None:
        """Of new ones only: a plan whose surface model is gone can still be edited, and given another one."""
        if document.terrain_id not in (None, self.document.terrain_id):
            self._library.terrain_dir(document.terrain_id)
        if document.orthophoto_id not in (None, self.document.orthophoto_id):
            self._library.orthophoto_dir(document.orthophoto_id)

    async def _follow(self) -> None:
        await self._save()
        self.revision += 1
        self._changed(False)

    async def _save(self) -> bool:
        try:
            self.saved_utc = await asyncio.to_thread(self._library.save_plan, self.plan_id, self.history)
        except Exception as error:
            self._not_saved(reported(error, log, "Saving the plan"))
            return False
        if self._unsaved.is_set():
            self._unsaved.clear()
            self._tell("info", ErrorDoc(code="saved", what="The plan is saved again: nothing was lost."))
        return True

    def _not_saved(self, why: ErrorDoc) -> None:
        if self._unsaved.is_set():
            return
        self._unsaved.set()
        log.error("The plan could not be saved: %s (%s)", why.what, why.where)
        advice = f"{why.advice} Keep Hedgehop running: it holds your changes and tries again every few seconds."
        self._tell("error", why.model_copy(update={"advice": advice.strip()}))

    # Plans

    async def open_last(self) -> None:
        """The plan that was open last, or a new one."""
        last = await asyncio.to_thread(self._library.last_plan)
        if last is None:
            try:
                await self.create(lambda present: PlanDoc())
            except StorageFullError as error:
                # A station without room for a plan can still lead vehicles.
                self._not_saved(error_doc(error))
                self.plan_id, self.history = new_id(), History([PlanDoc()])
                self.revision += 1
                self._changed(True)
        else:
            await self.open(last)

    async def open(self, plan_id: str) -> None:
        """Raises NotFoundError, and StorageError when it is damaged."""
        async with self.editing:
            await self._leave()
            await self._adopt(plan_id, await asyncio.to_thread(self._library.load_plan, plan_id))

    async def create(self, make: Callable[[PlanDoc], PlanDoc]) -> None:
        """A new plan, made from the present document. Raises StorageFullError."""
        async with self.editing:
            await self._leave()
            history = History([make(self.document)])
            await self._adopt(*await asyncio.to_thread(self._library.create_plan, history))

    async def delete(self, plan_id: str) -> None:
        async with self.editing:
            if plan_id == self.plan_id:
                raise InUseError("This plan is open.", where=self.document.name, advice="Open another plan first.")
            await asyncio.to_thread(self._library.delete_plan, plan_id)

    async def _leave(self) -> None:
        """Raises the storage error as long as the open plan cannot be saved: leaving it would lose the changes."""
        if self._unsaved.is_set():
            self.saved_utc = await asyncio.to_thread(self._library.save_plan, self.plan_id, self.history)
            self._unsaved.clear()

    async def _adopt(self, plan_id: str, history: History) -> None:
        self.plan_id, self.history = plan_id, history
        self.saved_utc = self._library.saved_utc(plan_id)
        try:
            await asyncio.to_thread(self._library.remember_plan, plan_id)
        except Exception as error:
            # The plan is open all the same; only the next start may open another one.
            self._tell("warning", reported(error, log, "Noting which plan is open"))
        self.revision += 1
        self._changed(True)

    def _tell(self, level: Literal["info", "warning", "error"], error: ErrorDoc) -> None:
        self._pages.publish(NoticeMessage(level=level, error=error))
