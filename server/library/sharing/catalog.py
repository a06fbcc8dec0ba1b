"""What a target holds, read anew for each command: items that are whole and in order, and what is wrong with others."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

from pydantic import ValidationError

from server.errors import TargetError
from server.library.sharing.outcome import LeftOut, Tell
from server.library.sharing.reading_ahead import ahead
from server.library.sharing.shared_items import KINDS, MOST_ITEM_BYTES, FileEntry, Item, digest_of
from server.library.sharing.sharing_targets import BLOBS, ITEMS, Target, item_path

STEP = "Reading the target"
MOST_ITEMS = 200_000
_ENDING = ".json"
VERSIONED = frozenset({"plan", "radar"})
"""Kinds that are changed in place; of them only what nothing was made of is brought."""
UNCHANGING = frozenset({"terrain", "orthophoto"})
"""Kinds whose files never change once they are there, though further ones may come."""


@dataclass(slots=True)
class Catalog:
    items: list[Item] = field(default_factory=list)
    """By kind, name and content."""
    faults: list[LeftOut] = field(default_factory=list)
    damaged: list[str] = field(default_factory=list)
    """Names of items that do not match them; each is among the faults too, as ``damage_of`` says it."""
    blob_sizes: dict[str, int] = field(default_factory=dict)
    item_sizes: dict[str, int] = field(default_factory=dict)

    def contents(self) -> set[str]:
        return {item.content for item in self.items}

    def has(self, digest: str, size: int) -> bool:
        return self.blob_sizes.get(digest) == size

    def missing(self, files: Sequence[FileEntry]) -> list[str]:
        """Blobs that are not there, or not whole."""
        return [digest for entry in files for digest, size in entry.chunk_sizes() if not self.has(digest, size)]

    def by_key(self) -> dict[str, list[Item]]:
        found: dict[str, list[Item]] = defaultdict(list)
        for item in self.items:
            found[item.key].append(item)
        return found


def read_catalog(target: Target, tell: Tell) -> Catalog:
    """Raises TargetError when the target cannot be read; what is wrong with one item is a fault."""
    sizes = target.sizes(ITEMS)
    if len(sizes) > MOST_ITEMS:
        what = f"It holds {len(sizes)} items, more than {MOST_ITEMS}."
        raise TargetError(what, where=target.text, advice="Use a new folder.")
    catalog = Catalog(blob_sizes=target.sizes(BLOBS), item_sizes=sizes)
    names = sorted(name for name in sizes if name.endswith(_ENDING))

    def read(name: str) -> Item | LeftOut:
        return _read_item(target, name)

    for number, (name, found) in enumerate(zip(names, ahead(read, names, target.threads), strict=True)):
        tell(STEP, number / len(names))
        if isinstance(found, LeftOut):
            catalog.faults.append(found)
            if found == damage_of(name):
                catalog.damaged.append(name)
        else:
            catalog.items.append(found)
    catalog.items.sort(key=lambda item: (KINDS.index(item.kind), item.name, item.content, item.title))
    return catalog


def newest(items: Sequence[Item]) -> list[Item]:
    """Of all versions under one key those that no other was made of; all where that would be none.

    Of kinds that are never changed in place every one.
    """
    before = {content for item in items for content in item.after if item.kind in VERSIONED}
    left = [item for item in items if item.content not in before] or list(items)
    return list({item.content: item for item in left}.values())


def damage_of(name: str) -> LeftOut:
    advice = "Push again from where it is; a push sets it aside once it is older than a day."
    return LeftOut("The item is damaged: it does not match its name.", f"{ITEMS}/{name[:80]}", advice)


def _read_item(target: Target, name: str) -> Item | LeftOut:
    """One that cannot be read is a fault as one that is damaged: the others may be whole."""
    where = f"{ITEMS}/{name[:80]}"
    try:
        data = target.read(item_path(name), MOST_ITEM_BYTES)
        if len(data) > MOST_ITEM_BYTES:
            return LeftOut("The item is larger than any can be.", where)
        if f"{digest_of(data)}{_ENDING}" != name:
            return damage_of(name)
        return Item.model_validate_json(data)
    except TargetError as error:
        return LeftOut.of(error, where)
    except ValidationError as error:
        fault = error.errors(include_url=False, include_input=False)[0]
        return LeftOut(f"The item is refused: {' '.join(fault['msg'].split())[:200]}.", where)
