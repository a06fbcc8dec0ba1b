"""The shelf of recordings: one file each, written by a vehicle's recorder into its own folder, or brought in; those of
other stations in folders of their names.

A recording's id is made from its file name, so that the folders are all there is to keep: no list can contradict it.
"""

from __future__ import annotations

import asyncio
import hashlib
import logging
import os
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Literal

from server.errors import BadRequestError, NotFoundError, reported
from server.library.library import Library
from server.library.shelf import iso_utc
from server.library.terrain_of import FlownOver, terrain_of
from server.library.whole_files import check_id, storage_errors, sync_directory, write_atomically
from server.schemas import RecordingDoc
from server.schemas.station_docs import FIRST_VEHICLE
from telemetry.stations.station_names import checked_name

if TYPE_CHECKING:
    from telemetry.recording.describe import RecordingInfo

log = logging.getLogger("hedgehop.library")

FOLDER, FETCHED = "recordings", "fetched"
KINDS: dict[str, Literal["hedgehop", "tlog", "dataflash", "ulog"]] = {
    ".mcap": "hedgehop",
    ".tlog": "tlog",
    ".bin": "dataflash",
    ".ulg": "ulog",
}


_LATEST_CHANGE_UTC_S = 253_402_300_799.0
"""The last second of the year 9999."""


class RecordingShelf:
    """Blocking calls, for threads; what a file says about itself is kept until it changes."""

    def __init__(self, library: Library) -> None:
        self._library = library
        self._known: dict[tuple[str, int, int], RecordingInfo] = {}
        self._folder = self.folder_of(FIRST_VEHICLE)
        self.being_written: dict[int, Path] = {}
        """By the vehicle's number. Whoever changes it sets ``changed``."""
        self.changed = asyncio.Event()

    def folder_of(self, vehicle: int) -> Path:
        """Where this vehicle's recorder writes; a folder of its own, because what it finds unfinished there is its own.

        Raises StorageError.
        """
        folder = self._library.vehicle_dir(vehicle) / FOLDER
        with storage_errors(folder):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        return folder

    @property
    def root(self) -> Path:
        return self._library.root

    def docs(self) -> list[RecordingDoc]:
        """Newest first. Those that are being written are left out: they are on show elsewhere."""
        return [doc for _, doc in self.shelved()]

    def shelved(self) -> list[tuple[Path, RecordingDoc]]:
        """The same, each with its file."""
        written = set(self.being_written.values())
        files = [path for path in self._files() if path not in written]
        docs = [(path, self._doc(path)) for path in files]
        present = {str(path) for path in files}
        self._known = {key: info for key, info in self._known.items() if key[0] in present}
        return sorted(docs, key=lambda each: (each[1].started_utc, each[1].name), reverse=True)

    def path(self, recording_id: str) -> Path:
        """Raises NotFoundError."""
        check_id(recording_id, kind="recording")
        for path in self._files():
            if self._id(path) == recording_id:
                return path
        raise NotFoundError("There is no such recording.", advice="Reload the page for the present list.")

    def doc(self, recording_id: str) -> RecordingDoc:
        """Raises NotFoundError."""
        return self._doc(self.path(recording_id))

    def add(self, upload: Path, name: str, station: str = "", sha256: str = "") -> RecordingDoc:
        """Takes in a file under its own name, or one near it; it has been read before. ``station``: from which it was
        fetched, with its SHA-256, which is kept beside it."""
        folder = self._library.root / FETCHED / checked_name(station) if station else self._folder
        target = _free_place(folder, name)
        with storage_errors(target):
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if sha256:
                # First: what is killed then leaves a note of no file, which the next one of that name overwrites.
                write_atomically(_note_of(target), f"{sha256}  {target.name}\n".encode())
            os.rename(upload, target)
            sync_directory(target.parent)
        return self._doc(target)

    def delete(self, recording_id: str) -> None:
        path = self.path(recording_id)
        with storage_errors(path):
            path.unlink()
            if self._station(path):
                _note_of(path).unlink(missing_ok=True)
            sync_directory(path.parent)

    def _files(self) -> list[Path]:
        with storage_errors(self._folder):
            others = (folder / FOLDER for folder in self._library.vehicle_dirs().values())
            fetched = (self._library.root / FETCHED).glob("[!.]*")
            folders = [self._folder, *(folder for folder in (*others, *fetched) if folder.is_dir())]
            return [path for folder in folders for path in folder.iterdir() if _is_recording(path)]

    def _id(self, path: Path) -> str:
        """Two vehicles may begin a recording in the same second."""
        own = path.parent == self._folder
        return recording_id_of(path.name if own else path.relative_to(self._library.root).as_posix())

    def _flown_by(self, path: Path) -> str:
        """Systems of several vehicles may all have the same number. Those of the first lie with what was brought in."""
        return "" if path.parent == self._folder or self._station(path) else f"Vehicle {path.parent.parent.name}"

    def _station(self, path: Path) -> str:
        """From which it was fetched."""
        return path.parent.name if path.parent.parent == self._library.root / FETCHED else ""

    def _doc(self, path: Path) -> RecordingDoc:
        info = self._info(path)
        name = plain_name(path)
        fault = info.fault or ""
        if name != path.name:
            fault = f"Its name is not UTF-8: rename the file, so that it can be opened. {fault}".strip()
        flown = FlownOver(info.terrain_id, info.terrain_sha256)
        terrain = terrain_of(flown, self._library.terrains())
        return RecordingDoc(
            id=self._id(path),
            name=name,
            kind=KINDS[path.suffix.lower()],
            started_utc=iso_utc(info.start_utc_s if info.start_utc_s is not None else _changed_utc_s(path)),
            duration_s=info.duration_s,
            bytes=info.size_bytes,
            vehicle=", ".join(filter(None, (self._flown_by(path), info.vehicle))),
            plan_name=info.plan_name,
            terrain_id=None if terrain is None else terrain.id,
            fault=fault,
            station=self._station(path),
        )

    def _info(self, path: Path) -> RecordingInfo:
        # Brings in the wire protocols: only when somebody looks at recordings.
        from telemetry.recording.describe import RecordingInfo, describe_recording

        key = _key(path)
        if key not in self._known:
            try:
                self._known[key] = describe_recording(path)
            except Exception as error:
                # One file is one line of the list, whatever is in it; said once, until the file changes.
                doc = reported(error, log, f"Looking at the recording {plain_name(path)}")
                self._known[key] = RecordingInfo(path.name, max(0, key[1]), fault=doc.what)
        return self._known[key]


