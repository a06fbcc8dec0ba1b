"""Floor and ceiling of a fence on board: parameters of the autopilot, for no list of a fence holds them.

Both autopilots count them from their own home, as a plan does. ArduPilot acts at FENCE_ALT_MAX and FENCE_ALT_MIN where
FENCE_TYPE says so and the fence is on, does not arm where both leave no room for twice its FENCE_MARGIN, and returns no
higher than the ceiling less that margin. PX4 acts at GF_MAX_VER_DIST and has no floor.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from planning.basics.plan_model import Firmware
from planning.fence.fence_model import NO_FENCE, Fence
from telemetry.errors import NotAllowedError
from telemetry.flight.fence_actions import (
    CEILING_BIT,
    CIRCLE_BIT,
    FLOOR_BIT,
    SHAPES_BIT,
    at_fence,
    is_switched_on,
)
from telemetry.flight.fence_kinds import KINDS

NAMES: dict[Firmware, tuple[str, ...]] = {
    "ardupilot": (
        *("FENCE_ENABLE", "FENCE_AUTOENABLE", "FENCE_TYPE", "FENCE_ACTION", "FENCE_ALT_MAX", "FENCE_ALT_MIN"),
        *("FENCE_MARGIN", "FENCE_RADIUS", "FENCE_ALT_MAX_TP", "FENCE_ALT_MIN_TP"),
    ),
    "px4": ("GF_ACTION", "GF_MAX_VER_DIST", "GF_MAX_HOR_DIST"),
}
"""What to read before they are set."""
COUNTED_BY = {CEILING_BIT: "FENCE_ALT_MAX_TP", FLOOR_BIT: "FENCE_ALT_MIN_TP"}
"""What newer ArduPilot counts the heights from: 0 sea level, 1 home, then its origin and the terrain."""
ABOVE_HOME = 1.0
MARGIN_M, DEEPEST_M = 2.0, -100.0
"""ArduPilot's own margin where it does not tell it, and the lowest FENCE_ALT_MIN with which it arms."""
LEAST_RETURN_M = 2.0
"""Above home: a ceiling that keeps ArduPilot's return lower is refused."""
HOLD = 2.0
"""GF_ACTION, as PX4 comes."""
SAME_HOME_M = 0.3
"""A home that lies so near to the planned one's height is that one: the plan's heights are not moved for it either."""
SAME_M = 0.005
"""Single precision, as vehicles keep it, differs by less."""
TAKEN_WHEN_SWITCHED = "The fence is switched off and on again: since ArduPilot 4.6 it takes FENCE_TYPE only then."
NO_FLOOR = "PX4 has no floor: the vehicle knows nothing of the plan's."


@dataclass(frozen=True, slots=True)
class HeightChange:
    name: str
    before: float
    after: float
    unit: str = ""

    @property
    def words(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} {self.before:g} -> {self.after:g}{unit}"

    @property
    def switches(self) -> bool:
        """It says what acts, not at which height."""
        return not self.unit


@dataclass(frozen=True, slots=True)
class HeightChanges:
    """What is to be written so that the vehicle keeps a plan's floor and ceiling, in this order."""

    changes: tuple[HeightChange, ...]
    """None where all is so already. It is switched on last, off before its kinds where it takes them only then."""
    notes: tuple[str, ...]
    """What this means besides, in whole sentences; ``looser`` first."""
    looser: tuple[str, ...] = ()
    """What acts now and is stricter: to be set only by whoever says that it shall be."""


def heights_aboard(parameters: Mapping[str, float | None], firmware: Firmware) -> Fence:
    """At which the vehicle acts, above home; without what does not act or was not read."""
    if not is_switched_on(parameters, firmware):
        return NO_FENCE
    if firmware == "px4":
        most_m = parameters.get("GF_MAX_VER_DIST")
        return Fence(ceiling_rel_home_m=most_m if most_m is not None and most_m > 0 else None)
    kinds = int(parameters.get("FENCE_TYPE") or 0)
    kinds &= ~sum(bit for bit, name in COUNTED_BY.items() if _is_otherwise(parameters, name))
    return Fence(
        floor_rel_home_m=parameters.get("FENCE_ALT_MIN") if kinds & FLOOR_BIT else None,
        ceiling_rel_home_m=parameters.get("FENCE_ALT_MAX") if kinds & CEILING_BIT else None,
    )


