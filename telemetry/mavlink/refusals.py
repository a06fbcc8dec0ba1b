"""A vehicle's refusal of a mission (MAV_MISSION_RESULT) in words: which item, which value, what to do."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from telemetry.errors import RefusedError, TelemetryError, TransferError
from telemetry.mavlink.conversation import MISSION, ItemList
from telemetry.mavlink.texts import VehicleWords
from telemetry.topics.onboard_lists import Item

(
    ACCEPTED,
    ERROR,
    UNSUPPORTED_FRAME,
    UNSUPPORTED,
    NO_SPACE,
    INVALID,
    PARAM1,
    PARAM2,
    PARAM3,
    PARAM4,
    LATITUDE,
    LONGITUDE,
    ALTITUDE,
    INVALID_SEQUENCE,
    DENIED,
    CANCELLED,
) = range(16)
OF_AN_ITEM = frozenset({UNSUPPORTED_FRAME, UNSUPPORTED, INVALID, *range(PARAM1, ALTITUDE + 1)})
"""Results that say what is wrong with the item that was just sent."""
TRANSFER_IS_GONE = frozenset({ERROR, CANCELLED, DENIED})
"""Results of a vehicle that knows nothing of our transfer, or not any more."""
_CAPACITY = re.compile(r"Only (\d+) items")


@dataclass(frozen=True, slots=True)
class Refusal:
    result: int
    """MAV_MISSION_RESULT"""
    number: int | None = None
    """Of the item, 1 is the first; 0 is the home row, None the mission as a whole."""


def refusal_error(
    refusal: Refusal, items: tuple[Item, ...], words: VehicleWords, about: ItemList = MISSION
) -> TelemetryError:
    """What is told of it; ``words`` were heard since the upload began."""
    if refusal.result == NO_SPACE:
        return _no_space(len(items), words, about)
    if refusal.number is None:
        return RefusedError(
            f"The vehicle does not take a {about.name} now.{words.sentence()}",
            where=f"mission result {refusal.result}",
            advice=f"Wait until it is ready and no other ground station is transferring a {about.name}, then upload"
            " again." + ("" if about is MISSION else f" Some firmware keeps no {about.name} at all."),
        )
    if refusal.number == 0:
        return RefusedError(
            f"The vehicle refused the home position.{words.sentence()}",
            where="home",
            advice="Correct the plan's home and upload again.",
        )
    return _item_error(refusal.result, refusal.number, items[refusal.number - 1], words, about)


def broken_off(number: int, total: int, words: VehicleWords, about: ItemList = MISSION) -> TelemetryError:
    """The vehicle ended the transfer again and again, without a word about an item."""
    return TransferError(
        f"The vehicle broke the upload off at item {number} of {total}.{words.sentence()}",
        where=f"item {number}",
        advice=f"Check the link. {about.mixture}",
    )


def _item_error(result: int, number: int, item: Item, words: VehicleWords, about: ItemList) -> TelemetryError:
    field, value, advice = _what_is_wrong(result, item)
    return RefusedError(
        f"The vehicle refused item {number}: {field} {value}.{words.sentence()}",
        where=f"item {number}",
        advice=f"{advice} {about.mixture}",
    )


def _what_is_wrong(result: int, item: Item) -> tuple[str, str, str]:
    if PARAM1 <= result <= PARAM4:
        k = result - PARAM1
        return f"parameter {k + 1} of command {item.command} is", _say(item.params[k]), "Correct it in the plan."
    return {
        UNSUPPORTED_FRAME: ("it cannot use altitude frame", str(item.frame), "Give heights above home (frame 3)."),
        UNSUPPORTED: ("it does not know command", str(item.command), "Take that item out of the plan."),
        LATITUDE: ("the latitude is", _say(item.lat_deg), "Give -90 to 90 degrees."),
        LONGITUDE: ("the longitude is", _say(item.lon_deg), "Give -180 to 180 degrees."),
        ALTITUDE: ("the altitude is", f"{_say(item.alt_m)} m", "Give a height that the vehicle can fly."),
    }.get(result, ("a value is not valid in command", str(item.command), "Correct it in the plan."))


def _no_space(count: int, words: VehicleWords, about: ItemList) -> TelemetryError:
    found = next((match for match in map(_CAPACITY.search, words.texts) if match), None)
    capacity = int(found[1]) if found else None
    if capacity == 0:
        return RefusedError(
            f"The vehicle takes no {about.name} yet.{words.sentence()}",
            advice="It is still starting: wait until it is ready and upload again.",
        )
    limit = f"at most {capacity} items" if capacity else "less"
    return RefusedError(
        f"The {about.name} has {count} items, the vehicle holds {limit}.{words.sentence()}",
        advice="Allow a larger excess height, or plan a shorter route, so that fewer items are needed."
        if about is MISSION
        else "Use fewer corners, circles or points.",
    )


def _say(value: float | None) -> str:
    if value is None:
        return "not given"
    return f"{value:.9g}" if math.isfinite(value) else str(value)
