"""What of this data directory may be sent: surface models, orthophotos, radar files, recordings and plans, no more.

Names are matched against an allow-list (``server.library.sharing.shared_items.ALLOWED``), so that accounts, sessions,
keys and tokens are no candidates, wherever they lie; links are never followed.
"""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from server.errors import StorageError
from server.library import orthophotos, plans, radar_files, recording_list, terrains
from server.library.library import VEHICLES
from server.library.sharing.outcome import LeftOut
from server.library.sharing.shared_items import (
    ALLOWED,
    CHUNK_BYTES,
    MOST_TITLE,
    WORDS,
    FileEntry,
    Item,
    Kind,
    digest_of,
    is_name,
    suffix_of,
)
from server.library.shelf import MANIFEST
from server.library.whole_files import storage_errors
from telemetry.recording.file_types import MCAP_MAGIC

FOLDERS: dict[Kind, str] = {
    "terrain": terrains.FOLDER,
    "orthophoto": orthophotos.FOLDER,
    "radar": radar_files.FOLDER,
    "plan": plans.FOLDER,
    "recording": recording_list.FOLDER,
}
_TITLED: dict[Kind, tuple[str, ...]] = {"plan": ("name",)}
_PLAIN = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_. ")
OnChunk = Callable[[bytes, str], None]


class ChangingError(StorageError):
    """A file that somebody is still writing."""

    code = "changing"


@dataclass(frozen=True, slots=True)
class LocalItem:
    """One thing of this library: the paths of its files, by their names inside the item."""

    kind: Kind
    name: str
    title: str
    files: tuple[tuple[str, Path], ...]

    @property
    def place(self) -> str:
        """As people know it here."""
        return f"{WORDS[self.kind]} {self.title}"

    def file_names(self) -> set[str]:
        return {name for name, _ in self.files}

    def sizes(self) -> dict[str, int]:
        """Raises StorageError when a file has gone."""
        with storage_errors(self.files[0][1]):
            return {name: path.lstat().st_size for name, path in self.files}


def local_items(root: Path) -> tuple[list[LocalItem], list[LeftOut]]:
    """In the order of kinds and names, and what was passed over. Raises StorageError."""
    items: list[LocalItem] = []
    left_out: list[LeftOut] = []
    with storage_errors(root):
        for kind in FOLDERS:
            if kind == "recording":
                continue
            for folder in _entries(root / FOLDERS[kind]):
                if (item := _item_in(folder, kind, left_out)) is not None:
                    items.append(item)
        vehicles = [folder for folder in _entries(root / VEHICLES) if folder.name.isdecimal()]
        for folder in [root, *vehicles]:
            items += _recordings(folder / recording_list.FOLDER, left_out)
    return items, left_out


def item_of(local: LocalItem, after: tuple[str, ...] = (), on_chunk: OnChunk = lambda chunk, digest: None) -> Item:
    """Reads all of it, a chunk at a time. Raises ChangingError, StorageError."""
    before = _state(local)
    entries: list[FileEntry] = []
    for name, path in local.files:
        chunks: list[str] = []
        size = 0
        for chunk in read_chunks(path):
            digest = digest_of(chunk)
            on_chunk(chunk, digest)
            chunks.append(digest)
            size += len(chunk)
        entries.append(FileEntry(name=name, bytes=size, chunks=tuple(chunks)))
    if _state(local) != before or {entry.name: entry.bytes for entry in entries} != local.sizes():
        raise _changing(local.place)
    try:
        return Item(kind=local.kind, name=local.name, title=local.title, files=tuple(entries), after=after)
    except ValidationError as error:  # a model with more files than an item takes
        fault = " ".join(error.errors(include_url=False, include_input=False)[0]["msg"].split())[:200]
        raise StorageError(f"It cannot be an item of a target: {fault}.", where=local.place) from error


def read_chunks(path: Path) -> Iterator[bytes]:
    """Raises StorageError, also for what is no regular file; ChangingError for one that grows as it is read."""
    with storage_errors(path):
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
        with open(handle, "rb", buffering=0) as file:
            status = os.fstat(handle)
            if not stat.S_ISREG(status.st_mode):
                raise StorageError("This is no regular file.", where=str(path))
            left = status.st_size
            while chunk := _next_chunk(file.read):
                left -= len(chunk)
                if left < 0:
                    raise _changing(str(path))
                yield chunk


