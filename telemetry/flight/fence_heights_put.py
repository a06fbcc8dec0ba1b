"""A plan's floor and ceiling put on board: the heights first, and the fence switched on only where they took."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace

from telemetry.errors import NotAllowedError, SilentError, TelemetryError
from telemetry.flight.fence_heights import HeightChange, HeightChanges
from telemetry.flight.watch import Asks
from telemetry.topics.parameters import Outcome, ParameterChange, ParameterWritten
from telemetry.topics.requests import Operator, WriteParameters

UNSET = "Floor or ceiling did not take: the fence was not switched."
STAYS_OFF = "The fence may be off now: set FENCE_ENABLE to 1 under Parameters."
OFF_FOR_S = 0.3
"""ArduPilot looks ten times a second whether its fence was switched."""


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
    is_anew = ("FENCE_ENABLE", 0) in [(each.name, each.after) for each in switches]
    try:
        if not is_anew:
            return (*written, *await _write(link, operator, switches))
        return (*written, *await _off_and_on(link, operator, switches[:-1], switches[-1:]))
    except TelemetryError as error:
        if not written:
            raise
        return (*written, *lost(switches, error))


async def _off_and_on(
    link: Asks, operator: Operator, off: Sequence[HeightChange], on: Sequence[HeightChange]
) -> tuple[ParameterWritten, ...]:
    """``on`` alone switches it on, whatever becomes of ``off``: perhaps it is off."""
    try:
        written = await _write(link, operator, off)
        await asyncio.sleep(OFF_FOR_S)
    except NotAllowedError:
        raise
    except TelemetryError as error:
        written = lost(off, error)
    except asyncio.CancelledError:
        await _on_again(link, operator, on)
        raise
    return (*written, *await _on_again(link, operator, on))


async def _on_again(link: Asks, operator: Operator, on: Sequence[HeightChange]) -> tuple[ParameterWritten, ...]:
    try:
        written = await _write(link, operator, on)
    except TelemetryError as error:
        written = lost(on, error)
    return tuple(one if one.took else replace(one, words=f"{one.words} {STAYS_OFF}".strip()) for one in written)


def lost(changes: Sequence[HeightChange], error: TelemetryError) -> tuple[ParameterWritten, ...]:
    """What is known of changes whose writing raised."""
    nothing_sent = isinstance(error, NotAllowedError | SilentError)
    return _left(changes, "not sent" if nothing_sent else "unknown", str(error))


def unsent(changes: Sequence[HeightChange], words: str) -> tuple[ParameterWritten, ...]:
    """Of changes that were not tried."""
    return _left(changes, "not sent", words)


async def _write(link: Asks, operator: Operator, changes: Sequence[HeightChange]) -> tuple[ParameterWritten, ...]:
    asked = tuple(ParameterChange(each.name, each.after) for each in changes)
    return await link.call(WriteParameters(operator, asked))


def _left(changes: Sequence[HeightChange], outcome: Outcome, words: str) -> tuple[ParameterWritten, ...]:
    return tuple(ParameterWritten(each.name, each.after, None, None, outcome, words) for each in changes)
