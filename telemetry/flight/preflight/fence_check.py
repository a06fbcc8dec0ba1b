"""The check's row of fence and rally points: whether the vehicle holds the plan's, and what it does at its fence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from planning.basics.plan_model import Firmware, MissionItem
from planning.errors import FormatError
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, fence_words, within_both
from planning.formats.fence_items import fence_items, fence_of, rally_items, rally_of
from telemetry.flight.fence_actions import at_fence, deaf_to_shapes
from telemetry.flight.fence_heights import NO_FLOOR, SAME_M, are_heights_told, counted_otherwise, heights_aboard
from telemetry.flight.fence_kinds import SWITCH, untaken_words
from telemetry.flight.fence_radius import NAMES as RADIUS_NAMES
from telemetry.flight.fence_radius import may_have_radius, radius_aboard_m
from telemetry.flight.preflight.checks import Row
from telemetry.mavlink.items import mission_items, wire_items
from telemetry.mavlink.verify import compare
from telemetry.topics.onboard_lists import Item, PlaceList, PlacesOnboard

Places = tuple[Fence, tuple[RallyPoint, ...]]
NOTHING: Places = (NO_FENCE, ())


def sent_places(planned: Places, firmware: Firmware) -> dict[PlaceList, tuple[Item, ...]]:
    """What an upload makes of them."""
    items: dict[PlaceList, tuple[MissionItem, ...]] = {
        "fence": fence_items(planned[0]),
        "rally": rally_items(planned[1], firmware),
    }
    return {kind: wire_items(found) for kind, found in items.items()}


def flown_within(planned: Places, aboard: PlacesOnboard) -> Places:
    """What a flight is held against: the plan's fence and the vehicle's; the plan's rally points, else the vehicle's.

    Of floor and ceiling ``heights_aboard`` tells: no list holds them.
    Raises FormatError for a list on board that means nothing.
    """
    fence = within_both(planned[0], fence_of(mission_items(aboard.fence), "the fence on board", []))
    return fence, planned[1] or rally_of(mission_items(aboard.rally), "the rally points on board")


def fence_row(
    planned: Places,
    aboard: PlacesOnboard,
    parameters: Mapping[str, float | None],
    firmware: Firmware,
    *,
    untaken_kinds: int = 0,
) -> Row | None:
    """None: neither the plan nor the vehicle has any. Whether the flight keeps inside is the certificate's matter.

    ``untaken_kinds``: as in VehicleState.
    """
    wanted = any(planned)
    if aboard.unread:
        text = f"What fence and rally points the vehicle holds could not be read: {aboard.unread}"
        return Row("fence", "unknown" if wanted else "accept", text, "Check again, or look at the link.")
    try:
        held = flown_within(NOTHING, aboard)
    except FormatError as error:
        return Row("fence", "bad", f"The vehicle's own list is not understood: {error.where}: {error.what}", _CLEAR)
    strange: list[str] = []
    for kind, sent in sent_places(planned, firmware).items():
        found = aboard.fence if kind == "fence" else aboard.rally
        if found and not sent:
            strange.append("the fence is" if kind == "fence" else "the rally points are")
        if sent and compare(sent, found, firmware=firmware)[1]:
            what = "fence" if kind == "fence" else "list of rally points"
            return Row("fence", "bad", f"The {what} on board is not the plan's.", "Upload the plan again.")
    does = at_fence(parameters, firmware)
    heights = _with_radius(_heights(planned[0], parameters, firmware), parameters, firmware)
    if words := untaken_words(untaken_kinds):
        heights = _Heights((*heights.words, words), f"{heights.mend} {SWITCH}".strip())
    if not wanted and not any(held):
        state = "accept" if heights.mend else "good"
        return Row("fence", state, " ".join((*heights.words, does)), heights.mend) if heights.words else None
    whose = "the plan's" if wanted else "another than the plan's, which has none"
    if wanted and strange:
        whose = f"but {' and '.join(strange)} not the plan's"
    shapes = [f"{fence_words(*held)} on board, {whose}; the flight is held against it."] if any(held) else []
    cleared = _CLEAR if strange else ""
    deaf = deaf_to_shapes(held[0], parameters, firmware)
    if deaf or heights.mend:
        mend = " ".join(filter(None, ("Set it under Parameters, or accept it." if deaf else "", heights.mend, cleared)))
        return Row("fence", "accept", " ".join(filter(None, (*shapes, *heights.words, deaf or does))), mend)
    return Row("fence", "good", " ".join(filter(None, (*shapes, *heights.words, does))), cleared)


@dataclass(frozen=True, slots=True)
class _Heights:
    """Floor and ceiling: the plan's, and those at which the vehicle acts; and its circle around home."""

    words: tuple[str, ...]
    mend: str
    """Of what the vehicle could keep and does not."""


def _heights(planned: Fence, parameters: Mapping[str, float | None], firmware: Firmware) -> _Heights:
    own, known = heights_aboard(parameters, firmware), are_heights_told(parameters, firmware)
    words: list[str] = []
    mend = ""
    for name, wanted_m, own_m, stricter in (
        ("floor", planned.floor_rel_home_m, own.floor_rel_home_m, 1.0),
        ("ceiling", planned.ceiling_rel_home_m, own.ceiling_rel_home_m, -1.0),
    ):
        if wanted_m is None:
            if own_m is not None:
                words.append(f"The vehicle keeps a {name} of its own at {own_m:g} m above home; so does the flight.")
            continue
        plans = f"{name} at {wanted_m:g} m above home"
        if name == "floor" and firmware == "px4":
            words.append(f"{NO_FLOOR} The flight is held against it: {plans}.")
        elif own_m is None:
            what = "is not on board" if known else "may not be on board: that was not read"
            words.append(f"The plan's {plans} {what}. The flight is held against it.")
            mend = _SET
        elif stricter * (own_m - wanted_m) < -SAME_M:
            words.append(f"The vehicle's {name}, {own_m:g} m above home, is not the plan's, {wanted_m:g} m.")
            mend = _SET
        elif abs(own_m - wanted_m) <= SAME_M:
            words.append(f"The plan's {plans} is on board.")
        else:
            words.append(f"The plan's {plans} is on board, stricter: {own_m:g} m; the flight is held against that.")
    return _Heights(tuple(words), mend)


def _with_radius(heights: _Heights, parameters: Mapping[str, float | None], firmware: Firmware) -> _Heights:
    """With the circle around home, which no plan has."""
    for each in counted_otherwise(parameters, firmware):
        words = f"A height at which the vehicle acts is not counted from home ({each} {parameters[each]:g}):"
        words = f"{words} it is compared with nothing, and the flight is not held against it."
        heights = _Heights((*heights.words, words), f"{heights.mend} Set {each} to 1, or accept it.".strip())
    name, radius_m = RADIUS_NAMES[firmware], radius_aboard_m(parameters, firmware)
    if may_have_radius(parameters, firmware):
        words = f"Whether the vehicle keeps a circle around home ({name}), and which, was not read."
        return _Heights((*heights.words, words), f"{heights.mend} Check again, or accept it.".strip())
    if radius_m is None:
        return heights
    words = f"The vehicle keeps within {radius_m:g} m of home ({name}); so does the flight."
    return _Heights((*heights.words, words), heights.mend)


_SET = "Set floor and ceiling on the vehicle under On board, or with: hedgehop fence LINK upload FILE --heights set."
_CLEAR = "To remove it, use: hedgehop fence LINK clear, hedgehop rally LINK clear."
