"""The simulated vehicle: a node of its own at the open plan's home, connected as any other vehicle would be."""

from __future__ import annotations

import asyncio
import socket
from pathlib import Path

from mapping.geometry.frames import moved_deg
from server.errors import NotReadyError
from server.heard.connections import Connections
from server.heard.ground_task import Ground, export_ground, write_demo_world
from server.heard.node_states import Nodes
from server.library import Library
from server.obstacles.obstacles import Obstacles
from server.plan import demo
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.topics.messages import LinkStatus
from telemetry.topics.requests import Operator

_OUT, _IN = "udpout:", "udpin:"


class Simulation:
    """Starts it once, on a free loopback port, with the surface model as its ground."""

    def __init__(
        self,
        library: Library,
        workspace: Workspace,
        nodes: Nodes,
        connections: Connections,
        obstacles: Obstacles,
        lane: Lane,
        runtime_dir: Path,
        *,
        demo_world: bool = True,
        aside_m: float = 0.0,
    ) -> None:
        """``aside_m``: east of the plan's home, where another one stands there."""
        self._library, self._workspace, self._nodes, self._connections = library, workspace, nodes, connections
        self._obstacles = obstacles
        self._lane, self._ground_file = lane, runtime_dir / "ground.tif"
        self._port_file = runtime_dir / "simulator-port.txt"
        self._world_file, self._demo_world = runtime_dir / "world.json", demo_world
        self._aside_m = aside_m
        self._starting = asyncio.Lock()
        self._last_port = self._read_port()

    async def start(self, operator: Operator) -> None:
        """Raises NotReadyError without a surface model and a home. One that runs already goes on where it is."""
        async with self._starting:
            link = await self._nodes.simulator_link()
            if link is None:
                ground = await self._make_ground()
                link = f"{_OUT}127.0.0.1:{await self._port()}"
                await self._start_node(ground, link)
            await self._connections.connect(operator, link.replace(_OUT, _IN), adopt=True)

    async def on_link(self, status: LinkStatus) -> None:
        """The address of one that has ended goes: whatever starts the next one connects to it again."""
        address = _address(self._last_port)
        if self._starting.locked() or not any(connection.address == address for connection in status.connections):
            return
        async with self._starting:
            if not await self._nodes.simulator_is_wanted():
                await self._connections.forget(address)

    async def _start_node(self, ground: Ground, link: str) -> None:
        document = self._workspace.document
        known = demo.terrain(self._library)
        world = None
        if self._demo_world and known is not None and document.terrain_id == known.id:
            world = self._world_file
            await self._lane.call(write_demo_world, world)
        await self._nodes.simulator(ground, link, rtl_height_m=document.profile.rtl_height_m, world=world)
        if world is not None:
            await self._obstacles.simulated(ground, world)

    async def _port(self) -> int:
        """The same as last time if it can be had; else the link node does not go on listening at the last one."""
        last, port = self._last_port, self._last_port
        if not last or not self._connections.holds(_address(last)):
            port = free_udp_port(last)
        if last and port != last:
            await self._connections.forget(_address(last))
        self._last_port = port
        self._port_file.write_text(f"{port}\n", encoding="ascii")
        return port

    def _read_port(self) -> int:
        try:
            return int(self._port_file.read_text(encoding="ascii"))
        except (OSError, ValueError):
            return 0

    async def _make_ground(self) -> Ground:
        document, home = self._workspace.document, self._workspace.planned_home
        if document.terrain_id is None or home is None:
            raise NotReadyError(
                "A simulated vehicle needs a place to stand.", advice="Open a plan with a surface model and a point."
            )
        directory = self._library.terrain_dir(document.terrain_id)
        return await self._lane.call(export_ground, directory, self._ground_file, moved_deg(home, self._aside_m, 0.0))


def _address(port: int) -> str:
    """Where the link node listens for it."""
    return f"{_IN}127.0.0.1:{port}"


def free_udp_port(wanted: int = 0) -> int:
    """Free a moment ago, on loopback: whoever takes it meanwhile shows as a connection that cannot be opened."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", wanted))
        except (OSError, OverflowError):
            probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
