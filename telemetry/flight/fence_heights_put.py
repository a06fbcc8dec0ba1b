"""A plan's floor and ceiling put on board: the heights first, and the fence switched on only where they took."""

from __future__ import annotations

from collections.abc import Sequence

from telemetry.errors import NotAllowedError, SilentError, TelemetryError
from telemetry.flight.fence_heights import HeightChange, HeightChanges
from telemetry.flight.watch import Asks
from telemetry.topics.parameters import Outcome, ParameterChange, ParameterWritten
from telemetry.topics.requests import Operator, WriteParameters

UNSET = "Floor or ceiling did not take: the fence was not switched."


async def put_heights(link: Asks, operator: Operator, found: HeightChanges) -> tuple[ParameterWritten, ...]:
    """One for each change, in their order. The link refuses it while the vehicle is armed.

    Raises what the link raises of the first of them; what becomes of the others then is told.
    """
    heights = [each for each in found.changes if not each.switches]
    switches = [each for each in found.changes if each.switches]
    written = await _write(link, operator, heights) if heights else ()
    if not switches:
        return written
    if not all(one.took for one in written):
        return (*written, *_left(switches, "not sent", UNSET))
    try:
        return (*written, *await _write(link, operator, switches))
    except TelemetryError as error:
        if not written:
            raise
        return (*written, *lost(switches, error))


def lost(changes: Sequence[HeightChange], error: TelemetryError) -> tuple[ParameterWritten, ...]:
    """What is known of changes whose writing raised."""
    nothing_sent = isinstance(error, NotAllowedError | SilentError)
    return _left(changes, "not sent" if nothing_sent else "unknown", str(error))


async def _write(link: Asks, operator: Operator, changes: Sequence[HeightChange]) -> tuple[ParameterWritten, ...]:
    asked = tuple(ParameterChange(each.name, each.after) for each in changes)
    return await link.call(WriteParameters(operator, asked))


def _left(changes: Sequence[HeightChange], outcome: Outcome, words: str) -> tuple[ParameterWritten, ...]:
    return tuple(ParameterWritten(each.name, each.after, None, None, outcome, words) for each in changes)
