"""A certificate in a few lines for the terminal."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from planning.missions.feasibility import verdict_words
from planning.report.words import metres, metres_up


def verdict_lines(summary: dict[str, Any]) -> list[str]:
    """What a summary says. Clearances are rounded down and demands up, so that none is flattered."""
    lines = [
        verdict_words(certified=summary["certified"], feasible=summary["feasible"]),
        f"  distance to the surface model: at least {_least(summary['min_distance_m'])}, "
        f"required {metres_up(summary['required_clearance_m'])}",
        *_budget_lines(summary),
        f"  height above it: at least {_least(summary['min_vertical_m'])}",
        f"  nearest {_place(summary['worst'])}",
        f"  way home: {_way_home(summary)}",
        f"  home: {_home(summary)}",
    ]
    if (fence := summary["fence"]) is not None:
        lines.append(f"  fence: {_fence(fence)}")
    if detours := summary.get("detours"):
        lines.append(f"  laid around: {_around(detours)}")
    if (survey := summary.get("survey")) is not None:
        lines.append(f"  photos: {photos_words(survey)}")
    lines += [f"  - {reason['text']} {reason['mend']}" for reason in summary["reasons"]]
    lines += [f"  - {row['text']} {row['mend']}" for row in summary["feasibility"] if row["state"] == "fails"]
    return lines


def photos_words(survey: dict[str, Any]) -> str:
    """Shares are rounded down, as clearances are."""
    return (
        f"{survey['photos']}, {_percent(survey['photographed_share'])} of {survey['area_m2']:,.0f} m² photographed, "
        f"{_percent(survey['twice_share'])} at least twice; overlap over the surface "
        f"{_percent(survey['front_overlap'])} front, {_percent(survey['side_overlap'])} side "
        f"({_percent(survey['asked_front_overlap'])}, {_percent(survey['asked_side_overlap'])} asked)"
    )


def _fence(fence: dict[str, Any]) -> str:
    """The nearest that the flight comes to what its fence forbids."""
    verb = "kept" if fence["keeps"] else "NOT kept"
    if fence["min_distance_m"] is None:
        return f"{verb}; it has no shapes, only heights"
    part = {"line": "the line", "home": "a way home", "rally": "a way to a rally point"}[fence["part"]]
    return (
        f"{verb}: {part} comes within {metres(fence['min_distance_m'])} of {fence['shape']} at "
        f"{fence['lat_deg']:.7f}, {fence['lon_deg']:.7f}; the vehicle needs {metres_up(fence['margin_m'])}"
    )


def _around(detours: list[dict[str, Any]]) -> str:
    counts = Counter(detour["shape"] for detour in detours)
    return ", ".join(f"{shape} ({count} point{'s' * (count > 1)})" for shape, count in counts.items())


def _percent(share: float | None) -> str:
    return f"{math.floor(max(0.0, share or 0.0) * 100 + 1e-6)} %"


def _budget_lines(summary: dict[str, Any]) -> list[str]:
    """What the required clearance is for, and the tube that is proved."""
    budget = summary["clearance_budget"]
    terms = " + ".join(f"{term['name']} {metres_up(term['value_m'])}" for term in budget["terms"])
    by_hand = f", set by hand; the terms come to {metres_up(budget['total_m'])}" if budget["set_by_hand"] else ""
    left_out = ", ".join(f"{metres_up(part['missing_m'])} of {part['name']}" for part in budget["uncovered"])
    return [
        f"  required for: {terms}{by_hand}",
        *([f"  NOT covered: {left_out}"] if left_out else []),
        f"  {summary['tube']['statement']}",
    ]


def leg_lines(legs: list[dict[str, Any]]) -> list[str]:
    """One line per leg: where it leads, and how near it comes."""
    return [
        f"  leg {leg['leg'] + 1} to item {leg['item'] + 1}: {_least(leg['min_distance_m'])} from the surface model "
        f"{leg['at_s_m']:.1f} m along the line, {_least(leg['min_vertical_m'])} above it"
        for leg in legs
    ]


def _place(worst: dict[str, Any]) -> str:
    if worst["lat_deg"] is None:
        return f"on leg {worst['leg'] + 1}, beyond the range of the map grid"
    place = f"at {worst['lat_deg']:.7f}, {worst['lon_deg']:.7f}"
    return f"{place}, {worst['alt_rel_home_m']:.2f} m above home, on leg {worst['leg'] + 1}"


def _home(summary: dict[str, Any]) -> str:
    """Whether a vehicle can stand there, and what the line keeps if it stands as low as it may."""
    clear = "clear" if summary["home_column_clear"] else "NOT clear"
    home = summary["home"]
    if home is None or home["drop_m"] is None:
        return f"column {clear}, the ground around it is not all known"
    low = f"as low as {metres_up(home['drop_m'])} below where heights are counted from"
    return f"column {clear}; the vehicle may stand {low}: the line then keeps {_least(home['min_distance_m'])}"


def _way_home(summary: dict[str, Any]) -> str:
    needed_m, set_m = summary["rtl_height_needed_m"], summary["rtl_height_m"]
    if needed_m is None:
        return "leads over unknown terrain"
    verb = "clear" if needed_m <= set_m else "NOT clear"
    return f"{verb} at the return height of {metres(set_m)} above home, needed {metres_up(needed_m)}"


def _least(value_m: float | None) -> str:
    """JSON's null stands for a height over unknown terrain."""
    return metres(-math.inf if value_m is None else value_m)
