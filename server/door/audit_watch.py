"""Whether the log of commands is as it was written: looked through at the start, every hour, and when asked."""

from __future__ import annotations

import asyncio
import io
import logging
import zipfile
from collections.abc import Awaitable
from pathlib import Path

from server.door.alarms import Alarms
from server.errors import reported
from server.library import audit_log
from server.library.audit_log import AuditVerdict
from server.schemas import AuditDoc, AuditEntryDoc, ErrorDoc
from server.work.job_board import JobBoard
from telemetry.link.audit import AUDIT_FILE

log = logging.getLogger("hedgehop.audit")

EVERY_S = 3600.0
NEWEST = 50


class AuditWatch:
    """All methods belong to the event loop; the log is read beside it, and held against recordings in a worker."""

    def __init__(self, folder: Path, board: JobBoard, alarms: Alarms) -> None:
        self._file, self._board, self._alarms = folder / AUDIT_FILE, board, alarms
        self._verdict: AuditVerdict | None = None
        self._looking = asyncio.Lock()

    async def run(self) -> None:
        """Until cancelled."""
        while True:
            try:
                await self.verify()
            except Exception as error:
                log.warning("The audit log: %s", reported(error, log, "Looking through the audit log").what)
            await asyncio.sleep(EVERY_S)

    async def verify(self) -> AuditVerdict | None:
        """None: no command was given yet. A break is an alarm. Raises StorageError."""
        async with self._looking:
            return await self._verify()

    async def _verify(self) -> AuditVerdict | None:
        if not await asyncio.to_thread(self._file.is_file):
            self._verdict = None
            return None
        key = await asyncio.to_thread(audit_log.read_key, self._file.parent)
        found: list[AuditVerdict] = []
        await self._board.unseen(lambda lane: _kept(found, lane.call(audit_log.look_through, self._file, key)))
        self._verdict = verdict = found[0]
        if verdict.faults:
            what = " ".join(verdict.faults)
            error = ErrorDoc(code="audit_broken", what=what, where=self._file.name, advice=audit_log.ADVICE)
            self._alarms.begin("audit", error)
        else:
            self._alarms.end("audit")
        return verdict

    async def doc(self) -> AuditDoc:
        """As last looked through, with the entries of now. Raises StorageError."""
        has_log = await asyncio.to_thread(self._file.is_file)
        if has_log and self._verdict is None:
            await self.verify()
        newest = await asyncio.to_thread(audit_log.newest_entries, self._file, NEWEST) if has_log else []
        entries = [
            AuditEntryDoc(
                t_utc_s=t_utc_s if isinstance(t_utc_s := entry.get("t_utc_s"), int | float) else None,
                operator=str(entry.get("operator", "")),
                words=str(entry.get("words", "")),
                result=str(entry.get("result", "")),
            )
            for entry in newest
        ]
        if (verdict := self._verdict) is None:
            return AuditDoc(state="none", verdict=[], lines=0, checked_utc_s=None, newest=entries)
        return AuditDoc(
            state="broken" if verdict.faults else "whole",
            verdict=list(verdict.sentences),
            lines=verdict.lines,
            checked_utc_s=verdict.checked_utc_s,
            newest=entries,
        )

    async def export(self) -> bytes:
        """A zip with the table and with what is thought of it now."""
        verdict = await self.verify()
        said = ["No command was given yet."] if verdict is None else [*verdict.sentences]
        table = "" if verdict is None else await asyncio.to_thread(audit_log.as_table, self._file)
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("verdict.txt", "\n".join(said) + "\n")
            file.writestr("commands.csv", table)
        return archive.getvalue()


async def _kept(found: list[AuditVerdict], looking: Awaitable[AuditVerdict]) -> None:
    found.append(await looking)
