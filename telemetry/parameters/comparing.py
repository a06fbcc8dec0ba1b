"""Two sets of parameters side by side: only in the one, only in the other, different."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from telemetry.parameters.files import FileParameter
from telemetry.topics.parameters import SINGLE, WHOLE_RANGES, Parameter


@dataclass(frozen=True, slots=True)
class Difference:
    name: str
    here: float
    there: float
    kind: int | None
    """MAV_PARAM_TYPE, as far as known."""


@dataclass(frozen=True, slots=True)
class Comparison:
    """Each in the order of names."""

    only_here: tuple[FileParameter, ...]
    only_there: tuple[FileParameter, ...]
    different: tuple[Difference, ...]
    same: int

    @property
    def is_equal(self) -> bool:
        return not (self.only_here or self.only_there or self.different)


def compare(here: Iterable[FileParameter], there: Iterable[FileParameter]) -> Comparison:
    """Whole numbers to the last digit, others in single precision and as far as a file's decimals go."""
    ours, theirs = {p.name: p for p in here}, {p.name: p for p in there}
    both = sorted(ours.keys() & theirs.keys())
    different = tuple(
        Difference(name, ours[name].value, theirs[name].value, _kind(ours[name], theirs[name]))
        for name in both
        if not is_same(ours[name], theirs[name])
    )
    return Comparison(
        only_here=tuple(ours[name] for name in sorted(ours.keys() - theirs.keys())),
        only_there=tuple(theirs[name] for name in sorted(theirs.keys() - ours.keys())),
        different=different,
        same=len(both) - len(different),
    )


def of_vehicle(parameters: Iterable[Parameter]) -> list[FileParameter]:
    """As lines of a file; those whose value is no number are left out."""
    return [FileParameter(p.name, p.value, 0, p.kind) for p in parameters if p.value is not None]


def is_same(one: FileParameter, other: FileParameter) -> bool:
    if _kind(one, other) in WHOLE_RANGES and max(abs(one.value), abs(other.value)) < 2**24:
        return one.value == other.value
    return math.isclose(one.value, other.value, rel_tol=SINGLE, abs_tol=max(one.rounding, other.rounding))


def _kind(one: FileParameter, other: FileParameter) -> int | None:
    return other.kind if one.kind is None else one.kind
