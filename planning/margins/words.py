"""The terms of the required clearance, the tube and what is not covered, as sentences and as JSON."""

from __future__ import annotations

import math
from typing import Any

from planning.margins.budget import SUM_RULE, ClearanceBudget

_SAME_M = 1e-6


def budget_json(budget: ClearanceBudget | None, required_m: float) -> dict[str, Any] | None:
    """Terms with their sources, their sum, and what the required clearance leaves out."""
    if budget is None:
        return None
    return {
        "terms": [{"code": t.code, "name": t.name, "value_m": t.value_m, "source": t.source} for t in budget.terms],
        "rule": SUM_RULE,
        "total_m": budget.total_m,
        "set_by_hand": is_by_hand(budget, required_m),
        "uncovered": [
            {"code": part.code, "name": part.name, "missing_m": part.missing_m}
            for part in budget.uncovered_by(required_m)
        ],
    }


def tube_json(following_m: float, min_distance_m: float, required_m: float) -> dict[str, Any]:
    """What is proved of everything within the following distance of the line."""
    return {
        "radius_m": following_m,
        "min_distance_m": min_distance_m - following_m,
        "required_m": max(0.0, required_m - following_m),
        "statement": tube_words(following_m, min_distance_m),
    }


def is_by_hand(budget: ClearanceBudget, required_m: float) -> bool:
    """Whether the required clearance is another than the sum of its terms."""
    return abs(required_m - budget.total_m) > _SAME_M


def tube_words(following_m: float, min_distance_m: float) -> str:
    """Every point within ``following_m`` of the line is at most that much nearer to any column."""
    if following_m <= 0:
        return "The proof is of the line alone: nothing is allowed for how the autopilot departs from it."
    tube_m = rounded_up(following_m)
    if min_distance_m <= following_m:
        return f"Within {tube_m} m of the line, where the autopilot may fly, the surface model is touched."
    return (
        f"The proof is of a tube: everything within {tube_m} m of the line, where the autopilot may fly,"
        f" keeps at least {rounded_down(min_distance_m - following_m)} m from the surface model."
    )


def uncovered_words(budget: ClearanceBudget | None, required_m: float) -> str | None:
    """What a clearance that was set by hand does not cover; None when it covers everything."""
    parts = () if budget is None else budget.uncovered_by(required_m)
    if budget is None or not parts:
        return None
    missing = ", ".join(f"{rounded_up(part.missing_m)} m of {part.name}" for part in parts)
    return (
        f"The required clearance of {rounded_up(required_m)} m was set by hand; all terms together come to"
        f" {rounded_up(budget.total_m)} m. It does not cover {missing}."
    )


def rounded_up(value_m: float) -> str:
    """Centimetres, for what is demanded."""
    return f"{math.ceil(value_m * 100 - 1e-6) / 100:.2f}"


def rounded_down(value_m: float) -> str:
    """Centimetres, so that no clearance is flattered."""
    return f"{math.floor(value_m * 100 + 1e-6) / 100:.2f}"