def counted_otherwise(parameters: Mapping[str, float | None], firmware: Firmware) -> tuple[str, ...]:
    """What tells that a height at which the vehicle acts is none above home: it can be compared with nothing here."""
    if firmware == "px4" or not is_switched_on(parameters, firmware):
        return ()
    kinds = int(parameters.get("FENCE_TYPE") or 0)
    return tuple(name for bit, name in COUNTED_BY.items() if kinds & bit and _is_otherwise(parameters, name))


def _is_otherwise(parameters: Mapping[str, float | None], name: str) -> bool:
    """Of a vehicle that has no such parameter all heights are above home."""
    value = parameters.get(name)
    return value is not None and value != ABOVE_HOME


def are_heights_told(parameters: Mapping[str, float | None], firmware: Firmware) -> bool:
    """Whether what the vehicle says tells at which floor and ceiling it acts, or that it acts at none."""
    on = is_switched_on(parameters, firmware)
    names = ("GF_MAX_VER_DIST",) if firmware == "px4" else ("FENCE_TYPE", "FENCE_ALT_MAX", "FENCE_ALT_MIN")
    return on is False or (on is True and all(parameters.get(name) is not None for name in names))


def highest_return_m(parameters: Mapping[str, float | None], firmware: Firmware) -> float:
    """Above home: ArduPilot lowers its return to its ceiling less its margin, without a word; inf: nothing does."""
    top_m = heights_aboard(parameters, firmware).ceiling_rel_home_m
    if firmware == "px4" or top_m is None:
        return math.inf
    return top_m - _margin_m(parameters)


def lowest_way_m(parameters: Mapping[str, float | None], firmware: Firmware) -> float:
    """Above home: the floor at which the vehicle acts, and its margin above that; -inf: it acts at none."""
    floor_m = heights_aboard(parameters, firmware).floor_rel_home_m
    return -math.inf if floor_m is None else floor_m + _margin_m(parameters)


def height_changes(
    fence: Fence,
    parameters: Mapping[str, float | None],
    firmware: Firmware,
    *,
    home_rises_m: float = 0.0,
    untaken_kinds: int = 0,
) -> HeightChanges:
    """``home_rises_m``: the vehicle's home above the one that was planned for. The worse end counts: the vehicle's
    ceiling is above neither, its floor below neither. ``untaken_kinds``: as in VehicleState.

    Raises NotAllowedError where the vehicle cannot have them, or would not arm with them.
    """
    floor_m, ceiling_m = fence.floor_rel_home_m, fence.ceiling_rel_home_m
    rises_m = home_rises_m if abs(home_rises_m) > SAME_HOME_M else 0.0
    if floor_m is not None:
        floor_m = math.ceil(round(100 * (floor_m + max(0.0, -rises_m)), 3)) / 100
    if ceiling_m is not None:
        ceiling_m = math.floor(round(100 * (ceiling_m - max(0.0, rises_m)), 3)) / 100
    if floor_m is None and ceiling_m is None:
        raise NotAllowedError("The fence has neither floor nor ceiling.", advice="Give it one under Fence in Plan.")
    if ceiling_m is not None and ceiling_m <= 0:
        what = f"A ceiling at {ceiling_m:g} m above home is none: the vehicle stands above it on the ground."
        raise NotAllowedError(what, advice="Raise the ceiling, or start from lower ground.")
    if firmware == "px4":
        wanted, notes = _px4(floor_m, ceiling_m, parameters)
    else:
        wanted, notes = _ardupilot(floor_m, ceiling_m, fence, parameters, untaken_kinds)
    found = tuple(each for each in wanted if abs(each.before - each.after) > SAME_M)
    after = dict(parameters) | {each.name: each.after for each in found}
    looser = tuple(_looser(heights_aboard(parameters, firmware), heights_aboard(after, firmware)))
    return HeightChanges(found, (*looser, *notes, *filter(None, (at_fence(after, firmware),))), looser)


