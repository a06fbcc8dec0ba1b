"""Whether the log of commands is as it was written: looked through at the start, every hour, and when asked."""

from __future__ import annotations

import asyncio
import io
import logging
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path

from server.door.alarms import Alarms
from server.errors import reported
from server.library import audit_log
from server.library.audit_log import AuditVerdict
from server.schemas import AuditDoc, AuditEntryDoc, ErrorDoc
from server.schemas.station_docs import FIRST_VEHICLE
from server.work.job_board import JobBoard
from server.work.jobs import Lane
from telemetry.link.audit import AUDIT_FILE

log = logging.getLogger("hedgehop.audit")

EVERY_S = 3600.0
NEWEST = 50


class AuditWatch:
    """All methods belong to the event loop; the log is read beside it, and held against recordings in a worker."""

    def __init__(self, folders: Callable[[], Mapping[int, Path]], board: JobBoard, alarms: Alarms) -> None:
        """``folders``: of each vehicle by its number; each has a log of its own."""
        self._folders, self._board, self._alarms = folders, board, alarms
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
        files = await asyncio.to_thread(self._files)
        found: dict[int, AuditVerdict] = {}
        for number, file in files.items():
            key = await asyncio.to_thread(audit_log.read_key, file.parent)

            async def look(lane: Lane, number: int = number, file: Path = file, key: bytes = key) -> None:
                found[number] = await lane.call(audit_log.look_through, file, key)

            await self._board.unseen(look)
        self._verdict = verdict = audit_log.joined(found) if found else None
        if verdict is None:
            return None
        if verdict.faults:
            what = " ".join(verdict.faults)
            error = ErrorDoc(code="audit_broken", what=what, where=AUDIT_FILE, advice=audit_log.ADVICE)
            self._alarms.begin("audit", error)
        else:
            self._alarms.end("audit")
        return verdict

    async def doc(self) -> AuditDoc:
        """As last looked through, with the entries of now. Raises StorageError."""
        files = await asyncio.to_thread(self._files)
        if files and self._verdict is None:
            await self.verify()
        newest = await asyncio.to_thread(audit_log.newest_of, list(files.values()), NEWEST)
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
        files = await asyncio.to_thread(self._files)
        tables = {number: await asyncio.to_thread(audit_log.as_table, file) for number, file in files.items()}
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("verdict.txt", "\n".join(said) + "\n")
            file.writestr("commands.csv", tables.pop(FIRST_VEHICLE, ""))
            for number, table in tables.items():
                file.writestr(f"commands-{number}.csv", table)
        return archive.getvalue()

    def _files(self) -> dict[int, Path]:
        logs = {number: folder / AUDIT_FILE for number, folder in self._folders().items()}
        return {number: log for number, log in logs.items() if log.is_file()}
