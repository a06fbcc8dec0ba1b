"""A fence's floor and ceiling as parameters of the vehicle: what would change is said first, then set and read back."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from planning.basics.plan_model import Firmware
from planning.fence.fence_model import Fence
from server.cli.shared.output import say
from server.cli.shared.own_nodes import OPERATOR
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, TelemetryError
from telemetry.flight.fence_heights import NAMES, HeightChanges, height_changes
from telemetry.flight.fence_heights_put import lost, put_heights, unsent
from telemetry.topics.parameters import ParameterWritten
from telemetry.topics.requests import ReadParameters

LOOSER_BY = "Give it with --looser if that is wanted, or change the fence's file."
SHAPES_FIRST = "It was not set: the shapes on board are not those that were sent."


@dataclass(frozen=True, slots=True)
class HeightsDone:
    found: HeightChanges
    written: tuple[ParameterWritten, ...]
    """None where nothing had to change, or nothing was to be set."""
    writes: bool

    @property
    def took(self) -> bool:
        """The vehicle holds them, or was not asked to."""
        return not self.writes or all(one.took for one in self.written)

    @property
    def summary(self) -> dict[str, Any]:
        return {
            "set": self.writes and self.took,
            "changes": [{"name": c.name, "before": c.before, "after": c.after} for c in self.found.changes],
            "written": [asdict(one) | {"took": one.took} for one in self.written],
            "notes": list(self.found.notes),
            "looser": list(self.found.looser),
        }

    @property
    def lines(self) -> list[str]:
        if not self.found.changes:
            return ["FLOOR AND CEILING: the vehicle has them already"]
        if not self.writes:
            return ["FLOOR AND CEILING: NOT SET, only shown"]
        missing = [one for one in self.written if not one.took]
        if not missing:
            return ["FLOOR AND CEILING: SET, read back"]
        held = [f"  {one.name}: {_held(one)}. {one.words}".rstrip() for one in missing]
        return ["FLOOR AND CEILING: NOT AS ASKED", *held]


def _held(one: ParameterWritten) -> str:
    return "not known" if one.after is None else f"the vehicle holds {one.after:g}"


async def read_heights(
    link: LinkClient, fence: Fence, firmware: Firmware, *, writes: bool, may_loosen: bool
) -> HeightChanges:
    """Says what would change. Raises NotAllowedError where the vehicle cannot have them, or where a stricter one that
    acts now would be written over and may not be; and what the link raises."""
    parameters = await link.call(ReadParameters(NAMES[firmware]))
    found = height_changes(fence, parameters, firmware)
    for change in found.changes:
        say(f"  {change.words}")
    for note in found.notes:
        say(f"  {note}")
    if writes and found.looser and not may_loosen:
        raise NotAllowedError(" ".join((*found.looser, "Nothing was sent.")), advice=LOOSER_BY)
    return found


def heights_unsent(found: HeightChanges, *, writes: bool) -> HeightsDone:
    """Where the shapes were sent and are not on board as sent."""
    return HeightsDone(found, unsent(found.changes, SHAPES_FIRST) if writes else (), writes)


async def set_heights(link: LinkClient, found: HeightChanges, *, writes: bool, begun: bool) -> HeightsDone:
    """``begun``: the shapes were sent, and what became of them must be told. Else raises what the link raises: of an
    armed vehicle NotAllowedError."""
    if not (writes and found.changes):
        return HeightsDone(found, (), writes)
    try:
        return HeightsDone(found, await put_heights(link, OPERATOR, found), writes)
    except TelemetryError as error:
        if not begun:
            raise
        return HeightsDone(found, lost(found.changes, error), writes)
