"""The shelf of recordings: one file each under ``recordings/``, written there by the recorder node or brought in.

A recording's id is made from its file name, so that the folder is all there is to keep: no list can contradict it.
"""

from __future__ import annotations

import hashlib
import os
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Literal

from server.errors import BadRequestError, NotFoundError
from server.library.library import Library
from server.library.shelf import iso_utc
from server.library.terrain_of import FlownOver, terrain_of
from server.library.whole_files import check_id, storage_errors, sync_directory
from server.schemas import RecordingDoc

if TYPE_CHECKING:
    from telemetry.recording.describe import RecordingInfo

FOLDER = "recordings"
KINDS: dict[str, Literal["hedgehop", "tlog"]] = {".mcap": "hedgehop", ".tlog": "tlog"}


class RecordingShelf:
    """Blocking calls, for threads; what a file says about itself is kept until it changes."""

    def __init__(self, library: Library) -> None:
        self.folder = library.root / FOLDER
        self._library = library
        self._known: dict[tuple[str, int, int], RecordingInfo] = {}
        with storage_errors(self.folder):
            self.folder.mkdir(mode=0o700, exist_ok=True)

    def docs(self, *, being_written: str | None = None) -> list[RecordingDoc]:
        """Newest first. The one that is being written is left out: it is on show elsewhere."""
        with storage_errors(self.folder):
            files = [path for path in self.folder.iterdir() if _is_recording(path) and path.name != being_written]
        docs = [self._doc(path) for path in files]
        present = {path.name for path in files}
        self._known = {key: info for key, info in self._known.items() if key[0] in present}
        return sorted(docs, key=lambda doc: (doc.started_utc, doc.name), reverse=True)

    def path(self, recording_id: str) -> Path:
        """Raises NotFoundError."""
        check_id(recording_id, kind="recording")
        for path in self.folder.iterdir():
            if _is_recording(path) and recording_id_of(path.name) == recording_id:
                return path
        raise NotFoundError("There is no such recording.", advice="Reload the page for the present list.")

    def doc(self, recording_id: str) -> RecordingDoc:
        """Raises NotFoundError."""
        return self._doc(self.path(recording_id))

    def add(self, upload: Path, name: str) -> RecordingDoc:
        """Takes in an uploaded file under its own name, or one near it; it has been read before."""
        target = self._free_place(name)
        with storage_errors(target):
            os.rename(upload, target)
            sync_directory(self.folder)
        return self._doc(target)

    def delete(self, recording_id: str) -> None:
        path = self.path(recording_id)
        with storage_errors(path):
            path.unlink()
            sync_directory(self.folder)

    def _doc(self, path: Path) -> RecordingDoc:
        info = self._info(path)
        flown = FlownOver(info.terrain_id, info.terrain_sha256)
        terrain = terrain_of(flown, self._library.terrains())
        return RecordingDoc(
            id=recording_id_of(path.name),
            name=path.name,
            kind=KINDS[path.suffix.lower()],
            started_utc=iso_utc(info.start_utc_s if info.start_utc_s is not None else _changed_utc_s(path)),
            duration_s=info.duration_s,
            bytes=info.size_bytes,
            vehicle=info.vehicle,
            plan_name=info.plan_name,
            terrain_id=None if terrain is None else terrain.id,
            fault=info.fault or "",
        )

    def _info(self, path: Path) -> RecordingInfo:
        # Brings in the wire protocols: only when somebody looks at recordings.
        from telemetry.recording.describe import describe_recording

        key = _key(path)
        if key not in self._known:
            self._known[key] = describe_recording(path)
        return self._known[key]

    def _free_place(self, name: str) -> Path:
        stem, suffix = _plain_stem(name), suffix_of_recording(name)
        number = 1
        while (target := self.folder / f"{stem}{f'-{number}' if number > 1 else ''}{suffix}").exists():
            number += 1
        return target


def recording_id_of(name: str) -> str:
    return hashlib.sha256(name.encode()).hexdigest()[:16]


def suffix_of_recording(name: str) -> str:
    """Raises BadRequestError for a file that is neither kind of recording."""
    suffix = PurePosixPath(name).suffix.lower()
    if suffix not in KINDS:
        raise BadRequestError(
            f"{name!r} is no recording: its name ends neither in .mcap nor in .tlog.",
            advice="Choose a telemetry log (.tlog) or one of Hedgehop's own recordings (.mcap).",
        )
    return suffix


def _plain_stem(name: str) -> str:
    """What may stand in a file name everywhere."""
    stem = PurePosixPath(name).stem
    plain = "".join(char if char.isascii() and (char.isalnum() or char in "-_ ") else "_" for char in stem).strip(" ")
    return plain[:60] or f"recording-{datetime.now(UTC):%Y%m%dT%H%M%S}"


def _is_recording(path: Path) -> bool:
    return path.suffix.lower() in KINDS and path.is_file() and not path.is_symlink() and not path.name.startswith(".")


def _key(path: Path) -> tuple[str, int, int]:
    """Changes when the file does."""
    try:
        status = path.stat()
    except FileNotFoundError:
        return path.name, -1, 0
    return path.name, status.st_size, status.st_mtime_ns


def _changed_utc_s(path: Path) -> float:
    return max(0, _key(path)[2]) / 1e9
