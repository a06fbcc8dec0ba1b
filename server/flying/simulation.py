"""The simulated vehicle: a node of its own at the open plan's home, connected as any other vehicle would be."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Protocol

from server import demo
from server.errors import NotReadyError
from server.flying.connections import Connections
from server.flying.ground_task import Ground, export_ground, write_demo_world
from server.flying.nodes import Nodes
from server.jobs import Lane
from server.library import Library
from server.schemas import PlanDoc
from telemetry.requests import Operator

_OUT, _IN = "udpout:", "udpin:"


class Plans(Protocol):
    """The part of the workspace that is used here."""

    @property
    def document(self) -> PlanDoc: ...

    @property
    def planned_home(self) -> tuple[float, float] | None: ...


class Simulation:
    """Starts it once, on a free loopback port, with the surface model as its ground."""

    def __init__(
        self,
        library: Library,
        plans: Plans,
        nodes: Nodes,
        connections: Connections,
        lane: Lane,
        runtime_dir: Path,
        *,
        demo_world: bool = True,
        sees: Callable[[Ground, Path], Awaitable[None]] | None = None,
    ) -> None:
        """``sees`` is called where the vehicle gets a world of its own, with that world's file."""
        self._library, self._plans, self._nodes, self._connections = library, plans, nodes, connections
        self._lane, self._ground_file = lane, runtime_dir / "ground.tif"
        self._port_file = runtime_dir / "simulator-port.txt"
        self._world_file, self._demo_world, self._sees = runtime_dir / "world.json", demo_world, sees
        self._starting = asyncio.Lock()

    async def start(self, operator: Operator) -> None:
        """Raises NotReadyError without a surface model and a home. One that runs already goes on where it is."""
        async with self._starting:
            link = await self._nodes.simulator_link()
            if link is None:
                ground, link = await self._make_ground(), f"{_OUT}127.0.0.1:{self._port()}"
                await self._start_node(ground, link)
            await self._connections.connect(operator, link.replace(_OUT, _IN), adopt=True)

    async def _start_node(self, ground: Ground, link: str) -> None:
        document = self._plans.document
        known = demo.terrain(self._library)
        world = None
        if self._demo_world and known is not None and document.terrain_id == known.id:
            world = self._world_file
            await self._lane.call(write_demo_world, world)
        await self._nodes.simulator(ground, link, rtl_height_m=document.profile.rtl_height_m, world=world)
        if world is not None and self._sees is not None:
            await self._sees(ground, world)

    def _port(self) -> int:
        """The same as last time if it can be had: the link node remembers its connections."""
        try:
            last = int(self._port_file.read_text(encoding="ascii"))
        except (FileNotFoundError, ValueError):
            last = 0
        port = free_udp_port(last)
        self._port_file.write_text(f"{port}\n", encoding="ascii")
        return port

    async def _make_ground(self) -> Ground:
        document, home = self._plans.document, self._plans.planned_home
        if document.terrain_id is None or home is None:
            raise NotReadyError(
                "A simulated vehicle needs a place to stand.", advice="Open a plan with a surface model and a point."
            )
        directory = self._library.terrain_dir(document.terrain_id)
        return await self._lane.call(export_ground, directory, self._ground_file, home)


def free_udp_port(wanted: int = 0) -> int:
    """Free a moment ago, on loopback: whoever takes it meanwhile shows as a connection that cannot be opened."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", wanted))
        except (OSError, OverflowError):
            probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
