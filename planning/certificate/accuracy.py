"""What a surface model tells of its own accuracy, in the clearance that is demanded over it."""

from __future__ import annotations

from dataclasses import replace

from planning.certificate.certificate_model import ClearanceParams
from planning.margins.budget import ClearanceBudget, Term
from planning.margins.words import is_by_hand
from planning.terrain import BOUND_RMS


def with_accuracy(params: ClearanceParams, rms_m: float | None) -> ClearanceParams:
    """The same, allowing for no less than the RMS error that a surface model tells; None: it tells none.

    A required clearance that was set by hand stays; then it covers less.
    """
    budget = params.budget
    if budget is None or rms_m is None:
        return params
    short_m = BOUND_RMS * rms_m - budget.value_m("dsm_accuracy")
    if short_m <= 0.0:
        return params
    grown = _told_by_model(budget, rms_m)
    if is_by_hand(budget, params.required_clearance_m):
        return replace(params, budget=grown)
    return replace(params, budget=grown, required_clearance_m=params.required_clearance_m + short_m)


def _told_by_model(budget: ClearanceBudget, rms_m: float) -> ClearanceBudget:
    source = f"{BOUND_RMS:g} x RMS error of {rms_m:g} m, told with the surface model"
    told = Term("dsm_accuracy", BOUND_RMS * rms_m, source)
    return ClearanceBudget(tuple(told if term.code == "dsm_accuracy" else term for term in budget.terms))
