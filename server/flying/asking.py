"""How the link node is asked: one method per answer, so that what comes back has its type."""

from __future__ import annotations

from typing import Any, Protocol

from telemetry.requests import LinkRequest


class Asks(Protocol):
    """The part of ``telemetry.link_client.LinkClient`` that the server uses."""

    async def call(self, request: LinkRequest) -> Any: ...
