"""Reading a JSON object strictly: every field is checked, errors name the place, unknown fields are refused."""

from __future__ import annotations

import math
from collections.abc import Collection

from planning.errors import FormatError
from planning.formats.safe_text import clean_name

MISSING = object()


class Fields:
    """The fields of one JSON object; ``where`` leads to it, such as ``world.json: objects[3]``."""

    def __init__(self, value: object, where: str) -> None:
        if not isinstance(value, dict):
            raise FormatError(f"An object in braces belongs here, not {_short(value)}.", where=where)
        self._values: dict[str, object] = value
        self._left = set(self._values)
        self.where = where

    def done(self) -> None:
        """FormatError for a field that nobody asked for: a slip in its name would else change the world unseen."""
        if self._left:
            name = min(self._left)
            raise FormatError(
                f'There is no field "{clean_name(name)}" here.', where=self.where, advice="See docs/worlds.md."
            )

    def raw(self, name: str, default: object = MISSING) -> object:
        self._left.discard(name)
        value = self._values.get(name, default)
        if value is MISSING:
            raise FormatError(f'The field "{name}" is missing.', where=self.where, advice="See docs/worlds.md.")
        return value

    def number(self, name: str, low: float, high: float, default: object = MISSING) -> float:
        return self._number(self.raw(name, default), name, low, high)

    def numbers(self, name: str, count: int, low: float, high: float) -> tuple[float, ...]:
        return self._numbers(self.raw(name), name, count, low, high)

    def pair(self, name: str, low: float, high: float) -> tuple[float, float]:
        first, second = self.numbers(name, 2, low, high)
        return first, second

    def pairs(self, name: str, most: int, low: float, high: float) -> tuple[tuple[float, float], ...]:
        """At least two."""
        values = self.raw(name)
        if not isinstance(values, list) or not 2 <= len(values) <= most:
            raise self._wrong(name, f"2 to {most} pairs of numbers belong here, not {_short(values)}.")
        pairs = [self._numbers(value, f"{name}[{i}]", 2, low, high) for i, value in enumerate(values)]
        return tuple((first, second) for first, second in pairs)

    def word(self, name: str, choices: Collection[str], default: object = MISSING) -> str:
        value = self.raw(name, default)
        if not isinstance(value, str) or value not in choices:
            raise self._wrong(name, f"One of {', '.join(choices)} belongs here, not {_short(value)}.")
        return value

    def text(self, name: str, default: object = MISSING) -> str:
        value = self.raw(name, default)
        if not isinstance(value, str):
            raise self._wrong(name, f"Text belongs here, not {_short(value)}.")
        return value

    def _numbers(self, values: object, name: str, count: int, low: float, high: float) -> tuple[float, ...]:
        if not isinstance(values, list) or len(values) != count:
            raise self._wrong(name, f"{count} numbers in brackets belong here, not {_short(values)}.")
        return tuple(self._number(value, f"{name}[{i}]", low, high) for i, value in enumerate(values))

    def _number(self, value: object, name: str, low: float, high: float) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self._wrong(name, f"A number belongs here, not {_short(value)}.")
        if not (abs(value) <= 1e12 and math.isfinite(value) and low <= value <= high):
            raise self._wrong(name, f"{_short(value)} is not between {low:g} and {high:g}.")
        return float(value)

    def _wrong(self, name: str, what: str) -> FormatError:
        return FormatError(what, where=f"{self.where}.{name}", advice="See docs/worlds.md.")


def _short(value: object) -> str:
    match value:
        case str():
            return f'"{clean_name(value)}"'
        case dict():
            return "an object"
        case list():
            return f"a list of {len(value)}"
        case int() if abs(value) > 1e12:
            return "a number of many digits"
        case _:
            return clean_name(value)
