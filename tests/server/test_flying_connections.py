"""Connections that are wanted are asked for again when the link node has forgotten them."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.heard.connections import Connections
from telemetry.errors import AddressError, ConnectionFailedError, NotAllowedError
from telemetry.topics.messages import Candidate, ConnectionStatus, LinkStatus
from telemetry.topics.requests import Adopt, Connect, Disconnect, Operator, Release

ME, SERVER = Operator("Anna", 5), Operator("Hedgehop", 5)
UDP, TCP = "udpin:0.0.0.0:14550", "tcp:10.0.0.7:5760"
QUAD = Candidate(f"{UDP}/10.0.0.9:14550/1/1", UDP, "10.0.0.9:14550", 1, 1, "ardupilot", 2)


class Link:
    """Keeps what it was asked; fails for what it was told to."""

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self.failing: dict[type, Exception] = {}

    async def call(self, request: Any) -> None:
        self.asked.append(request)
        if error := self.failing.get(type(request)):
            raise error


class Nodes:
    async def link(self) -> None:
        """It is there."""


def connections(link: Link, *configured: str) -> Connections:
    lease: Any = SimpleNamespace(server_operator=lambda: SERVER)
    return Connections(cast(Any, link), cast(Any, Nodes()), lease, configured=configured)


def status(*addresses: str, adopted: Candidate | None = None, candidates: tuple[Candidate, ...] = ()) -> LinkStatus:
    open_ = tuple(ConnectionStatus(address, "open") for address in addresses)
    return LinkStatus(0.0, connections=open_, candidates=candidates, adopted=adopted)


def test_what_was_configured_is_asked_for_and_adopts_the_first_vehicle() -> None:
    link = Link()
    asyncio.run(connections(link, UDP).on_status(status()))
    assert link.asked == [Connect(SERVER, UDP, True)]


def test_a_link_node_that_was_started_again_gets_everything_again() -> None:
    async def scenario() -> None:
        link = Link()
        wanted = connections(link)
        await wanted.connect(ME, UDP, adopt=False)
        await wanted.on_status(status(UDP, candidates=(QUAD,)))
        await wanted.adopt(ME, QUAD.id)
        await wanted.on_status(status(UDP, adopted=QUAD))
        link.asked.clear()
        await wanted.on_status(status())
        await wanted.on_status(status(UDP, candidates=(QUAD,)))
        assert link.asked == [Connect(SERVER, UDP, False), Adopt(SERVER, QUAD.id)]

    asyncio.run(scenario())


def test_a_new_server_takes_over_what_the_node_holds() -> None:
    async def scenario() -> None:
        link = Link()
        wanted = connections(link)
        await wanted.on_status(status(TCP, adopted=QUAD))
        assert (wanted.wanted, link.asked) == ([TCP], [])
        await wanted.on_status(status())
        assert link.asked == [Connect(SERVER, TCP, False)]

    asyncio.run(scenario())


def test_what_was_let_go_of_stays_so() -> None:
    async def scenario() -> None:
        link = Link()
        wanted = connections(link, UDP, TCP)
        await wanted.on_status(status(UDP, TCP, adopted=QUAD))
        await wanted.disconnect(ME, TCP)
        await wanted.release(ME)
        assert link.asked == [Disconnect(ME, TCP), Release(ME)]
        link.asked.clear()
        await wanted.on_status(status(UDP, TCP, candidates=(QUAD,)))
        await wanted.on_status(status(UDP, candidates=(QUAD,)))
        assert link.asked == []

    asyncio.run(scenario())


def test_a_connection_that_the_vehicle_needs_stays_wanted() -> None:
    async def scenario() -> None:
        link = Link()
        link.failing[Disconnect] = NotAllowedError("The vehicle may be flying.")
        wanted = connections(link, UDP)
        await wanted.on_status(status(UDP, adopted=QUAD))
        for address in (UDP, TCP):
            with pytest.raises(NotAllowedError):
                await wanted.disconnect(ME, address)
        assert wanted.wanted == [UDP]

    asyncio.run(scenario())


def test_a_status_from_before_a_release_adopts_nothing_again() -> None:
    class Slow(Link):
        async def call(self, request: Any) -> None:
            await super().call(request)
            if isinstance(request, Release):
                await wanted.on_status(status(UDP, adopted=QUAD))

    link = Slow()
    wanted = connections(link, UDP)

    async def scenario() -> None:
        await wanted.on_status(status(UDP, adopted=QUAD))
        await wanted.release(ME)
        await wanted.on_status(status(UDP, candidates=(QUAD,)))
        assert link.asked == [Release(ME)]

    asyncio.run(scenario())


def test_an_address_that_is_refused_is_not_tried_again() -> None:
    async def scenario() -> None:
        link = Link()
        link.failing[Connect] = AddressError("'/etc/passwd' names no connection.")
        wanted = connections(link)
        with pytest.raises(AddressError):
            await wanted.connect(ME, "/etc/passwd", adopt=True)
        assert wanted.wanted == []

    asyncio.run(scenario())


def test_a_fault_that_lasts_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    async def scenario() -> None:
        link = Link()
        link.failing[Connect] = ConnectionFailedError("Port 14550 is in use.")
        wanted = connections(link, UDP)
        for _ in range(5):
            await wanted.on_status(status())
        assert len(link.asked) == 5

    asyncio.run(scenario())
    assert caplog.text.count("Port 14550 is in use") == 1


def test_several_that_are_configured_for_one_vehicle_are_ways_to_it() -> None:
    link = Link()
    asyncio.run(connections(link, UDP, TCP).ask_for_configured())
    assert link.asked == [Connect(SERVER, UDP, True, True), Connect(SERVER, TCP, True, True)]


def test_a_new_server_knows_which_connections_are_ways() -> None:
    async def scenario() -> None:
        link = Link()
        wanted = connections(link)
        await wanted.on_status(LinkStatus(0.0, connections=(ConnectionStatus(UDP, "open", as_way=True),)))
        await wanted.on_status(status())
        assert link.asked == [Connect(SERVER, UDP, False, True)]

    asyncio.run(scenario())


def test_a_release_keeps_the_ways_and_adopts_nothing_by_itself() -> None:
    async def scenario() -> None:
        link = Link()
        wanted = connections(link)
        await wanted.connect_all(ME, (UDP, TCP), adopt=True)
        await wanted.release(ME)
        link.asked.clear()
        await wanted.on_status(status())
        assert link.asked == [Connect(SERVER, UDP, False, True), Connect(SERVER, TCP, False, True)]

    asyncio.run(scenario())
