"""Which items of a target are to be brought, and under what name: decided before anything is written.

What is here stays as it is. A recording of a name that is taken comes as ``NAME-<content>``, a plan that was changed
on both sides under an id made of its content; surface models take the files that they lack.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from server.errors import StorageError
from server.library.sharing.catalog import VERSIONED, Catalog, newest
from server.library.sharing.local_items import FOLDERS, LocalItem, item_of
from server.library.sharing.outcome import LeftOut, Outcome, Tell
from server.library.sharing.shared_items import WORDS, FileEntry, Item, differ, suffix_of
from server.library.sharing.versions import Versions

STEP = "Comparing"
_SHORT, _ID = 8, 16


@dataclass(frozen=True, slots=True)
class Wanted:
    """``files``: those that are missing here and needed."""

    item: Item
    name: str
    files: tuple[FileEntry, ...]

    @property
    def bytes(self) -> int:
        return sum(entry.bytes for entry in self.files)


@dataclass(slots=True)
class Here:
    """What this library has, as far as the target has anything like it."""

    contents: set[str] = field(default_factory=set)
    files: dict[str, dict[str, FileEntry]] = field(default_factory=dict)
    """By key, then by name inside the item."""
    held: dict[str, str] = field(default_factory=dict)
    """By key, the content that stands under it."""
    taken: set[str] = field(default_factory=set)
    """Keys where nothing stood and one is to stand now, which was made of none of the others that are newest."""


def compare(local: Sequence[LocalItem], catalog: Catalog, tell: Tell) -> Here:
    """Reads what may be the same: one whose sizes no item has is another one, unless it has an item's id."""
    sizes = {(item.kind, _sizes(item.files)) for item in catalog.items}
    keys = {item.key for item in catalog.items if item.kind != "recording"}
    here = Here()
    for number, each in enumerate(local):
        tell(STEP, number / len(local))
        key = f"{each.kind}/{each.name}"
        try:
            if key in keys or (each.kind, frozenset(each.sizes().items())) in sizes:
                item = item_of(each)
                here.contents.add(item.content)
                here.held[key] = item.content
                here.files[key] = {entry.name: entry for entry in item.files}
        except StorageError:  # gone or written meanwhile: not the same as anything
            here.files[key] = {}
    return here


def choose(catalog: Catalog, here: Here, root: Path, versions: Versions, outcome: Outcome) -> list[Wanted]:
    """In the catalog's order. What cannot be brought is said in ``outcome``, what is here is counted."""
    wanted: list[Wanted] = []
    for items in catalog.by_key().values():
        for item in newest(items):
            found = _one(item, here, root, versions)
            if found is None:
                outcome.there += 1
                continue
            if isinstance(found, Wanted) and (missing := catalog.missing(found.files)):
                what = f"{len(missing)} of its blobs are missing or torn, the first is {missing[0]}."
                found = LeftOut(what, _place(item), "Push again from a machine that has it.")
            if isinstance(found, LeftOut):
                outcome.left_out.append(found)
                continue
            wanted.append(found)
            if found.name == item.name and item.key not in here.files:
                here.taken.add(item.key)
            here.contents.add(item.content)
            files = here.files.setdefault(f"{item.kind}/{found.name}", {})
            files |= {entry.name: entry for entry in found.files}
    return wanted


def _one(item: Item, here: Here, root: Path, versions: Versions) -> Wanted | LeftOut | None:
    """None: it is here."""
    if item.content in here.contents:
        return None
    if item.kind == "recording":
        return Wanted(item, _free_name(item, here, root), item.files)
    is_here = item.key in here.files
    if not is_here and _exists(root, item, item.name):
        what = f"A damaged {WORDS[item.kind]} stands here under its id."
        return LeftOut(what, _place(item), "Start Hedgehop once, which sets it aside, and pull again.")
    if not is_here:
        return Wanted(item, item.name, item.files)
    if item.kind in VERSIONED and item.key not in here.taken and item.content in versions.had(item.key):
        return None  # what is here was made of it
    if item.kind == "plan":
        name = item.content[:_ID]
        return None if f"plan/{name}" in here.files or _exists(root, item, name) else Wanted(item, name, item.files)
    mine = here.files[item.key]
    if differ(item.files, mine):
        advice = "Both stay where they are; to have the target's, delete the one here first."
        return LeftOut(f"The {WORDS[item.kind]} here has the same id and other content.", _place(item), advice)
    lacking = tuple(entry for entry in item.files if entry.name not in mine)
    return Wanted(item, item.name, lacking) if lacking else None


def _free_name(item: Item, here: Here, root: Path) -> str:
    suffix = suffix_of(item.name)
    stem = item.name[: -len(suffix)]
    names = [item.name, *(f"{stem}-{item.content[:length]}{suffix}" for length in (_SHORT, _ID, len(item.content)))]
    free = (name for name in names if f"recording/{name}" not in here.files and not _exists(root, item, name))
    return next(free, names[-1])


def _exists(root: Path, item: Item, name: str) -> bool:
    path = root / FOLDERS[item.kind] / name
    return path.exists() or path.is_symlink()


def _sizes(files: Sequence[FileEntry]) -> frozenset[tuple[str, int]]:
    return frozenset((entry.name, entry.bytes) for entry in files)


def _place(item: Item) -> str:
    return f"{WORDS[item.kind]} {item.title}"
