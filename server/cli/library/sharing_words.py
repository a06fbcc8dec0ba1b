"""What ``hedgehop library`` says: progress, what came of it, what a target holds."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from server.cli.shared.output import harmless, progress
from server.library.sharing.catalog import Catalog, newest
from server.library.sharing.outcome import Outcome
from server.library.sharing.shared_items import KINDS, WORDS, Item

_AFTER_S, _EVERY_S = 0.5, 0.1


class Telling:
    """A line of progress from half a second on, at most ten times a second."""

    def __init__(self) -> None:
        self._next_s = time.monotonic() + _AFTER_S

    def tell(self, step: str, share: float) -> None:
        if (now_s := time.monotonic()) >= self._next_s:
            self._next_s = now_s + _EVERY_S
            progress(step, share)


@dataclass(frozen=True, slots=True)
class Listed:
    item: Item
    is_older: bool
    """Another version in the target was made of it."""
    missing_blobs: int

    def words(self) -> str:
        notes = [f"{self.missing_blobs} blobs missing or torn"] if self.missing_blobs else []
        notes += ["older version"] if self.is_older else []
        note = f"  ({', '.join(notes)})" if notes else ""
        return f"{WORDS[self.item.kind]:13s}  {megabytes(self.item.bytes):>12s}  {self.item.title}{note}"

    def to_json(self) -> dict[str, Any]:
        item = self.item
        return {
            "kind": item.kind,
            "name": item.name,
            "title": item.title,
            "bytes": item.bytes,
            "content": item.content,
            "older": self.is_older,
            "missing_blobs": self.missing_blobs,
        }


def listed(catalog: Catalog) -> list[Listed]:
    """Each content once, in the order of kinds and names."""
    entries: list[Listed] = []
    for items in catalog.by_key().values():
        current = {item.content for item in newest(items)}
        for item in {item.content: item for item in items}.values():
            entries.append(Listed(item, item.content not in current, len(catalog.missing(item.files))))
    return entries


def outcome_lines(outcome: Outcome, done: str, there: str) -> Iterator[str]:
    """For people: what was done, counted by kind, with each thing's name as long as they are few."""
    for each in outcome.done[:20]:
        yield harmless(f"{done}: {each.words()}, {megabytes(each.bytes)}" + _renamed(each.name, each.title))
    if len(outcome.done) > 20:
        counts = Counter(each.kind for each in outcome.done[20:])
        yield f"{done} further: " + ", ".join(f"{counts[kind]} {WORDS[kind]}s" for kind in KINDS if counts[kind])
    yield (
        f"{done} {len(outcome.done)} things, {megabytes(outcome.moved_bytes)} over the line; "
        f"{outcome.there} {there}, {len(outcome.left_out)} left out."
    )


def megabytes(size: int) -> str:
    return f"{size / 1e6:.2f} MB"


def _renamed(name: str, title: str) -> str:
    """A recording's name where it is another one than it was pushed under."""
    return f", as {name}" if "." in name and name != title else ""
