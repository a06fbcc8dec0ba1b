"""What is there of recordings that are being fetched: for each a note of what it is to be, and its bytes so far.

``SHA256.json``, ``SHA256.part`` and, once it is whole and its SHA-256 is right, ``SHA256.whole.SUFFIX``: names from
outside are no names of files here. Whoever was killed goes on from the bytes that are there.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import msgspec

from telemetry.errors import StationsError
from telemetry.recording.disk_space import WARN_BYTES, Measure, Space, space_at
from telemetry.stations.recordings.asked_and_given import MOST_RECORDING_BYTES, PIECE_BYTES, file_name
from telemetry.stations.station_names import checked_name
from telemetry.topics.station_recordings import RecordingThere

_NOTE_BYTES = 4096
_FULL = (errno.ENOSPC, errno.EDQUOT)
Meta = msgspec.Meta


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    station: str
    sha256: Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]
    name: str
    size_bytes: Annotated[int, Meta(ge=1, le=MOST_RECORDING_BYTES)]
    begin_utc_s: float | None
    end_utc_s: float | None
    vehicle: str
    plan: str

    @property
    def it(self) -> RecordingThere:
        return RecordingThere(
            self.sha256, self.name, self.size_bytes, self.begin_utc_s, self.end_utc_s, self.vehicle, self.plan
        )


def note_of(station: str, it: RecordingThere) -> Note:
    return Note(station, it.sha256, it.name, it.size_bytes, it.begin_utc_s, it.end_utc_s, it.vehicle, it.plan)


class FetchFolder:
    """Blocking calls, for threads. All raise StationsError."""

    def __init__(self, folder: Path, space: Measure = space_at) -> None:
        self._folder, self._space = folder, space

    def begin(self, note: Note, others_need: int = 0) -> int:
        """Bytes that are there already. Refused where there is no room for the whole. ``others_need``: bytes that are
        missing of others that are being fetched."""
        with _told(note.name):
            self._folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            before = _read_note(self._of(note, ".json"))
            if before is None or before.station != note.station:
                # Of another station: whether these bytes are right shows only once all are there.
                self._of(note, ".part").unlink(missing_ok=True)
            have = self.have(note)
            space = self._space(self._folder)
            if note.size_bytes - have + others_need > _room(space):
                raise _no_room(note.name, note.size_bytes - have, others_need, space)
            aside = self._of(note, ".new")
            aside.write_bytes(msgspec.json.encode(note))
            aside.chmod(0o600)
            aside.replace(self._of(note, ".json"))
        return have

    def begun(self) -> list[Note]:
        """Those that a process before this one was fetching, the oldest first; what is no note of one is left alone."""
        notes = list[tuple[float, Note]]()
        try:
            for path in self._folder.glob("*.json"):
                note = _read_note(path)
                if note is not None and path.stem == note.sha256:
                    notes.append((path.stat().st_mtime, note))
        except OSError as error:
            raise StationsError(f"What is being fetched cannot be looked at: {error.strerror}.") from error
        return [note for _, note in sorted(notes, key=lambda each: each[0])]

    def have(self, note: Note) -> int:
        """Bytes that are there, in whole pieces: the last one may have been cut off."""
        if self.whole(note).is_file():
            return note.size_bytes
        part = self._of(note, ".part")
        size = min(part.stat().st_size, note.size_bytes) if part.is_file() and not part.is_symlink() else 0
        return size if size == note.size_bytes else size - size % PIECE_BYTES

    def write(self, note: Note, at: int, data: bytes) -> None:
        with _told(note.name):
            space = self._space(self._folder)
            if len(data) > _room(space):
                raise _no_room(note.name, note.size_bytes - at, 0, space)
            flags = os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC
            file = os.open(self._of(note, ".part"), flags, 0o600)
            try:
                while data:
                    written = os.pwrite(file, data, at)
                    data, at = data[written:], at + written
            finally:
                os.close(file)

    def part(self, note: Note) -> Path:
        return self._of(note, ".part")

    def whole(self, note: Note) -> Path:
        return self._of(note, f".whole{Path(note.name).suffix}")

    def finish(self, note: Note) -> Path:
        """Once its SHA-256 was found right."""
        with _told(note.name):
            part, whole = self._of(note, ".part"), self.whole(note)
            with part.open("rb+") as file:
                os.fsync(file.fileno())
            part.replace(whole)
            return whole

    def delete(self, note: Note) -> None:
        """All of it."""
        with _told(note.name):
            for path in (self._of(note, ".part"), self.whole(note), self._of(note, ".json")):
                path.unlink(missing_ok=True)

    def _of(self, note: Note, suffix: str) -> Path:
        return self._folder / f"{note.sha256}{suffix}"


@contextmanager
def _told(name: str) -> Iterator[None]:
    """Turns the system's errors into ours."""
    try:
        yield
    except OSError as error:
        why = "the disk is full" if error.errno in _FULL else f"the disk does not take it ({error.strerror})"
        raise StationsError(
            f"{name} cannot be fetched: {why}.",
            advice="Free some space or see to the disk, and fetch it again: what is there of it is kept.",
        ) from error


def _kept(space: Space) -> int:
    """What this station's own recorder begins to warn of is its own."""
    return WARN_BYTES + space.reserve


def _room(space: Space) -> int:
    return space.free - _kept(space)


def _no_room(name: str, needs: int, others_need: int, space: Space) -> StationsError:
    others = f", and {others_need / 1e6:.1f} MB of others that are being fetched" if others_need else ""
    return StationsError(
        f"{name} cannot be fetched: {needs / 1e6:.1f} MB of it are missing{others}. Only {space.free / 1e6:.0f} MB are "
        f"free, of which {_kept(space) / 1e6:.0f} MB are kept for this station's own recordings.",
        advice="Delete recordings that nobody needs, and fetch it again: what is there of it is kept.",
    )


def _read_note(path: Path) -> Note | None:
    try:
        if path.is_symlink() or path.stat().st_size > _NOTE_BYTES:
            return None
        note = msgspec.json.decode(path.read_bytes(), type=Note)
        checked_name(note.station)
        file_name(note.name)
    except (msgspec.MsgspecError, OSError, StationsError):
        return None
    return note