def recording_id_of(name: str) -> str:
    return hashlib.sha256(os.fsencode(name)).hexdigest()[:16]


def plain_name(path: Path) -> str:
    """What is no UTF-8 of it is replaced: such a name can be told to no page."""
    return os.fsencode(path.name).decode("utf-8", "replace")


def sha256_of_fetched(path: Path) -> str:
    """As it was when it came; empty: not known."""
    try:
        noted = _note_of(path).read_bytes()[:64].decode("ascii", "replace")
    except OSError:
        return ""
    return noted if len(noted) == 64 else ""


def _note_of(path: Path) -> Path:
    """As sha256sum writes and checks it."""
    return path.with_name(f".{path.name}.sha256")


def suffix_of_recording(name: str) -> str:
    """Raises BadRequestError for a file that is no kind of recording."""
    suffix = PurePosixPath(name).suffix.lower()
    if suffix not in KINDS:
        raise BadRequestError(
            f"{name!r} is no recording: its name ends in none of {', '.join(KINDS)}.",
            advice="Choose a recording (.mcap), a ground station's log (.tlog) or a vehicle's own (.bin, .ulg).",
        )
    return suffix


def _free_place(folder: Path, name: str) -> Path:
    plain = Path(_shelf_name(name))
    stem, suffix = plain.stem, plain.suffix
    number = 1
    while (target := folder / f"{stem}{f'-{number}' if number > 1 else ''}{suffix}").exists():
        number += 1
    return target


def _shelf_name(name: str) -> str:
    """Under which it is taken in, unless there is one of that name. Raises BadRequestError."""
    return f"{_plain_stem(name)}{suffix_of_recording(name)}"


def _plain_stem(name: str) -> str:
    """What may stand in a file name everywhere."""
    stem = PurePosixPath(name).stem
    plain = "".join(char if char.isascii() and (char.isalnum() or char in "-_ ") else "_" for char in stem).strip(" ")
    return plain[:60] or f"recording-{datetime.now(UTC):%Y%m%dT%H%M%S}"


def _is_recording(path: Path) -> bool:
    if path.suffix.lower() not in KINDS or path.name.startswith("."):
        return False
    try:
        return path.is_file() and not path.is_symlink()
    except OSError:  # of a failing disk: it is listed, with what is wrong
        return True


def _key(path: Path) -> tuple[str, int, int]:
    """Changes when the file does."""
    try:
        status = path.stat()
    except OSError:
        return str(path), -1, 0
    return str(path), status.st_size, status.st_mtime_ns


def _changed_utc_s(path: Path) -> float:
    """Whatever date the disk tells: one that can be written down."""
    return min(max(0, _key(path)[2]) / 1e9, _LATEST_CHANGE_UTC_S)
