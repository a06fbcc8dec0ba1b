"""The logs on one vehicle as the pages see them: which there are, and the one that is being read into the library."""

from __future__ import annotations

import asyncio
import logging
from dataclasses import dataclass, field
from pathlib import Path

from server.errors import ConflictError, NotFoundError, StorageError, reported
from server.flying.recordings import RecordingDesk
from server.heard.channel import Channel
from server.library import Library
from server.library.shelf import iso_utc
from server.schemas import LogDownloadDoc, VehicleLogDoc, VehicleLogsDoc
from telemetry.bus.link_client import LinkClient, log_stretches
from telemetry.topics.requests import ListVehicleLogs, Operator
from telemetry.topics.vehicle_logs import VehicleLog

log = logging.getLogger("hedgehop.flying")

ENDINGS = {"ardupilot": ".bin", "px4": ".ulg"}


@dataclass(slots=True)
class _Download:
    operator: Operator
    log: VehicleLog
    ending: str
    into: RecordingDesk
    doc: LogDownloadDoc
    cancelled: asyncio.Event = field(default_factory=asyncio.Event)


class VehicleLogs:
    """One is read at a time: a vehicle sends no two."""

    def __init__(self, link: LinkClient, live: Channel, library: Library, name: str = "") -> None:
        """``name``: of the vehicle, where there are several."""
        self._link, self._live, self._library, self._name = link, live, library, name
        self._logs: tuple[VehicleLog, ...] | None = None
        self._of: int | None = None
        """System id of the vehicle whose list it is."""
        self._download: _Download | None = None
        self._asked = asyncio.Event()

    @property
    def doc(self) -> VehicleLogsDoc:
        """The list of another vehicle is not this one's."""
        known = self._logs if self._logs is not None and self._of == self._system_id else None
        logs = None if known is None else [_doc(entry) for entry in known]
        return VehicleLogsDoc(logs=logs, download=None if self._download is None else self._download.doc)

    async def ask(self, operator: Operator) -> VehicleLogsDoc:
        """Raises NotAllowedError while the vehicle is armed, SilentError."""
        self._check_free()
        system_id = self._system_id
        self._logs, self._of = await self._link.call(ListVehicleLogs(operator)), system_id
        return self.doc

    def download(self, operator: Operator, number: int, into: RecordingDesk) -> VehicleLogsDoc:
        """Begins it. Raises NotFoundError, ConflictError."""
        self._check_free()
        known = self._logs if self._of == self._system_id else None
        entry = next((entry for entry in known or () if entry.number == number), None)
        state = self._live.state
        if entry is None or state is None:
            raise NotFoundError(f"There is no log {number} on the vehicle.", advice="Ask for the list again.")
        doc = LogDownloadDoc(number=number, bytes=entry.size_bytes, read_bytes=0, state="reading")
        self._download = _Download(operator, entry, ENDINGS.get(state.autopilot, ".bin"), into, doc)
        self._asked.set()
        return self.doc

    def cancel(self) -> VehicleLogsDoc:
        if self._download is not None:
            self._download.cancelled.set()
        return self.doc

    async def run(self) -> None:
        """Until cancelled; how a download ended stands in its document."""
        while True:
            await self._asked.wait()
            self._asked.clear()
            download = self._download
            if download is None:
                continue
            try:
                end = await self._read(download)
            except Exception as error:
                end = {"state": "failed", "error": reported(error, log, f"Reading log {download.log.number}")}
            download.doc = download.doc.model_copy(update=end)

    @property
    def _system_id(self) -> int | None:
        return None if self._live.state is None else self._live.state.system_id

    def _check_free(self) -> None:
        if self._download is not None and self._download.doc.state == "reading":
            raise ConflictError("A log is being read already.", advice="Wait until it is over, or cancel it.")

    async def _read(self, download: _Download) -> dict[str, object]:
        upload = self._library.new_upload(download.ending)
        try:
            async for stretch in log_stretches(self._link, download.operator, download.log):
                if download.cancelled.is_set():
                    return {"state": "cancelled"}
                await asyncio.to_thread(_append, upload, stretch)
                read = download.doc.read_bytes + len(stretch)
                download.doc = download.doc.model_copy(update={"read_bytes": read})
            name = f"{self._name or f'vehicle-{self._of}'}-log-{download.log.number}{download.ending}"
            recording = await download.into.add(upload, name)
        finally:
            await asyncio.to_thread(upload.unlink, missing_ok=True)
        return {"state": "done", "recording_id": recording.id}


def _append(path: Path, stretch: bytes) -> None:
    try:
        with path.open("ab") as file:
            file.write(stretch)
    except OSError as error:
        advice = "Make room on the disk, then read the log again."
        raise StorageError(f"The log cannot be written: {error.strerror}.", advice=advice) from error


def _doc(entry: VehicleLog) -> VehicleLogDoc:
    begun = None if entry.begun_utc_s is None else iso_utc(entry.begun_utc_s)
    return VehicleLogDoc(number=entry.number, bytes=entry.size_bytes, begun_utc=begun)
