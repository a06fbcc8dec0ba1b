"""What a mission was planned for, as its own files carry it: vehicle, way of flying, what is demanded of the line."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

from planning.basics.plan_model import PlannedFor
from planning.errors import FormatError, PlanningError
from planning.formats.safe_text import finite, load_json
from planning.margins.following_error import WAY_NAMES
from planning.missions.vehicle_profile import check_profile, profile_from_table

_KEYS = ("profile", "way", "required_clearance_m", "max_height_above_ground_m")


def planned_for_json(planned: PlannedFor) -> dict[str, Any]:
    """Plain JSON values; what is left to Hedgehop (null in the profile) is left out."""
    return asdict(planned) | {"profile": {k: v for k, v in asdict(planned.profile).items() if v is not None}}


def planned_for_line(planned: PlannedFor) -> str:
    """The same in one line of ASCII."""
    return json.dumps(planned_for_json(planned), allow_nan=False, separators=(",", ":"))


def read_planned_for(value: object, where: str, warnings: list[str]) -> PlannedFor | None:
    """From parsed JSON, or a line of it; None, with a warning, when it makes no sense."""
    try:
        return _planned_for(load_json(where, value) if isinstance(value, str) else value, where)
    except PlanningError as error:
        warnings.append(f"What the mission was planned for cannot be read and is left out: {error.what}")
        return None


def _planned_for(value: object, where: str) -> PlannedFor:
    if not isinstance(value, dict) or not isinstance(value.get("profile"), dict) or not set(value) <= set(_KEYS):
        raise FormatError("It is no vehicle with its demands.", where=where)
    way = value.get("way", "auto")
    if way not in WAY_NAMES:
        raise FormatError(f"{way!r} is no way to fly.", where=where)
    profile = profile_from_table(value["profile"], where=where)
    check_profile(profile, where=where)
    required_m, highest_m = (_length(value, key, where) for key in _KEYS[2:])
    return PlannedFor(profile, "guided" if way == "guided" else "auto", required_m, highest_m)


def _length(value: dict[str, Any], key: str, where: str) -> float | None:
    found = value.get(key)
    if found is None:
        return None
    length_m = finite(found, key, where)
    if length_m <= 0:
        raise FormatError(f"{key} is {length_m:g} m.", where=where)
    return length_m
