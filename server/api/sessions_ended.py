"""Sessions end at once, with all their pages and with what they were in charge of."""

from __future__ import annotations

import asyncio
from collections.abc import Collection

from server.api.access import Parts

LOOK_EVERY_S = 1.0


async def end_sessions(parts: Parts, keys: Collection[str]) -> None:
    await asyncio.to_thread(parts.auth.sign_out, keys)
    await _close(parts, keys)


async def close_ended(parts: Parts) -> None:
    """Of accounts that were removed or have another password, and of those whose time is over."""
    keys = parts.hub.session_keys() | parts.fleet.holders
    await _close(parts, parts.auth.ended(keys))


async def watch_sessions(parts: Parts) -> None:
    """``hedgehop account`` changes the file from outside."""
    while True:
        await close_ended(parts)
        if parts.auth.owes_writing:
            await asyncio.to_thread(parts.auth.settle)
        await asyncio.sleep(LOOK_EVERY_S)


async def _close(parts: Parts, keys: Collection[str]) -> None:
    for key in keys:
        parts.hub.close_session(key)
        for flying in parts.fleet.flights:
            await flying.operators.release(key)
