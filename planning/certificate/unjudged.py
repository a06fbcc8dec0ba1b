"""What cannot be judged in a mission, in words: each cause once, however many items share it."""

from __future__ import annotations

from collections.abc import Sequence

from planning.basics.plan_model import FlownLine, Unjudged
from planning.certificate.certificate_model import Reason

MOST_RANGES = 3


def unjudged_reasons(line: FlownLine) -> list[Reason]:
    """One for each cause, however many items share it."""
    return [Reason("unjudged", text, mend) for text, mend in unjudged_words(line.unjudged)]


def unjudged_words(unjudged: Sequence[Unjudged]) -> list[tuple[str, str]]:
    """(sentence, mend) of each cause once, with the items that share it."""
    causes: dict[tuple[str, str, int | None], list[int]] = {}
    for each in unjudged:
        items = causes.setdefault((each.why, each.mend, each.command), [])
        if each.item is not None:
            items.append(each.item + 1)
    return [(_sentence(why, command, items), mend) for (why, mend, command), items in causes.items()]


def _sentence(why: str, command: int | None, items: list[int]) -> str:
    if not items:
        return why
    if len(items) == 1:
        return f"Item {items[0]} (command {command}) {why}"
    return f"{len(items)} items (command {command}: {_ranges(items)}), each {why}"


def _ranges(numbers: list[int]) -> str:
    """ "3 to 7, 9 and 12 more", at most three parts."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    shown = [f"{p[0]}" if len(p) == 1 else f"{p[0]} to {p[-1]}" for p in parts[:MOST_RANGES]]
    rest = sum(len(p) for p in parts[MOST_RANGES:])
    return ", ".join(shown) + (f" and {rest} more" if rest else "")
