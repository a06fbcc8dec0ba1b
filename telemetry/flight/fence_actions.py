"""What an autopilot does at its fence, by its own settings, and whether it acts on the shapes that it holds."""

from __future__ import annotations

from collections.abc import Mapping

from planning.basics.plan_model import Firmware
from planning.fence.fence_model import Fence

CEILING_BIT, CIRCLE_BIT, SHAPES_BIT, FLOOR_BIT = 1, 2, 4, 8
"""Of FENCE_TYPE: highest height, circle around home (FENCE_RADIUS), circles and polygons, lowest height."""
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


def is_switched_on(parameters: Mapping[str, float | None], firmware: Firmware) -> bool | None:
    """Whether the vehicle acts on a fence at all, from its arming on; None: that was not read."""
    if firmware == "px4":
        action = parameters.get("GF_ACTION")
        return None if action is None else action != 0
    enabled = parameters.get("FENCE_ENABLE")
    return None if enabled is None else bool(enabled) or bool(parameters.get("FENCE_AUTOENABLE"))


def deaf_to_shapes(held: Fence, parameters: Mapping[str, float | None], firmware: Firmware) -> str:
    """Why the vehicle does not act on the shapes that it holds; empty: it does, or that was not read."""
    if not held.polygons and not held.circles:
        return ""
    if is_switched_on(parameters, firmware) is False:
        if firmware == "px4":
            return "The vehicle does nothing at it: GF_ACTION is 0."
        return "The vehicle does not act on it: FENCE_ENABLE is 0."
    kinds = parameters.get("FENCE_TYPE") if firmware == "ardupilot" else None
    if kinds is not None and not int(kinds) & SHAPES_BIT:
        return f"The vehicle does not act on its shapes: FENCE_TYPE is {kinds:g}, without {SHAPES_BIT}."
    return ""
