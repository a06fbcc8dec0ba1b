"""At which address the simulated vehicle is listened for, and that no address of an ended one stays."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.flying.simulation import Simulation, free_udp_port
from server.heard.connections import Connections
from server.heard.ground_task import Ground
from server.schemas import PlanDoc
from telemetry.topics.messages import ConnectionStatus, LinkStatus
from telemetry.topics.requests import Connect, Disconnect, Operator

ME, SERVER = Operator("Anna", 5), Operator("Hedgehop", 5)
TYPED = "udpin:0.0.0.0:14550"


class Link:
    """A link node that holds what it is asked to."""

    def __init__(self, *held: str) -> None:
        self.held = list(held)
        self.asked: list[Any] = []

    async def call(self, request: Any) -> None:
        self.asked.append(request)
        if isinstance(request, Connect) and request.address not in self.held:
            self.held.append(request.address)
        elif isinstance(request, Disconnect):
            self.held.remove(request.address)

    @property
    def status(self) -> LinkStatus:
        return LinkStatus(0.0, connections=tuple(ConnectionStatus(address, "waiting") for address in self.held))


class Nodes:
    """``running``: where the simulated vehicle sends to."""

    def __init__(self) -> None:
        self.running: str | None = None

    async def link(self) -> None:
        """The link node is there."""

    async def simulator_link(self) -> str | None:
        return self.running

    async def simulator_is_wanted(self) -> bool:
        return self.running is not None

    async def simulator(self, ground: Ground, link: str, **_others: object) -> None:
        self.running = link


class Lane:
    async def call(self, *_task: object) -> Ground:
        return Ground(Path("ground.tif"), 37.0, 15.0, 100.0)


class Station:
    """A server with what hangs on it; the next one finds the same folder and the same link node."""

    def __init__(self, folder: Path, link: Link) -> None:
        self.link, self.nodes = link, Nodes()
        self.connections = Connections(
            cast(Any, link), cast(Any, self.nodes), cast(Any, SimpleNamespace(server_operator=lambda: SERVER))
        )
        self.simulation = Simulation(
            cast(Any, SimpleNamespace(terrain_dir=Path)),
            cast(Any, SimpleNamespace(document=PlanDoc(terrain_id="t"), planned_home=(37.0, 15.0))),
            cast(Any, self.nodes),
            self.connections,
            cast(Any, None),
            cast(Any, Lane()),
            folder,
            demo_world=False,
        )

    async def hear(self) -> None:
        await self.connections.on_status(self.link.status)
        await self.simulation.on_link(self.link.status)


@pytest.fixture(autouse=True)
def _no_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.plan.demo.terrain", lambda _library: None)


def port_of(address: str) -> int:
    return int(address.rpartition(":")[2])


def test_what_the_next_server_starts_is_listened_for_at_the_same_address(tmp_path: Path) -> None:
    async def scenario() -> None:
        link = Link(TYPED)
        first = Station(tmp_path, link)
        await first.simulation.start(ME)
        (address,) = set(link.held) - {TYPED}
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
            listening.bind(("127.0.0.1", port_of(address)))  # the link node still does
            second = Station(tmp_path, link)
            await second.connections.on_status(link.status)
            await second.simulation.start(ME)
        assert link.held == [TYPED, address]

    asyncio.run(scenario())


def test_an_address_that_cannot_be_had_again_is_given_up(tmp_path: Path) -> None:
    async def scenario() -> None:
        link = Link(TYPED)
        await Station(tmp_path, link).simulation.start(ME)
        (before,) = set(link.held) - {TYPED}
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("127.0.0.1", port_of(before)))
            await Station(tmp_path, link).simulation.start(ME)  # it has not heard of what the link node holds
        assert len(link.held) == 2
        assert before not in link.held

    asyncio.run(scenario())


def test_the_address_of_a_simulated_vehicle_that_has_ended_goes_and_a_typed_one_stays(tmp_path: Path) -> None:
    async def scenario() -> None:
        link = Link(TYPED)
        station = Station(tmp_path, link)
        await station.simulation.start(ME)
        await station.hear()
        assert len(link.held) == 2
        station.nodes.running = None
        await station.hear()
        await station.hear()
        assert link.held == station.connections.wanted == [TYPED]

    asyncio.run(scenario())


def test_a_server_without_a_simulated_vehicle_clears_up_after_the_one_before(tmp_path: Path) -> None:
    async def scenario() -> None:
        port = free_udp_port()
        (tmp_path / "simulator-port.txt").write_text(f"{port}\n", encoding="ascii")
        link = Link(TYPED, f"udpin:127.0.0.1:{port}")
        await Station(tmp_path, link).hear()
        assert link.held == [TYPED]

    asyncio.run(scenario())


def test_one_that_outlived_the_server_keeps_its_address(tmp_path: Path) -> None:
    async def scenario() -> None:
        link = Link()
        first = Station(tmp_path, link)
        await first.simulation.start(ME)
        second = Station(tmp_path, link)
        second.nodes.running = first.nodes.running
        await second.hear()
        assert len(link.held) == 1
        assert not any(isinstance(request, Disconnect) for request in link.asked)

    asyncio.run(scenario())
