"""Flying as a whole: the server's place on the bus, and everything that hangs on it."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
import time
from collections.abc import Coroutine
from typing import Any

from server.door.hub import Hub
from server.door.lease import Lease
from server.door.operators import Operators
from server.errors import reported
from server.flying.flight_desk import FlightDesk
from server.flying.plan_followed import PlanFollowed
from server.flying.recordings import RecordingDesk, TrackSoFar
from server.flying.reviewing import Reviewing
from server.flying.scenery import Scenery
from server.flying.simulation import Simulation
from server.flying.work import FlightWork
from server.heard.agents import Agents
from server.heard.channel import Channel
from server.heard.connections import Connections
from server.heard.node_states import Nodes
from server.heard.onboard import Aboard
from server.heard.present import Present
from server.heard.relay import Relay
from server.library import Library
from server.library.recording_list import RecordingShelf
from server.obstacles.obstacles import Obstacles
from server.schemas import (
    LinkMessage,
    NoticeMessage,
    ServerMessage,
    TransferMessage,
)
from server.settings import Settings
from server.studies.scenario_desk import ScenarioDesk
from server.traversability.live_uwb import LiveUwb
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.topics.messages import FlightStatus, LinkStatus, RecorderStatus, ServerAlive, Topic, VehicleText
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")

RUNTIME_FOLDER = "run"
ALIVE_EVERY_S = 1.0
_LINK_FAILS = 1, "The link has failed: no command reaches the vehicle. Take the pilot's transmitter."
_LINK_IS_BACK = 5, "The link answers again."
"""Each with its MAV_SEVERITY."""


class Flying:
    """Everything about vehicles that the server does; all methods belong to the event loop."""

    def __init__(
        self,
        bus: Bus,
        lease: Lease,
        library: Library,
        hub: Hub,
        workspace: Workspace,
        scenarios: ScenarioDesk,
        settings: Settings,
    ) -> None:
        self._bus, self._hub, self._workspace, self._scenarios = bus, hub, workspace, scenarios
        self.lease, self.operators = lease, Operators(lease, hub)
        self._present = present = Present(hub)
        self._lane = lane = Lane("flight")
        runtime_dir, board = library.root / RUNTIME_FOLDER, workspace.board
        link, aboard = LinkClient(bus, lease.issue_above), Aboard(library.root / "onboard.json")
        self.shelf = RecordingShelf(library)
        self.nodes = Nodes(bus, runtime_dir, self.shelf.folder, present, demo_radar=settings.demo_radar)
        self.agents = Agents(bus)
        self.live, self.replay = Channel("live", present), Channel("replay", present)
        self.connections = Connections(link, self.nodes, lease, configured=settings.link)
        self._obstacles = Obstacles(bus, library, workspace, self.nodes, link, self.live, aboard, lane, lease, present)
        self.obstacles, self.looking = self._obstacles.desk, self._obstacles.looking
        self._watch = self._obstacles.watches["live"]
        work = FlightWork(library, link, workspace, lane)
        self.desk = FlightDesk(link, work, aboard, workspace, self.live, self._watch, bus, present)
        self.reviewing = Reviewing(
            library,
            self.shelf,
            workspace.on_show,
            self.replay,
            self.nodes,
            board,
            self._obstacles.watches["replay"],
            self._obstacles.tracks["replay"],
            present,
        )
        self.recording = RecordingDesk(self.shelf, self.nodes, board, self.reviewing, present)
        self.simulation = Simulation(
            library,
            workspace,
            self.nodes,
            self.connections,
            self._obstacles,
            lane,
            runtime_dir,
            demo_world=settings.demo_world,
        )
        self.uwb = LiveUwb(workspace.traversability, library, bus)
        self._scenery = Scenery(workspace.stage, {"live": self.live, "replay": self.replay})
        self._followed = PlanFollowed(library, self.live, aboard, workspace)
        self._track_so_far = TrackSoFar(self.shelf.folder, self.live, lane)

    @classmethod
    async def open(
        cls, settings: Settings, library: Library, hub: Hub, workspace: Workspace, scenarios: ScenarioDesk
    ) -> Flying:
        """Joins the bus; nodes that a server before this one has left running are taken over. Raises BusError."""
        lease = await asyncio.to_thread(Lease, library.root / "lease.json")
        bus = await Bus.open(library.root / RUNTIME_FOLDER, "server")
        return cls(bus, lease, library, hub, workspace, scenarios, settings)

    # Life

    def loops(self, *, demo: bool = False) -> list[Coroutine[Any, Any, None]]:
        """To be run by the application's task group until it ends."""
        starts = [self._start(demo=demo), *([self._start_demo()] if demo else [])]
        return [
            *self._relay().loops(),
            self.nodes.supervisor.run(),
            self._beat(),
            self._hear_of_plan(),
            self._hear_of_nodes(),
            self._scenery.run(),
            self._followed.run(),
            *self.uwb.loops(),
            *self._obstacles.loops(),
            *starts,
        ]

    async def close(self) -> None:
        """Nodes go on while a vehicle is armed: the next server finds them again."""
        if self.live.armed:
            sys.stdout.write(_LEFT_FLYING)
            sys.stdout.flush()
        else:
            await self.nodes.stop_all()
        self.live.close()
        self.replay.close()
        await self._lane.close()
        await self._bus.close()

    async def _start(self, *, demo: bool) -> None:
        await self._obstacles.start()
        await self.recording.refresh()
        if self.connections.wanted or demo:
            await self.nodes.link()
            await self.connections.ask_for_configured()
        self.desk.tell_recorder()

    async def _start_demo(self) -> None:
        """Once the demo's plan is open; whoever is in charge by then stays so."""
        try:
            await self._workspace.terrains.demo_is_open.wait()
            await self.simulation.start(self.lease.server_operator())
        except Exception as error:
            doc = reported(error, log, "Starting the simulated vehicle")
            self._hub.publish(NoticeMessage(level="warning", error=doc))

    async def _beat(self) -> None:
        while True:
            self._bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), os.getpid()))
            self.live.tick()
            self._obstacles.tick()
            await self.operators.look()
            await asyncio.sleep(ALIVE_EVERY_S)

    async def _hear_of_plan(self) -> None:
        """Another document is open, or there is another answer to it."""
        while True:
            await self._workspace.changed.wait()
            self._workspace.changed.clear()
            self.desk.refresh()
            self._followed.look()
            self._obstacles.on_plan()

    async def _hear_of_nodes(self) -> None:
        """The link that flies for the operator fails, or is back: said at once, with what to do."""
        answered = True
        while True:
            await self.nodes.changed.wait()
            self.nodes.changed.clear()
            answers = self.nodes.link_answers
            if answers == answered:
                continue
            answered = answers
            self._watch.on_link_process(answers=answers)
            if self.live.armed:
                self.live.on_text(VehicleText(time.time(), *(_LINK_IS_BACK if answers else _LINK_FAILS)))

    # What is heard

    def _relay(self) -> Relay:
        relay, present = Relay(self._bus), self._present
        relay.on(Topic.VEHICLE, self._on_state)
        relay.on(Topic.TEXT, self.live.on_text, each=True)
        relay.on(Topic.LINK, self._on_link)
        # Its scans are placed between positions: each one counts.
        relay.on(Topic.VEHICLE, self.uwb.on_state, each=True)
        relay.on(Topic.UWB_SCAN, self.uwb.on_scan, each=True)
        relay.on(Topic.TRANSFER, lambda transfer: present.publish(TransferMessage(transfer=transfer)))
        relay.on(Topic.FLIGHT, self._on_flight)
        relay.on(Topic.AVOIDANCE, self._on_avoidance)
        relay.on(Topic.RECORDER, self._on_recorder)
        relay.on(Topic.REPLAY, self.reviewing.on_status)
        relay.on(Topic.VEHICLE, self.replay.on_state, replayed=True)
        relay.on(Topic.TEXT, self.replay.on_text, replayed=True, each=True)
        relay.on(Topic.FLIGHT, self.replay.on_flight, replayed=True)
        self._obstacles.hear(relay)
        return relay

    def _on_state(self, state: VehicleState) -> None:
        was_armed = self.live.armed
        self.live.on_state(state)
        self._workspace.picture.on_vehicle(self.live.armed, self.live.home)
        if was_armed and not state.armed:
            self.desk.on_disarmed()
        if state.armed and not was_armed:
            self._scenarios.on_armed()

    async def _on_link(self, status: LinkStatus) -> None:
        self._present.publish(LinkMessage(link=status))
        if status.adopted is None and self.live.state is not None:
            self.live.forget()
            self._workspace.picture.on_vehicle(False, None)
        self.desk.on_link(status)
        self._followed.look()
        await self.connections.on_status(status)
        await self.simulation.on_link(status)
        await self._obstacles.on_link(status)

    def _on_flight(self, flight: FlightStatus) -> None:
        self.live.on_flight(flight)
        self.desk.on_flight(flight)

    def _on_avoidance(self, status: AvoidanceStatus) -> None:
        self._watch.on_avoidance(status)
        self.desk.refresh()

    async def _on_recorder(self, status: RecorderStatus) -> None:
        await self.recording.on_status(status)
        await self._track_so_far.on_status(status)

    # Pages and who is in charge

    def present_for(self, session_key: str) -> list[ServerMessage]:
        """What a page is told right after its snapshot."""
        return [*self._present.messages(), self.operators.message(session_key)]


_LEFT_FLYING = (
    "The vehicle is armed: its link and the recording go on without the server, for 10 seconds.\n"
    "Start Hedgehop again within that time to stay in touch. After it, Hedgehop falls silent and the vehicle's own\n"
    "failsafe decides; in GUIDED it is told to hold its position first.\n"
)
