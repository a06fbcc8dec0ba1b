"""The required clearance as a sum of named terms, each with its source, and what a smaller one leaves uncovered.

The terms are added as they are, not as squares: each stands at its worse end, and nothing keeps all of them
from pointing the same way at the same place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

TermCode = Literal["vehicle_radius", "position_error", "following", "dsm_accuracy", "dsm_place", "downwash"]

TERM_NAMES: dict[TermCode, str] = {
    "vehicle_radius": "vehicle radius",
    "position_error": "position error",
    "following": "following the line",
    "dsm_accuracy": "accuracy of the surface model",
    "dsm_place": "place of what the surface model shows",
    "downwash": "rotor downwash",
}
"""In the order in which a smaller clearance is spent: what ends in a contact first, ground effect last."""
SUM_RULE = "the sum of all terms, each at its worse end"
_ENOUGH_M = 1e-9


@dataclass(frozen=True, slots=True)
class Term:
    """One part of the required clearance."""

    code: TermCode
    value_m: float
    source: str
    """Where the value comes from, in words."""

    @property
    def name(self) -> str:
        return TERM_NAMES[self.code]


@dataclass(frozen=True, slots=True)
class Uncovered:
    """A term of which a required clearance that was set by hand leaves a part out."""

    code: TermCode
    missing_m: float

    @property
    def name(self) -> str:
        return TERM_NAMES[self.code]


@dataclass(frozen=True, slots=True)
class ClearanceBudget:
    """The terms of one vehicle, flown one way, in the order of ``TERM_NAMES``."""

    terms: tuple[Term, ...]

    @property
    def total_m(self) -> float:
        return sum(term.value_m for term in self.terms)

    def value_m(self, code: TermCode) -> float:
        """Of one term; 0 where there is none."""
        return next((term.value_m for term in self.terms if term.code == code), 0.0)

    def with_value(self, code: TermCode, value_m: float) -> ClearanceBudget:
        """The same with another value for one term."""
        return ClearanceBudget(tuple(replace(t, value_m=value_m) if t.code == code else t for t in self.terms))

    def with_least(self, least: Term) -> ClearanceBudget:
        """The same with this term in the place of a smaller one of its code, or of none."""
        if any(term.code == least.code and term.value_m >= least.value_m for term in self.terms):
            return self
        order = tuple(TERM_NAMES)
        terms = (*(term for term in self.terms if term.code != least.code), least)
        return ClearanceBudget(tuple(sorted(terms, key=lambda term: order.index(term.code))))

    def uncovered_by(self, required_m: float) -> tuple[Uncovered, ...]:
        """What a required clearance does not cover: it is spent on one term after the other."""
        left_m, uncovered = required_m, []
        for term in self.terms:
            missing_m = term.value_m - max(0.0, left_m)
            left_m -= term.value_m
            if missing_m > _ENOUGH_M:
                uncovered.append(Uncovered(term.code, missing_m))
        return tuple(uncovered)
