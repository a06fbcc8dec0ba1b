"""The check's row of fence and rally points: whether the vehicle holds the plan's, and what it does at its fence."""

from __future__ import annotations

from collections.abc import Mapping

from planning.basics.plan_model import Firmware, MissionItem
from planning.errors import FormatError
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, fence_words, within_both
from planning.formats.fence_items import fence_items, fence_of, rally_items, rally_of
from telemetry.flight.preflight.checks import Row
from telemetry.mavlink.items import mission_items, wire_items
from telemetry.mavlink.verify import compare
from telemetry.topics.onboard_lists import Item, PlaceList, PlacesOnboard

Places = tuple[Fence, tuple[RallyPoint, ...]]
NOTHING: Places = (NO_FENCE, ())
SHAPES_BIT = 4
"""Of FENCE_TYPE: circles and polygons."""
_AT_FENCE: dict[Firmware, dict[int, str]] = {
    "ardupilot": {
        0: "only says so and flies on",
        1: "returns, or lands where it cannot",
        2: "lands where it is",
        3: "returns the way it came, or straight home, or lands",
        4: "brakes, or lands where it cannot",
        5: "returns the way it came, or lands",
    },
    "px4": {
        0: "does nothing",
        1: "only says so and flies on",
        2: "holds its place",
        3: "returns",
        4: "ends the flight: it falls",
        5: "lands where it is",
    },
}


def sent_places(planned: Places, firmware: Firmware) -> dict[PlaceList, tuple[Item, ...]]:
    """What an upload makes of them."""
    items: dict[PlaceList, tuple[MissionItem, ...]] = {
        "fence": fence_items(planned[0]),
        "rally": rally_items(planned[1], firmware),
    }
    return {kind: wire_items(found) for kind, found in items.items()}


def flown_within(planned: Places, aboard: PlacesOnboard) -> Places:
    """What a flight is held against: the plan's fence and the vehicle's; the plan's rally points, else the vehicle's.

    A plan's floor and ceiling are never on board: they are no reason to look away from shapes that are.
    Raises FormatError for a list on board that means nothing.
    """
    fence = within_both(planned[0], fence_of(mission_items(aboard.fence), "the fence on board", []))
    return fence, planned[1] or rally_of(mission_items(aboard.rally), "the rally points on board")


def fence_row(
    planned: Places, aboard: PlacesOnboard, parameters: Mapping[str, float | None], firmware: Firmware
) -> Row | None:
    """None: neither the plan nor the vehicle has any. Whether the flight keeps inside is the certificate's matter."""
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
    if not wanted and not any(held):
        return None
    if not any(held):
        return Row("fence", "good", _heights(planned[0]), _HEIGHTS_MEND[firmware])
    whose = "the plan's" if wanted else "another than the plan's, which has none"
    if wanted and strange:
        whose = f"but {' and '.join(strange)} not the plan's"
    text = f"{fence_words(*held)} on board, {whose}; the flight is held against it. {_heights(planned[0])}".strip()
    deaf = _deaf(held[0], parameters, firmware)
    if deaf:
        return Row("fence", "accept", f"{text} {deaf}", "Set it under Parameters, or accept it.")
    return Row("fence", "good", f"{text} {at_fence(parameters, firmware)}".strip(), _CLEAR if strange else "")


def _heights(planned: Fence) -> str:
    """Of a plan's floor and ceiling, which no list holds; empty where it has none."""
    if not planned.has_heights:
        return ""
    words = fence_words(Fence((), (), planned.floor_rel_home_m, planned.ceiling_rel_home_m), ()).removeprefix("Fence: ")
    return f"Not on board, by no list: {words}. The flight is held against it, the vehicle knows nothing of it."


_HEIGHTS_MEND: dict[Firmware, str] = {
    "ardupilot": "The vehicle keeps heights of its own: FENCE_ALT_MIN, FENCE_ALT_MAX and FENCE_TYPE.",
    "px4": "The vehicle keeps a height of its own: GF_MAX_VER_DIST.",
}
_CLEAR = "To remove it, use: hedgehop fence LINK clear, hedgehop rally LINK clear."


def at_fence(parameters: Mapping[str, float | None], firmware: Firmware) -> str:
    """What the vehicle does when it crosses its fence; empty where that was not read."""
    name = "GF_ACTION" if firmware == "px4" else "FENCE_ACTION"
    value = parameters.get(name)
    if value is None:
        return ""
    does = _AT_FENCE[firmware].get(int(value))
    if does is None:
        return f"What it does at its fence is not known here: {name} is {value:g}."
    return f"At its fence the vehicle {does} ({name} {value:g})."


def _deaf(held: Fence, parameters: Mapping[str, float | None], firmware: Firmware) -> str:
    """Why the vehicle does not act on the shapes that it holds; empty: it does, or that was not read."""
    if not held.polygons and not held.circles:
        return ""
    if firmware == "px4":
        return "The vehicle does nothing at it: GF_ACTION is 0." if parameters.get("GF_ACTION") == 0 else ""
    if parameters.get("FENCE_ENABLE") == 0:
        return "The vehicle does not act on it: FENCE_ENABLE is 0."
    kinds = parameters.get("FENCE_TYPE")
    if kinds is not None and not int(kinds) & SHAPES_BIT:
        return f"The vehicle does not act on its shapes: FENCE_TYPE is {kinds:g}, without {SHAPES_BIT}."
    return ""
