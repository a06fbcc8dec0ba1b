"""Which node processes run, and what the pages are told of them."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

from server.heard.ground_task import Ground
from server.schemas import NodeDoc, NodesMessage, Pages
from server.settings import DemoAutopilot
from server.work.supervisor import NodeState, Supervisor
from telemetry.bus.bus import Bus
from telemetry.bus.liveness import START_S
from telemetry.bus.node_lock import running_node, running_nodes
from telemetry.topics.obstacles import SENSORS, Sensor
from telemetry.topics.recording_requests import RecorderRequest, ReplayRequest, StartRecording
from telemetry.topics.station_recordings import RecordingsRequest
from telemetry.topics.vehicle import RadarKind

LINK, RECORDER, REPLAY, SIMULATOR = "link", "recorder", "replay", "simulator"
TRACKS = "tracks"
SIMULATED_SENSORS = "sensors"
STATIONS = "stations"

_SENSOR_SEED = 1
_RETURN_HEIGHT: dict[DemoAutopilot, str] = {"ardupilot": "RTL_ALT={1:.0f}", "px4": "RTL_RETURN_ALT={0:.2f}"}
"""For metres and centimetres above home."""
_LOOK_AGAIN_S = 0.5
_APPEARS_S = 3.0
"""A stations node that is not there is not waited for: its file may be missing."""
_CALL_TIMEOUT_S = 15.0
"""Of a node that has been up, on a busy machine."""


class Nodes:
    """Starts nodes when they are needed. Those that outlived a server before this one are taken over."""

    def __init__(
        self,
        bus: Bus,
        runtime_dir: Path,
        recordings_dir: Path,
        pages: Pages,
        *,
        demo_radar: RadarKind = "model",
        demo_autopilot: DemoAutopilot = "ardupilot",
        demo_traffic: bool = False,
    ) -> None:
        self._bus, self._runtime_dir, self._recordings_dir, self._pages = bus, runtime_dir, recordings_dir, pages
        self._demo_traffic = demo_traffic
        self._demo_radar: RadarKind = demo_radar
        self._demo_autopilot: DemoAutopilot = demo_autopilot
        self.supervisor = Supervisor(runtime_dir, changed=self._changed)
        self.changed = asyncio.Event()
        """Set whenever a node's state is another."""

    @property
    def link_answers(self) -> bool:
        """False while it hangs or is being started again; true before it is first wanted, too."""
        return not any(n.name == LINK and n.state in ("silent", "restarting") for n in self.supervisor.states)

    @property
    def link_restarts(self) -> int:
        """How often it has ended and was started again."""
        return next((node.restarts for node in self.supervisor.states if node.name == LINK), 0)

    async def simulator_link(self) -> str | None:
        """Where the simulated vehicle sends to, if one runs."""
        facts = await asyncio.to_thread(running_node, self._runtime_dir, SIMULATOR)
        if facts is None or "--link" not in facts.arguments:
            return None
        return facts.arguments[facts.arguments.index("--link") + 1]

    async def simulator_is_wanted(self) -> bool:
        """One runs, or is about to run again."""
        states = {node.name: node.state for node in self.supervisor.states}
        return states.get(SIMULATOR, "stopped") != "stopped" or await self.simulator_link() is not None

    async def link(self) -> None:
        """With the recorder: a flight that nobody recorded cannot be looked at again."""
        await self.supervisor.start(LINK, [])
        await self.recorder()

    async def recorder(self) -> None:
        await self.supervisor.start(RECORDER, ["--recordings", str(self._recordings_dir)])

    async def replay(self) -> None:
        await self.supervisor.start(REPLAY, [])

    async def ask_recorder(self, request: RecorderRequest) -> object:
        await self.recorder()
        result = str if isinstance(request, StartRecording) else type(None)
        return await self._bus.call(RECORDER, request, result=result, timeout_s=self._patience_s(RECORDER))

    async def ask_replay(self, request: ReplayRequest) -> object:
        await self.replay()
        return await self._bus.call(REPLAY, request, result=type(None), timeout_s=self._patience_s(REPLAY))

    def _patience_s(self, name: str) -> float:
        """One that is started for the first time may load for as long as its supervisor lets it."""
        is_loading = any(node.name == name and node.state == "starting" for node in self.supervisor.states)
        return _CALL_TIMEOUT_S + START_S if is_loading else _CALL_TIMEOUT_S

    async def sensor(self, sensor: Sensor) -> None:
        """A map, regions and alerts of what one sensor sends."""
        await self.supervisor.start(sensor, [])

    async def running_sensors(self) -> set[Sensor]:
        """Those whose node runs, whoever has started it."""
        facts = await asyncio.to_thread(running_nodes, self._runtime_dir)
        running = {each.name for each in facts}
        return {sensor for sensor in SENSORS if sensor in running}

    async def tracks(self) -> None:
        """Moving objects in what the radar sends."""
        await self.supervisor.start(TRACKS, [])

    async def stations(self, name: str, routers: Sequence[str], file: Path, fetched: Path) -> None:
        """Vehicles of other stations, met at a router; ``fetched``: where their recordings lie until they are whole."""
        arguments = [part for router in routers for part in ("--router", router)]
        arguments += ["--file", str(file.absolute()), "--fetched", str(fetched.absolute())]
        await self.supervisor.start(STATIONS, ["--station", name, *arguments])

    async def ask_stations(self, request: RecordingsRequest) -> None:
        """Raises StationsError, BusError."""
        await self._bus.call(STATIONS, request, result=type(None), timeout_s=_CALL_TIMEOUT_S, appears_s=_APPEARS_S)

    async def no_stations(self) -> None:
        """Ends one that a server before this one, which met other stations, has left running."""
        while await asyncio.to_thread(running_node, self._runtime_dir, STATIONS) is not None:
            await self.supervisor.stop(STATIONS)
            await asyncio.sleep(_LOOK_AGAIN_S)  # it is not taken over yet

    async def simulated_sensors(self, ground: Ground, world: Path) -> None:
        """Radar, camera and its pose, of the simulated vehicle in its world."""
        arguments = ["--world", str(world), "--dsm", str(ground.path), "--seed", str(_SENSOR_SEED)]
        arguments += ["--radar", self._demo_radar]
        await self.supervisor.start(SIMULATED_SENSORS, arguments)

    async def simulator(self, ground: Ground, link: str, *, rtl_height_m: float, world: Path | None = None) -> None:
        """Set up as the plan's profile says of its vehicle; ``world``: what it may crash into."""
        home = f"{ground.home_lat_deg:.9f},{ground.home_lon_deg:.9f},{ground.home_alt_m:.3f}"
        rtl = _RETURN_HEIGHT[self._demo_autopilot].format(rtl_height_m, 100 * rtl_height_m)
        arguments = ["--home", home, "--dsm", str(ground.path), "--link", link, "--parameter", rtl]
        arguments += ["--autopilot", self._demo_autopilot]
        if world is not None:
            arguments += ["--world", str(world)]
        if self._demo_traffic:
            arguments.append("--traffic")
        await self.supervisor.start(SIMULATOR, arguments)

    async def stop_all(self) -> None:
        """The simulated vehicle last: until then its link may say farewell."""
        for names in ((REPLAY, LINK, RECORDER, SIMULATED_SENSORS, TRACKS, STATIONS, *SENSORS), (SIMULATOR,)):
            await asyncio.gather(*(self.supervisor.stop(name) for name in names))

    def _changed(self, nodes: Sequence[NodeState]) -> None:
        docs = [NodeDoc(name=n.name, state=n.state, restarts=n.restarts, text=n.text) for n in nodes]
        self._pages.publish(NodesMessage(nodes=docs))
        self.changed.set()