def _looser(before: Fence, after: Fence) -> list[str]:
    """What acted and was stricter."""
    notes: list[str] = []
    for name, verb, old_m, new_m, way in (
        ("ceiling", "raises", before.ceiling_rel_home_m, after.ceiling_rel_home_m, 1.0),
        ("floor", "lowers", before.floor_rel_home_m, after.floor_rel_home_m, -1.0),
    ):
        if old_m is not None and new_m is not None and way * (new_m - old_m) > SAME_M:
            notes.append(f"This {verb} the {name} that acts now, from {old_m:g} to {new_m:g} m above home.")
    return notes


def _px4(
    floor_m: float | None, ceiling_m: float | None, parameters: Mapping[str, float | None]
) -> tuple[list[HeightChange], list[str]]:
    if ceiling_m is None:
        raise NotAllowedError(NO_FLOOR, advice="Only a ceiling can be set there.")
    action = _told(parameters, "GF_ACTION")
    wanted = [HeightChange("GF_MAX_VER_DIST", _told(parameters, "GF_MAX_VER_DIST"), ceiling_m, "m")]
    notes = [] if floor_m is None else [NO_FLOOR]
    if action == 0:
        wanted.append(HeightChange("GF_ACTION", action, HOLD))
        notes.append("With GF_ACTION the vehicle's whole fence is switched on.")
        if (radius_m := parameters.get("GF_MAX_HOR_DIST")) is not None and radius_m > 0:
            notes.append(f"So is its distance from home: GF_MAX_HOR_DIST {radius_m:g} m.")
    return wanted, notes


def _ardupilot(
    floor_m: float | None,
    ceiling_m: float | None,
    fence: Fence,
    parameters: Mapping[str, float | None],
    untaken_kinds: int,
) -> tuple[list[HeightChange], list[str]]:
    kinds_before, was_on = int(_told(parameters, "FENCE_TYPE")), bool(is_switched_on(parameters, "ardupilot"))
    own = CEILING_BIT * (ceiling_m is not None) | FLOOR_BIT * (floor_m is not None)
    own |= SHAPES_BIT * bool(fence.polygons or fence.circles)
    # What acts already goes on to act; what a fence that is off would bring along is nobody's wish.
    kinds = kinds_before | own if was_on else own
    for bit, name in COUNTED_BY.items():
        if own & bit and _is_otherwise(parameters, name):
            what = f"The vehicle does not count this height from home: {name} is {parameters[name]:g}."
            raise NotAllowedError(what, where=name, advice=f"Set {name} to {ABOVE_HOME:g} under Parameters first.")
    wanted: list[HeightChange] = []
    if ceiling_m is not None:
        wanted.append(HeightChange("FENCE_ALT_MAX", _told(parameters, "FENCE_ALT_MAX"), ceiling_m, "m"))
    if floor_m is not None:
        wanted.append(HeightChange("FENCE_ALT_MIN", _told(parameters, "FENCE_ALT_MIN"), floor_m, "m"))
    enabled, notes = _told(parameters, "FENCE_ENABLE"), list[str]()
    if enabled == 1 and kinds & ~(kinds_before & ~untaken_kinds) & ~FLOOR_BIT:
        wanted.append(HeightChange("FENCE_ENABLE", enabled, 0))
        enabled = 0.0
        notes += [TAKEN_WHEN_SWITCHED, *_begin_to_act(kinds & untaken_kinds & ~own, parameters)]
    wanted.append(HeightChange("FENCE_TYPE", kinds_before, kinds))
    wanted.append(HeightChange("FENCE_ENABLE", enabled, 1))
    margin_m = _margin_m(parameters)
    _refuse_unarmable(floor_m, ceiling_m, margin_m, parameters)
    if ceiling_m is not None and ceiling_m < margin_m + LEAST_RETURN_M:
        what = f"With a ceiling at {ceiling_m:g} m the vehicle would return at {ceiling_m - margin_m:g} m above home."
        advice = f"Raise it to {margin_m + LEAST_RETURN_M:g} m or more: FENCE_MARGIN and {LEAST_RETURN_M:g} m."
        raise NotAllowedError(what, where="FENCE_ALT_MAX", advice=advice)
    if kinds_before & CIRCLE_BIT and not kinds & CIRCLE_BIT:
        radius_m = parameters.get("FENCE_RADIUS")
        size = "" if radius_m is None else f", {radius_m:g} m"
        notes.append(f"The circle around home (FENCE_RADIUS{size}) stays off: the plan has none.")
    if not kinds & SHAPES_BIT:  # whatever it said before: which shapes are on board was not read
        notes.append("Shapes on board, where there are any, stay off (FENCE_TYPE): the plan has none.")
    if kinds_before & FLOOR_BIT and not kinds & FLOOR_BIT:
        notes.append("The floor (FENCE_ALT_MIN) stays off: the plan has none.")
    if kinds_before & CEILING_BIT and not kinds & CEILING_BIT:
        notes.append("The ceiling (FENCE_ALT_MAX) stays off: the plan has none.")
    if ceiling_m is not None:
        notes.append(f"The vehicle then returns at {ceiling_m - margin_m:g} m at most: FENCE_MARGIN below the ceiling.")
    if floor_m is not None:
        notes.append(
            "The floor acts once the vehicle was above it, and not while it lands; before ArduPilot 4.6 it may not."
        )
    return wanted, notes


