"""Connections that ask for nothing give way: a stranger can open many for nothing, and they may not cost us the door.

uvicorn waits for a first request for ever, and for the rest of one that came in part. Here a request has its header
within ten seconds, and where too many connections are open, from one address or in all, the one that has waited longest
without asking for anything makes room for the next: an operator's browser asks at once, and always comes in. The soft
limit of open files is raised at the start, so that the limit here is met before the system's.
"""

from __future__ import annotations

import asyncio
import logging
import resource
from collections import Counter
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from server.door.tries import place_of

log = logging.getLogger("hedgehop.door")

HEADER_S = 10.0
FILES_OF_OURS = 512
"""Files that are open beside connections, at most."""
CONNECTIONS_MAX, FROM_ONE_PLACE_MAX = 2048, 512
"""A page has about eight; many pages may stand behind one address, and all of a proxy's do."""
TOLD_EVERY_S = 60.0


def raise_file_limit() -> None:
    """The soft one, as far as is needed and the hard one lets us."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = CONNECTIONS_MAX + FILES_OF_OURS
    if soft != resource.RLIM_INFINITY and soft < wanted:
        within = wanted if hard == resource.RLIM_INFINITY else min(wanted, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (within, hard))


def connections_max() -> int:
    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return CONNECTIONS_MAX if soft == resource.RLIM_INFINITY else max(16, min(CONNECTIONS_MAX, soft - FILES_OF_OURS))


class OpenConnections:
    """All that are open: those that have asked for something, and those that wait, the one that waits longest first."""

    def __init__(self, most: int, most_from_one_place: int) -> None:
        self._most, self._most_from_one_place = most, most_from_one_place
        self._open: dict[asyncio.Transport, str] = {}
        self._waiting: dict[asyncio.Transport, str] = {}
        self._from = Counter[str]()
        self._sent_away, self._told_s = 0, float("-inf")

    def admit(self, transport: asyncio.Transport, place: str) -> None:
        """Whoever has to go for it, if need be this one itself, is cut off."""
        if self._from[place] >= self._most_from_one_place or len(self._open) >= self._most:
            self._forget_closed()
        self._open[transport] = self._waiting[transport] = place
        self._from[place] += 1
        if self._from[place] > self._most_from_one_place:
            self._cut_off(next(each for each, whence in self._waiting.items() if whence == place))
        elif len(self._open) > self._most:
            self._cut_off(next(iter(self._waiting)))

    def asks(self, transport: asyncio.Transport) -> None:
        """It has made a whole request, or has become a WebSocket."""
        self._waiting.pop(transport, None)

    def waits(self, transport: asyncio.Transport, place: str) -> None:
        """It was answered, and may ask again."""
        if transport in self._open:
            self._waiting[transport] = place

    def gone(self, transport: asyncio.Transport) -> None:
        self._waiting.pop(transport, None)
        place = self._open.pop(transport, None)
        if place is not None:
            self._from[place] -= 1
            if not self._from[place]:
                del self._from[place]

    def _forget_closed(self) -> None:
        """WebSockets end without a word to us."""
        for transport in [each for each in self._open if each.is_closing()]:
            self.gone(transport)

    def _cut_off(self, transport: asyncio.Transport) -> None:
        place = self._open[transport]
        self.gone(transport)
        transport.abort()
        self._sent_away += 1
        now_s = asyncio.get_running_loop().time()
        if now_s - self._told_s >= TOLD_EVERY_S:
            log.warning(
                "Too many connections: %d that asked for nothing were cut off, the last one from %s.",
                self._sent_away,
                place,
            )
            self._told_s, self._sent_away = now_s, 0


def usual_connections() -> OpenConnections:
    """As many as the system lets us have."""
    most = connections_max()
    return OpenConnections(most, min(FROM_ONE_PLACE_MAX, 3 * most // 4))


def limited_protocol(connections: OpenConnections, *, header_s: float = HEADER_S) -> type[H11Protocol]:
    """uvicorn's own protocol, whose connections are counted and have to ask within ``header_s``."""

    class LimitedProtocol(H11Protocol):
        _deadline: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            self._place = place_of(self.client[0] if self.client else "")
            connections.admit(transport, self._place)
            self._expect_request()

        def connection_lost(self, exc: Exception | None) -> None:
            self._expect_no_more()
            connections.gone(self.transport)
            super().connection_lost(exc)

        def handle_events(self) -> None:
            before: Any = self.cycle
            super().handle_events()
            if self.cycle is not before:
                self._expect_no_more()
            # A body that trickles in counts as waiting: the guard limits how long, this who gives way meanwhile.
            if self.cycle and not self.cycle.response_complete and self.conn.their_state is not h11.SEND_BODY:
                connections.asks(self.transport)

        def handle_websocket_upgrade(self, event: h11.Request) -> None:
            self._expect_no_more()
            connections.asks(self.transport)
            super().handle_websocket_upgrade(event)

        def on_response_complete(self) -> None:
            before: Any = self.cycle
            super().on_response_complete()
            if self.cycle is before and not self.transport.is_closing():
                connections.waits(self.transport, self._place)
                self._expect_request()

        def _expect_request(self) -> None:
            self._expect_no_more()
            self._deadline = self.loop.call_later(header_s, self.transport.abort)

        def _expect_no_more(self) -> None:
            if self._deadline is not None:
                self._deadline.cancel()
                self._deadline = None

    return LimitedProtocol
