"""The crews' checklists, one for each vehicle profile that has one, in one file of the data directory."""

from __future__ import annotations

import hashlib
import threading
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from planning.errors import FormatError
from server.errors import ConflictError, StorageError
from server.library.shelf import utc_now
from server.library.whole_files import storage_errors, write_atomically
from telemetry.topics.checklist import ChecklistPoint, points_of

FILE = "checklists.json"
MOST_LISTS, MOST_UNLOGGED = 200, 500


@dataclass(frozen=True, slots=True)
class Change:
    """A text that took the place of another one."""

    revision: str
    points: int
    by: str
    utc: str


@dataclass(frozen=True, slots=True)
class KeptChecklist:
    text: str = ""
    before: str | None = None
    """The text that the last change replaced, so that it can be taken back."""
    changed_by: str = ""
    changed_utc: str = ""
    unlogged: tuple[Change, ...] = ()
    """Of which the log of commands does not know yet: it is kept by the link, which need not run."""

    @property
    def revision(self) -> str:
        """Of the text as it was written."""
        return hashlib.sha256(self.text.encode()).hexdigest()


class Checklists:
    """Read once, at the start. A file that cannot be read is left as it is: no list is taken for an empty one."""

    def __init__(self, root: Path) -> None:
        self._file, self._change = root / FILE, threading.Lock()
        self._fault: StorageError | None = None
        self._lists: dict[str, KeptChecklist] = {}
        self._points: dict[str, tuple[ChecklistPoint, ...]] = {}
        try:
            self._lists = _read(self._file)
            self._points = {profile: points_of(kept.text, where=FILE) for profile, kept in self._lists.items()}
        except StorageError as error:
            self._fault = error
        except FormatError as error:
            self._fault = _unreadable(error.what)

    def of(self, profile: str) -> KeptChecklist:
        """An empty one where nobody has written any. Raises StorageError."""
        self._check()
        return self._lists.get(profile, KeptChecklist())

    def points(self, profile: str) -> tuple[ChecklistPoint, ...]:
        """What a start with this profile demands; nothing of an empty list. Raises StorageError."""
        self._check()
        return self._points.get(profile, ())

    def write(self, profile: str, text: str, *, instead_of: str, by: str) -> KeptChecklist:
        """Blocks. ``instead_of``: the revision that the writer has seen.

        Raises FormatError for what is too long, ConflictError where somebody else has changed it meanwhile.
        """
        text = _tidy(text)
        points = points_of(text)
        with self._change:
            now = self.of(profile)
            if instead_of != now.revision:
                raise ConflictError(
                    f"{now.changed_by or 'Somebody'} has changed this checklist meanwhile.",
                    advice="Copy what you have written, close the list and open it again.",
                )
            if text == now.text:
                return now
            kept = KeptChecklist(text, now.text if now.changed_utc else None, by, utc_now())
            if len(now.unlogged) >= MOST_UNLOGGED:
                advice = "Connect to a vehicle once: what was changed is written down then."
                raise ConflictError(f"{MOST_UNLOGGED} changes wait for the log of commands.", advice=advice)
            change = Change(kept.revision, len(points), by, kept.changed_utc)
            kept = replace(kept, unlogged=(*now.unlogged, change))
            lists = self._lists | {profile: kept}
            if len(lists) > MOST_LISTS:
                advice = f"Remove those that nobody needs from {FILE} while Hedgehop does not run."
                raise ConflictError(f"There are {MOST_LISTS} checklists already.", advice=advice)
            self._keep(lists)
            self._points = self._points | {profile: points}
        return kept

    @property
    def unlogged(self) -> list[tuple[str, Change]]:
        """Changes of which the log of commands does not know yet, each with its profile, in their order."""
        return [(profile, change) for profile, kept in self._lists.items() for change in kept.unlogged]

    def logged(self, profile: str, change: Change) -> None:
        """The log of commands knows of it, also where that cannot be kept: then it stands there again after the next
        start of the server. Blocks. Raises StorageError."""
        with self._change:
            kept = self._lists[profile]
            left = tuple(each for each in kept.unlogged if each != change)
            self._lists = self._lists | {profile: replace(kept, unlogged=left)}
            self._keep(self._lists)

    def _keep(self, lists: dict[str, KeptChecklist]) -> None:
        write_atomically(self._file, msgspec.json.format(msgspec.json.encode(lists)))
        self._lists = lists

    def _check(self) -> None:
        if self._fault is not None:
            raise self._fault


def _read(file: Path) -> dict[str, KeptChecklist]:
    with storage_errors(file):
        if not file.is_file():
            return {}
        data = file.read_bytes()
    try:
        return msgspec.json.decode(data, type=dict[str, KeptChecklist])
    except (msgspec.MsgspecError, UnicodeDecodeError) as error:
        raise _unreadable(str(error)) from error


def _unreadable(why: str) -> StorageError:
    return StorageError(
        f"The checklists cannot be read, so nobody knows what a start demands: {why}",
        where=FILE,
        advice="Mend the file or move it away, then start Hedgehop again.",
    )


def _tidy(text: str) -> str:
    lines = [line.rstrip() for line in text.splitlines()]
    return "\n".join(lines).strip("\n") + "\n" if any(lines) else ""