def _next_chunk(read: Callable[[int], bytes | None]) -> bytes:
    """Whole, but for the last one: a network's disk may give less than it was asked for."""
    chunk = read(CHUNK_BYTES) or b""
    while 0 < len(chunk) < CHUNK_BYTES and (more := read(CHUNK_BYTES - len(chunk))):
        chunk += more
    return chunk


def _state(local: LocalItem) -> list[tuple[int, ...]]:
    """Differs when a file was written to or replaced. Raises StorageError."""
    with storage_errors(local.files[0][1]):
        states = [path.lstat() for _, path in local.files]
    return [(s.st_dev, s.st_ino, s.st_size, s.st_mtime_ns, s.st_ctime_ns) for s in states]


def _changing(place: str) -> ChangingError:
    return ChangingError("It is being written.", where=place, advice="Run the command again once it is finished.")


def _entries(folder: Path) -> list[Path]:
    """Without what is hidden or half-written."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


def _item_in(folder: Path, kind: Kind, left_out: list[LeftOut]) -> LocalItem | None:
    place = f"{folder.parent.name}/{folder.name}"
    if folder.is_symlink() or not folder.is_dir() or not is_name(kind, folder.name):
        left_out.append(LeftOut(f"This is no folder of a {WORDS[kind]}.", place))
        return None
    files: list[tuple[str, Path]] = []
    for path in _entries(folder):
        if ALLOWED[kind].fullmatch(path.name) and path.is_file() and not path.is_symlink():
            files.append((path.name, path))
        else:
            left_out.append(LeftOut(f"This is no file of a {WORDS[kind]}.", f"{place}/{path.name}"))
    title = _title(folder / MANIFEST, kind)
    if title is None or MANIFEST not in dict(files):
        advice = "The next start of Hedgehop sets it aside."
        left_out.append(LeftOut(f"Its {MANIFEST} is missing or damaged.", place, advice))
        return None
    return LocalItem(kind, folder.name, title, tuple(files))


def _title(manifest: Path, kind: Kind) -> str | None:
    try:
        told = json.loads(manifest.read_bytes())
        for key in _TITLED.get(kind, ("doc", "name")):
            told = told[key]
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    return readable(told) if isinstance(told, str) else None


def _recordings(folder: Path, left_out: list[LeftOut]) -> Iterator[LocalItem]:
    for path in _entries(folder):
        if path.is_symlink() or not path.is_file() or suffix_of(path.name) not in recording_list.KINDS:
            left_out.append(LeftOut("This is no recording.", f"{folder.name}/{path.name}"))
            continue
        suffix = suffix_of(path.name)
        if suffix == ".mcap" and not is_closed(path):
            advice = "Run the command again once it is finished; one that broke off is mended when Hedgehop starts."
            what = "This recording is being written, or broke off."
            left_out.append(LeftOut(what, f"{folder.name}/{path.name}", advice))
            continue
        yield LocalItem("recording", plain_name(path.name), readable(path.name), ((f"recording{suffix}", path),))


def is_closed(path: Path) -> bool:
    """Whether an MCAP file has its end; one that cannot be read has none."""
    try:
        with path.open("rb") as file:
            head, size = file.read(len(MCAP_MAGIC)), os.fstat(file.fileno()).st_size
            file.seek(max(len(MCAP_MAGIC), size - len(MCAP_MAGIC)))
            return head == MCAP_MAGIC == file.read()
    except OSError:
        return False


def readable(title: str) -> str:
    """Short enough, and without bytes that are no text, as file names may have them."""
    return title[:MOST_TITLE].encode(errors="replace").decode()


def plain_name(name: str) -> str:
    """A recording's file name as every system takes it; unchanged where it is one."""
    if is_name("recording", name):
        return name
    suffix = suffix_of(name)
    stem = "".join(char if char in _PLAIN else "_" for char in name[: -len(suffix)]).strip(" ._-")[:90]
    return f"{stem}{suffix}" if is_name("recording", f"{stem}{suffix}") else f"recording-{stem}{suffix}"
