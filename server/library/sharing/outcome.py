"""What came of a push or a pull, kept up while it goes on: whoever stops it can still say what is done."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from planning.errors import DescribedError
from server.library.sharing.shared_items import WORDS, Kind

Tell = Callable[[str, float], None]
"""Step and share, for a line of progress."""


@dataclass(frozen=True, slots=True)
class Done:
    """One thing that was sent or brought; ``name`` is what it is called where it is now."""

    kind: Kind
    name: str
    title: str
    bytes: int

    def words(self) -> str:
        return f"{WORDS[self.kind]} {self.title}"

    def to_json(self) -> dict[str, Any]:
        return {"kind": self.kind, "name": self.name, "title": self.title, "bytes": self.bytes}


@dataclass(frozen=True, slots=True)
class LeftOut:
    what: str
    where: str
    advice: str = ""

    @classmethod
    def of(cls, error: DescribedError, where: str = "") -> LeftOut:
        return cls(error.what, where or error.where, error.advice)

    def words(self) -> str:
        return f"{self.where}: {self.what} {self.advice}".rstrip()

    def to_json(self) -> dict[str, str]:
        return {"what": self.what, "where": self.where, "advice": self.advice}


@dataclass(slots=True)
class Outcome:
    done: list[Done] = field(default_factory=list)
    there: int = 0
    """Things that were there already."""
    moved_bytes: int = 0
    """What really went over the line."""
    left_out: list[LeftOut] = field(default_factory=list)
    stopped: LeftOut | None = None
    """Why the rest was not tried."""

    @property
    def whole(self) -> bool:
        return not self.left_out and self.stopped is None

    def to_json(self) -> dict[str, Any]:
        return {
            "done": [each.to_json() for each in self.done],
            "there": self.there,
            "moved_bytes": self.moved_bytes,
            "left_out": [each.to_json() for each in self.left_out],
            "stopped": None if self.stopped is None else self.stopped.to_json(),
        }