def _begin_to_act(kinds: int, parameters: Mapping[str, float | None]) -> list[str]:
    """``kinds``: named while the fence was on, and not the plan's."""
    notes: list[str] = []
    for bit, words in KINDS.items():
        if kinds & bit:
            name = {CEILING_BIT: "FENCE_ALT_MAX", CIRCLE_BIT: "FENCE_RADIUS"}.get(bit, "")
            size = "" if not name or parameters.get(name) is None else f" ({name} {parameters[name]:g} m)"
            notes.append(f"With that the {words}{size} of its fence may begin to act, which FENCE_TYPE names already.")
    return notes


def _refuse_unarmable(
    floor_m: float | None, ceiling_m: float | None, margin_m: float, parameters: Mapping[str, float | None]
) -> None:
    """ArduPilot compares both when it arms, whether they act or not."""
    low_m = parameters.get("FENCE_ALT_MIN") if floor_m is None else floor_m
    high_m = parameters.get("FENCE_ALT_MAX") if ceiling_m is None else ceiling_m
    if floor_m is not None and floor_m < DEEPEST_M:
        what = f"With a floor at {floor_m:g} m the vehicle would not arm: {DEEPEST_M:g} m is its lowest."
        raise NotAllowedError(what, where="FENCE_ALT_MIN", advice="Raise the floor, or leave it out.")
    if low_m is not None and high_m is not None and high_m - low_m <= 2 * margin_m:
        what = (
            f"The vehicle would not arm: between {low_m:g} m (FENCE_ALT_MIN) and {high_m:g} m (FENCE_ALT_MAX) it wants"
            f" more than twice its FENCE_MARGIN of {margin_m:g} m."
        )
        raise NotAllowedError(what, where="FENCE_MARGIN", advice="Change one of them under Parameters, or the plan.")


def _margin_m(parameters: Mapping[str, float | None]) -> float:
    told_m = parameters.get("FENCE_MARGIN")
    return MARGIN_M if told_m is None else told_m


def _told(parameters: Mapping[str, float | None], name: str) -> float:
    value = parameters.get(name)
    if value is None or not math.isfinite(value):
        what = f"The vehicle does not tell {name}: its floor and ceiling cannot be set."
        raise NotAllowedError(what, where=name, advice="Look at the link; or its firmware has no such fence.")
    return value
