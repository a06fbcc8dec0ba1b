"""The connections to vehicles that are wanted: asked of the link node, and again whenever it has forgotten them."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace

from server.door.lease import Lease
from server.errors import reported
from server.heard.node_states import Nodes
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError
from telemetry.topics.messages import LinkStatus
from telemetry.topics.requests import Adopt, Connect, Disconnect, Operator, Release, SetSigning

log = logging.getLogger("hedgehop.flying")


@dataclass(frozen=True, slots=True)
class Wish:
    """As in ``Connect``."""

    adopt: bool = False
    as_way: bool = False


class Connections:
    def __init__(self, link: LinkClient, nodes: Nodes, lease: Lease, *, configured: tuple[str, ...] = ()) -> None:
        self._link, self._nodes, self._lease = link, nodes, lease
        self._wanted = dict.fromkeys(configured, Wish(adopt=True, as_way=len(configured) > 1))
        """By address. Several that are configured for one vehicle are ways to it."""
        self._candidate: str | None = None
        self._met = False
        """Whether a link node has told what it holds: from then on this list is the truth, and not the node's."""
        self._last_fault = ""
        self.status: LinkStatus | None = None

    @property
    def wanted(self) -> list[str]:
        return list(self._wanted)

    async def ask_for_configured(self) -> None:
        """At the start: a link node that is just starting has told nothing yet."""
        for address in list(self._wanted):
            await self._ask_for(address)

    async def connect(self, operator: Operator, address: str, *, adopt: bool, as_way: bool = False) -> None:
        """Raises AddressError, ConnectionFailedError."""
        await self._nodes.link()
        await self._link.call(Connect(operator, address, adopt, as_way))
        self._wanted[address] = Wish(adopt, as_way)

    async def connect_all(self, operator: Operator, addresses: tuple[str, ...], *, adopt: bool) -> None:
        """Several ways to one vehicle. Raises as ``connect``; those before the one that is wrong stay."""
        for address in addresses:
            await self.connect(operator, address, adopt=adopt, as_way=True)

    async def disconnect(self, operator: Operator, address: str) -> None:
        """Raises NotAllowedError: there is none, or the vehicle needs it."""
        wish = self._wanted.pop(address, None)
        try:
            await self._link.call(Disconnect(operator, address))
        except NotAllowedError:
            if wish is not None and self.holds(address):
                self._wanted[address] = wish
            raise

    def holds(self, address: str) -> bool:
        """The link node has told so."""
        return self.status is not None and any(c.address == address for c in self.status.connections)

    async def forget(self, address: str) -> None:
        """Of a vehicle that the server itself started and that has ended."""
        self._wanted.pop(address, None)
        await self._nodes.link()
        await self._ask(Disconnect(self._lease.server_operator(), address), f"Disconnecting {address}")

    async def adopt(self, operator: Operator, candidate: str) -> None:
        await self._link.call(Adopt(operator, candidate))
        self._candidate = candidate

    async def set_signing(self, operator: Operator, *, enabled: bool) -> None:
        """Raises NotAllowedError in the air, SilentError."""
        await self._link.call(SetSigning(operator, enabled))

    async def release(self, operator: Operator) -> None:
        self._candidate = None
        # Otherwise a link node that is started again would adopt what was just let go of.
        self._wanted = {address: replace(wish, adopt=False) for address, wish in self._wanted.items()}
        await self._link.call(Release(operator))
        self._candidate = None  # a status from before may have come meanwhile

    async def on_status(self, status: LinkStatus) -> None:
        """What the node holds is taken over from a server before; what it lacks is asked for again."""
        self.status = status
        held = {connection.address: connection.as_way for connection in status.connections}
        if not self._met:
            new = held.keys() - self._wanted.keys()
            self._wanted |= {address: Wish(as_way=held[address]) for address in new}
            self._met = True
        if status.adopted is not None:
            self._candidate = status.adopted.id
        for address in [address for address in self._wanted if address not in held]:
            await self._ask_for(address)
        if status.adopted is None and self._candidate in {candidate.id for candidate in status.candidates}:
            await self._ask(Adopt(self._lease.server_operator(), self._candidate or ""), "Adopting the vehicle again")

    async def _ask_for(self, address: str) -> None:
        wish = self._wanted[address]
        request = Connect(self._lease.server_operator(), address, wish.adopt, wish.as_way)
        await self._ask(request, f"Connecting {address}")

    async def _ask(self, request: Connect | Disconnect | Adopt, doing: str) -> None:
        try:
            await self._link.call(request)
        except Exception as error:
            fault = reported(error, log, doing).what
            # Once a second it would fail the same way again.
            if fault != self._last_fault:
                log.warning("%s: %s", doing, fault)
            self._last_fault = fault
