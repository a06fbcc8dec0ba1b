"""The open plan and its file: what the disk refuses stays in memory and is saved later."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from server.errors import NotFoundError, StaleRevisionError, StorageFullError
from server.library import Library
from server.library.history import History
from server.plan.plan_desk import PlanDesk
from server.schemas import NoticeMessage, PlaceDoc, PlanDoc, PlanEdit


class FullDisk(Library):
    """Refuses plans while ``full``."""

    full = False

    def save_plan(self, plan_id: str, history: History) -> str:
        if self.full:
            raise StorageFullError("The disk is full.", where="data", advice="Free some space.")
        return super().save_plan(plan_id, history)


class Table:
    """A desk, and what it told."""

    def __init__(self, library: FullDisk, retry_s: float) -> None:
        self.library = library
        self.changes: list[bool] = []
        self.notices: list[NoticeMessage] = []
        self.saved = asyncio.Event()
        self.desk = PlanDesk(library, self, changed=self.changes.append, saved=self.saved.set, retry_s=retry_s)

    def publish(self, message: Any) -> None:
        self.notices.append(message)

    async def name(self, name: str) -> None:
        document = self.desk.document.model_copy(update={"name": name})
        await self.desk.edit(PlanEdit(base_revision=self.desk.revision, label="Name", document=document))

    def on_disk(self) -> PlanDoc:
        return self.library.load_plan(self.desk.plan_id).present


def run(tmp_path: Path, use: Callable[[Table], Awaitable[None]], *, retry_s: float = 0.0) -> None:
    library = FullDisk(tmp_path / "data")

    async def whole() -> None:
        table = Table(library, retry_s)
        await table.desk.open_last()
        await use(table)

    try:
        asyncio.run(whole())
    finally:
        library.close()


def test_every_edit_is_on_disk_when_it_returns(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        await table.name("a")
        assert table.on_disk().name == "a"
        await table.desk.undo()
        assert table.on_disk() == PlanDoc()
        await table.desk.redo()
        assert table.on_disk().name == "a"
        assert table.changes == [True, False, False, False]

    run(tmp_path, use)


def test_an_edit_that_changes_nothing_is_none(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        before = table.desk.revision
        await table.name(table.desk.document.name)
        assert (table.desk.revision, table.desk.history.can_undo) == (before, False)

    run(tmp_path, use)


def test_edits_of_an_old_revision_are_refused(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        edits = [
            PlanEdit(base_revision=table.desk.revision, label="x", document=PlanDoc(name=name)) for name in ("a", "b")
        ]
        outcomes = await asyncio.gather(*(table.desk.edit(edit) for edit in edits), return_exceptions=True)
        assert outcomes[0] is None
        assert isinstance(outcomes[1], StaleRevisionError)
        assert table.on_disk().name == "a"

    run(tmp_path, use)


def test_a_full_disk_keeps_the_edits_and_saves_them_later(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        await table.name("saved")
        saved_utc = table.desk.saved_utc
        table.library.full = True
        for name in ("b", "c"):
            await table.name(name)
        assert (table.desk.document.name, table.desk.saved_utc, table.on_disk().name) == ("c", saved_utc, "saved")
        # Told once, not with every step of a slider.
        assert [(notice.level, notice.error.code) for notice in table.notices] == [("error", "disk_full")]
        loop = asyncio.create_task(table.desk.run())
        table.library.full = False
        async with asyncio.timeout(30):
            await table.saved.wait()
        loop.cancel()
        await asyncio.gather(loop, return_exceptions=True)
        assert table.on_disk().name == "c"
        assert table.desk.saved_utc > saved_utc
        assert [notice.error.code for notice in table.notices] == ["disk_full", "saved"]

    run(tmp_path, use)


def test_a_plan_that_cannot_be_saved_is_not_left(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        other, _ = table.library.create_plan(History([PlanDoc(name="other")]))
        table.library.full = True
        await table.name("held")
        for leaving in (table.desk.open(other), table.desk.create(lambda present: PlanDoc())):
            with pytest.raises(StorageFullError):
                await leaving
        assert table.desk.document.name == "held"
        table.library.full = False
        held = table.desk.plan_id
        await table.desk.open(other)
        assert table.library.load_plan(held).present.name == "held"

    run(tmp_path, use)


def test_the_last_try_is_made_when_the_server_ends(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        table.library.full = True
        await table.name("held")
        table.library.full = False
        await table.desk.close()
        assert table.on_disk().name == "held"

    run(tmp_path, use)


def test_opening_the_open_plan_again_loses_no_edit(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        await asyncio.gather(table.name("edited"), table.desk.open(table.desk.plan_id))
        assert (table.desk.document.name, table.on_disk().name) == ("edited", "edited")

    run(tmp_path, use)


def test_a_change_beyond_the_limits_is_refused_before_it_is_saved(tmp_path: Path) -> None:
    corner = PlaceDoc(lat_deg=1, lon_deg=2)

    def grow(document: PlanDoc) -> tuple[str, PlanDoc]:
        survey = document.survey.model_copy(update={"polygon": [*document.survey.polygon, corner]})
        return "Add corner", document.model_copy(update={"survey": survey})

    async def use(table: Table) -> None:
        full = PlanDoc().survey.model_copy(update={"polygon": [corner] * 200})
        await table.desk.propose(lambda document: ("Draw", document.model_copy(update={"survey": full})))
        with pytest.raises(ValidationError):
            await table.desk.propose(grow)
        assert len(table.on_disk().survey.polygon) == 200

    run(tmp_path, use)


def test_only_new_references_are_checked(tmp_path: Path) -> None:
    async def use(table: Table) -> None:
        with pytest.raises(NotFoundError):
            await table.desk.propose(lambda document: ("x", document.model_copy(update={"terrain_id": "gone"})))
        table.desk.history.documents[0] = PlanDoc(terrain_id="gone")
        await table.name("still editable")
        assert table.on_disk().name == "still editable"

    run(tmp_path, use)
