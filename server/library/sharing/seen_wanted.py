"""What was seen comes with the plans that take it in: what no plan names, the next start of Hedgehop would remove."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from server.errors import DamagedError, StorageError, TargetError
from server.library.library import SEEN, kept_texts
from server.library.sharing.chosen import Wanted
from server.library.sharing.fetch import read_blob
from server.library.sharing.outcome import Outcome
from server.library.sharing.shared_items import FileEntry
from server.library.sharing.sharing_targets import Target
from server.library.whole_files import storage_errors


def with_needed_columns(root: Path, target: Target, wanted: list[Wanted], outcome: Outcome) -> list[Wanted]:
    """Without columns that neither a plan here nor one of ``wanted`` names; a model that lacks nothing else is here.

    The plans are read from the target for that. In doubt, where one of them or one here cannot be read, all come.
    """
    columns = {seen_id for each in wanted for entry in each.files if (seen_id := _seen_id(each, entry))}
    if not columns:
        return wanted
    try:
        with storage_errors(root):
            left = _unnamed(columns, kept_texts(root))
        left = _unnamed(left, _plans(target, wanted))
    except (DamagedError, StorageError, TargetError):
        return wanted
    needed: list[Wanted] = []
    for each in wanted:
        files = tuple(entry for entry in each.files if _seen_id(each, entry) not in left)
        if files:
            needed.append(replace(each, files=files))
        else:
            outcome.there += 1
    return needed


def _seen_id(wanted: Wanted, entry: FileEntry) -> str:
    """Empty: it is another file."""
    is_seen = wanted.item.kind == "terrain" and entry.name.startswith(SEEN)
    return Path(entry.name).stem.removeprefix(SEEN) if is_seen else ""


def _unnamed(ids: set[str], texts: Iterable[bytes]) -> set[str]:
    for text in texts if ids else ():
        ids = {each for each in ids if each.encode() not in text}
    return ids


def _plans(target: Target, wanted: list[Wanted]) -> Iterator[bytes]:
    for each in wanted:
        if each.item.kind == "plan":
            chunks = [chunk for entry in each.files for chunk in entry.chunk_sizes()]
            yield b"".join(read_blob(target, digest, size) for digest, size in chunks)
