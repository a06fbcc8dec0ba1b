"""Floor and ceiling of the plan on board: what would change on the vehicle, and, as it was shown, set and read back."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

from planning.basics.plan_model import Firmware
from server.errors import ConflictError
from server.flying.parameter_desk import written_docs
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.library.documents import places_of
from server.schemas import FenceHeightsDoc, FenceHeightsSet, HeightChangeDoc, SetFenceHeights
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, NoVehicleError
from telemetry.flight.fence_heights import NAMES, HeightChanges, height_changes
from telemetry.flight.fence_heights_put import put_heights
from telemetry.topics.parameters import ParameterWritten
from telemetry.topics.requests import Operator, ReadParameters

NOT_CHECKED = "How high home lies beside the planned one is not known now: Check the start first where they differ."


class FenceHeights:
    """All methods belong to the event loop."""

    def __init__(
        self,
        link: LinkClient,
        live: Channel,
        aboard: Aboard,
        home_rises_m: Callable[[], float | None],
        on_written: Callable[[Sequence[ParameterWritten]], None],
    ) -> None:
        """``home_rises_m``: the vehicle's home above the planned one, by the check of the start; None: not checked."""
        self._link, self._live, self._aboard = link, live, aboard
        self._home_rises_m, self._on_written = home_rises_m, on_written
        self._rises_m: float | None = None
        """As it was when the changes were shown: what is written of them makes the check void."""

    async def look(self) -> FenceHeightsDoc:
        """Reads what the vehicle has. Raises ConflictError without a plan of ours on board, NotAllowedError where the
        vehicle cannot keep them."""
        self._rises_m = self._home_rises_m()
        found = await self._found()
        notes = [*found.notes, *([NOT_CHECKED] if self._rises_m is None else [])]
        return FenceHeightsDoc(changes=_docs(found), notes=notes)

    async def set(self, operator: Operator, body: SetFenceHeights) -> FenceHeightsSet:
        """Raises ConflictError unless they are what was shown; refused while the vehicle is armed, before anything is
        read."""
        if self._live.state is not None and self._live.state.armed:
            raise NotAllowedError("The vehicle is armed.", advice="Set floor and ceiling once it is disarmed.")
        found = await self._found()
        if _docs(found) != body.changes:
            what = "The vehicle's settings, or what is on board, have changed since this was shown."
            raise ConflictError(what, advice="Look at what would change now.")
        try:
            written = await put_heights(self._link, operator, found)
        except NotAllowedError:  # nothing was written
            raise
        except BaseException:
            self._on_written(())
            raise
        self._on_written(written)
        return FenceHeightsSet(written=written_docs(written), took=all(one.took for one in written))

    async def _found(self) -> HeightChanges:
        record, state = self._aboard.record, self._live.state
        if state is None:
            raise NoVehicleError("No vehicle is connected.", advice="Connect one first.")
        if record is None:
            raise ConflictError("No plan that was uploaded from here is on board.", advice="Upload the plan first.")
        firmware: Firmware = record.firmware
        fence, _ = await asyncio.to_thread(places_of, record)
        parameters = await self._link.call(ReadParameters(NAMES[firmware]))
        # Unknown is not none: the heights of the mission on board were moved for a home that is known.
        rises_m = record.heights_moved_m if self._rises_m is None else self._rises_m
        return height_changes(
            fence, parameters, firmware, home_rises_m=rises_m, untaken_kinds=state.fence_kinds_untaken
        )


def _docs(found: HeightChanges) -> list[HeightChangeDoc]:
    return [
        HeightChangeDoc(name=each.name, before=each.before, after=each.after, unit="" if each.switches else "m")
        for each in found.changes
    ]
