"""What is uncertain of a flight, as random errors: the terms of the required clearance, each spread about its middle.

A certificate takes every term at its worse end, all at once and in the same direction. Here each is Gaussian in every
direction by itself, with its worse end ``sigmas`` standard deviations away, and it changes along the line as a
stationary Gauss-Markov process: after a distance d it has kept exp(-d / correlation) of what it was. How far an error
reaches along the line is nowhere measured: the lengths below are assumed, and can be set.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from planning.certificate.certificate_model import HomeStand
from planning.errors import ParameterError
from planning.margins.budget import TERM_NAMES, ClearanceBudget, TermCode
from planning.terrain import BOUND_RMS

ErrorCode = Literal["position_error", "following", "dsm_accuracy", "dsm_place"]
EAST, NORTH, UP = 0, 1, 2

AXES: dict[ErrorCode, tuple[int, ...]] = {
    "position_error": (EAST, NORTH, UP),
    "following": (EAST, NORTH, UP),
    "dsm_accuracy": (UP,),
    "dsm_place": (EAST, NORTH),
}
CORRELATION_M: dict[ErrorCode, float] = {
    "position_error": 500.0,
    "following": 15.0,
    "dsm_accuracy": 20.0,
    "dsm_place": math.inf,
}
"""Along the line, assumed: minutes of GNSS, a gust or a corner, a group of cells, all of the model."""
NOT_RANDOM: tuple[TermCode, ...] = ("vehicle_radius", "downwash")
"""The hull is as large as it is; ground effect is no contact."""


@dataclass(frozen=True, slots=True)
class RandomError:
    """One term as what it may be on a flight."""

    code: ErrorCode
    bound_m: float
    """The term's worse end."""
    sigma_m: float
    """Standard deviation in each of its directions."""
    correlation_m: float
    """inf: the same all along one flight."""
    source: str
    """Of the bound, in words."""

    @property
    def name(self) -> str:
        return TERM_NAMES[self.code]

    @property
    def axes(self) -> tuple[int, ...]:
        return AXES[self.code]


@dataclass(frozen=True, slots=True)
class Uncertain:
    """All that a flight's errors are drawn from."""

    errors: tuple[RandomError, ...]
    home_m: tuple[float, float] | None
    """(lowest, highest) by which the whole line may lie higher than planned, for what the vehicle stands on at home;
    evenly spread. None: not known."""
    radius_m: float
    """Of the hull: nearer is a contact."""
    sigmas: float


def uncertain_of(
    budget: ClearanceBudget,
    stand: HomeStand | None,
    *,
    sigmas: float = BOUND_RMS,
    correlation_m: dict[ErrorCode, float] | None = None,
) -> Uncertain:
    """Of a clearance's terms and of home as the certificate judged it. Raises ParameterError for what cannot be."""
    if not 0.0 < sigmas < math.inf:
        raise ParameterError(
            f"A bound of {sigmas:g} standard deviations is none.", where="--sigmas", advice="Give a positive number."
        )
    lengths_m: dict[ErrorCode, float] = {**CORRELATION_M, **(correlation_m or {})}
    for code, length_m in lengths_m.items():
        if not length_m > 0.0:
            raise ParameterError(
                f"The {TERM_NAMES[code]} cannot be alike over {length_m:g} m.",
                where="--correlation-m",
                advice="Give metres along the line, or inf: the same all along a flight.",
            )
    errors = tuple(
        RandomError(code, term.value_m, term.value_m / sigmas, lengths_m[code], term.source)
        for term in budget.terms
        for code in AXES
        if term.code == code and term.value_m > 0.0
    )
    return Uncertain(errors, _home(stand), budget.value_m("vehicle_radius"), sigmas)


def _home(stand: HomeStand | None) -> tuple[float, float] | None:
    if stand is None or not (math.isfinite(stand.drop_m) and math.isfinite(stand.high_dsm_m)):
        return None
    return -stand.drop_m, max(0.0, stand.high_dsm_m - stand.alt_dsm_m)
