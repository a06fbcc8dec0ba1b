"""One line of the table: what is promised, what was measured, and by what."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import Literal

Verdict = Literal["holds", "FAILS"]


@dataclass(frozen=True, slots=True)
class Row:
    """``by``: the command that tries it again."""

    name: str
    promise: str
    verdict: Verdict
    figure: str
    by: str = ""

    def __str__(self) -> str:
        words = f"{self.name:<4}{self.verdict:<7}{self.promise}"
        rest = [self.figure, self.by and f"by {self.by}"]
        return "\n".join([words, *(textwrap.indent(line, " " * 11) for line in rest if line)])


def judged(held: bool) -> Verdict:
    return "holds" if held else "FAILS"
