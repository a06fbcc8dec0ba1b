"""One vehicle: the server's place on its bus, and everything that hangs on it."""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Coroutine
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planning.errors import DescribedError
from server.door.hub import Hub
from server.door.lease import Lease
from server.door.operators import Operators
from server.errors import reported
from server.flying.apart.other_vehicles import Other, known
from server.flying.checklist_desk import ChecklistDesk
from server.flying.checklists import Checklists
from server.flying.flight_desk import FlightDesk
from server.flying.in_flight.home_desk import HomeDesk
from server.flying.in_flight.take_up_desk import TakingUp
from server.flying.in_flight.way_desk import WayDesk
from server.flying.parameter_desk import ParameterDesk
from server.flying.plan_followed import PlanFollowed
from server.flying.recordings import Recording, TrackSoFar
from server.flying.simulation import Simulation
from server.flying.uploading.fence_heights_desk import FenceHeights
from server.flying.vehicle_log_desk import VehicleLogs
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
from server.obstacles.replayed import Replayed
from server.schemas import LinkMessage, NoticeMessage, ServerMessage, TransferMessage, VehicleAlarm, VehicleDoc
from server.schemas.station_docs import FIRST_VEHICLE
from server.settings import RUNTIME_FOLDER, DemoAutopilot
from server.studies.scenario_desk import ScenarioDesk
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.topics.messages import (
    FlightStatus,
    LinkStatus,
    RecorderStatus,
    ServerAlive,
    Topic,
    TransferStatus,
    VehicleText,
)
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.vehicle import RadarKind, VehicleState

log = logging.getLogger("hedgehop.flying")

ALIVE_EVERY_S = 1.0
APART_M = 15.0
"""From one of the demo's vehicles to the next."""
_CRITICAL, _CRITICAL_FOR_S = 2, 120.0
"""MAV_SEVERITY: emergency, alert and critical; for so long after it was said it is told where others are shown."""
_LINK_FAILS = 1, "The link has failed: no command reaches the vehicle. Take the pilot's transmitter."
_LINK_IS_BACK = 5, "The link answers again."
"""Each with its MAV_SEVERITY."""


@dataclass(frozen=True, slots=True)
class Shared:
    """What the vehicles of a station have in common."""

    library: Library
    hub: Hub
    workspace: Workspace
    scenarios: ScenarioDesk
    shelf: RecordingShelf
    lane: Lane
    replayed: Replayed
    checklists: Checklists
    channels: dict[int, Channel] = field(default_factory=dict)
    """By the vehicle's number."""

    def on_vehicle(self) -> None:
        """Without a surface model the 3D view shows the ground around the first vehicle's home."""
        armed = any(channel.armed for channel in self.channels.values())
        self.workspace.picture.on_vehicle(armed, self.channels[FIRST_VEHICLE].home)


@dataclass(frozen=True, slots=True)
class VehicleWanted:
    """A vehicle that the station was started for."""

    number: int
    name: str
    links: tuple[str, ...]
    is_alone: bool = True
    """Sentences about it need not name it."""
    demo_radar: RadarKind = "model"
    demo_world: bool = True
    demo_autopilot: DemoAutopilot = "ardupilot"
    demo_traffic: bool = False


class Flying:
    """Everything about one vehicle that the server does; all methods belong to the event loop."""

    def __init__(self, bus: Bus, lease: Lease, folder: Path, recordings: Path, wanted: VehicleWanted, shared: Shared):
        library, workspace, lane, number = shared.library, shared.workspace, shared.lane, wanted.number
        self.number, self.bus, self._shared, self._workspace = number, bus, shared, workspace
        pages = shared.hub.of_vehicle(number)
        self.name, called = wanted.name, "the vehicle" if wanted.is_alone else wanted.name
        self.lease, self.operators = lease, Operators(lease, shared.hub, number, called)
        self._present = present = Present(pages)
        runtime_dir = folder / RUNTIME_FOLDER
        link, aboard = LinkClient(bus, lease.issue_above), Aboard(folder / "onboard.json")
        self.nodes = Nodes(
            bus,
            runtime_dir,
            recordings,
            present,
            demo_radar=wanted.demo_radar,
            demo_autopilot=wanted.demo_autopilot,
            demo_traffic=wanted.demo_traffic,
        )
        self.agents = Agents(bus)
        self.live, self._aboard = Channel("live", present), aboard
        shared.channels[number] = self.live
        self._critical: VehicleText | None = None
        self.connections = Connections(link, self.nodes, lease, configured=wanted.links)
        self._obstacles = Obstacles(
            folder,
            bus,
            library,
            workspace,
            self.nodes,
            link,
            self.live,
            aboard,
            lane,
            lease,
            present,
            shared.replayed,
            workspace.sights if number == FIRST_VEHICLE else None,
        )
        self.obstacles, self.looking = self._obstacles.desk, self._obstacles.looking
        self.traffic, self.traffic_settings = self._obstacles.traffic, self._obstacles.traffic_desk
        self._watch = self._obstacles.watches["live"]
        work = FlightWork(library, link, workspace, lane)
        taking_up = TakingUp(link, self.live, workspace, library, lane, self._watch, aboard)
        self._checklist = checklist = ChecklistDesk(link, shared.checklists, aboard, bus)
        alone = wanted.is_alone
        self.desk = FlightDesk(
            link, work, aboard, checklist, workspace, self.live, self._watch, bus, present, taking_up, is_alone=alone
        )
        self.ways = WayDesk(link, self.live, workspace, library, lane, self._watch, present)
        self.home = HomeDesk(
            link, self.live, self.ways, lane, present, lease.server_operator, self.desk.on_home_set, bus
        )
        name = "" if alone else wanted.name
        self.parameters = ParameterDesk(link, self.live, aboard, library.root, self._on_parameters, name)
        self.heights = FenceHeights(link, self.live, aboard, lambda: self.desk.home_rises_m, self.parameters.on_written)
        self.recording = Recording(number, recordings, shared.shelf, self.nodes, present)
        self.logs = VehicleLogs(link, self.live, library, name)
        self.simulation = Simulation(
            library,
            workspace,
            self.nodes,
            self.connections,
            self._obstacles,
            lane,
            runtime_dir,
            demo_world=wanted.demo_world and number == FIRST_VEHICLE,
            aside_m=APART_M * (number - FIRST_VEHICLE),
        )
        self._followed = PlanFollowed(library, self.live, aboard, workspace)
        self._track_so_far = TrackSoFar(recordings, self.live, lane)

    @classmethod
    async def open(cls, wanted: VehicleWanted, shared: Shared) -> Flying:
        """Joins the bus; nodes that a server before this one has left running are taken over. Raises BusError."""
        folder = shared.library.vehicle_dir(wanted.number)
        recordings = await asyncio.to_thread(shared.shelf.folder_of, wanted.number)
        lease = await asyncio.to_thread(Lease, folder / "lease.json")
        bus = await Bus.open(folder / RUNTIME_FOLDER, "server")
        return cls(bus, lease, folder, recordings, wanted, shared)

    # Life

    def loops(self, *, demo: bool = False) -> list[Coroutine[Any, Any, None]]:
        """To be run by the application's task group until it ends."""
        starts = [self._start(demo=demo), *([self._start_demo()] if demo else [])]
        return [
            *self._relay().loops(),
            self.nodes.supervisor.run(),
            self._beat(),
            self._log_checklists(),
            self._hear_of_nodes(),
            self._followed.run(),
            self.home.run(),
            self.logs.run(),
            *self._obstacles.loops(),
            *starts,
        ]

    async def close(self) -> None:
        """Nodes go on while the vehicle is armed: the next server finds them again."""
        if not self.live.armed:
            await self.nodes.stop_all()
        self.live.close()
        await self.bus.close()

    async def _start(self, *, demo: bool) -> None:
        await self._obstacles.start()
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
            self._shared.hub.publish(NoticeMessage(level="warning", error=doc))

    async def _beat(self) -> None:
        while True:
            self.bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), os.getpid()))
            self.live.tick()
            self._obstacles.tick()
            await self.operators.look()
            await asyncio.sleep(ALIVE_EVERY_S)

    async def _log_checklists(self) -> None:
        """Changed texts, in the log of the first vehicle, as soon as its link is there to write it."""
        while self.number == FIRST_VEHICLE:
            await asyncio.sleep(ALIVE_EVERY_S)
            if self.connections.status is None or not self.nodes.link_answers:
                continue
            try:
                await self._checklist.log_changes(self.lease.server_operator())
            except DescribedError as error:
                log.warning("A changed checklist is not in the log of commands yet: %s", error)

    def on_plan(self) -> None:
        """Another document is open, or there is another answer to it."""
        self.desk.refresh()
        self._followed.look()
        self._obstacles.on_plan()

    async def _hear_of_nodes(self) -> None:
        """The link that flies for the operator fails, or is back: said at once, with what to do."""
        answered, restarts = True, self.nodes.link_restarts
        while True:
            await self.nodes.changed.wait()
            self.nodes.changed.clear()
            before, answered, restarts = (answered, restarts), self.nodes.link_answers, self.nodes.link_restarts
            if before != (answered, restarts):
                self._watch.on_link_process(answers=answered, has_ended=restarts > before[1])
            if before[0] != answered and self.live.armed:
                self.live.on_text(VehicleText(time.time(), *(_LINK_IS_BACK if answered else _LINK_FAILS)))

    # What is heard

    def _relay(self) -> Relay:
        relay = Relay(self.bus)
        relay.on(Topic.VEHICLE, self._on_state)
        relay.on(Topic.TEXT, self._on_text, each=True)
        relay.on(Topic.LINK, self._on_link)
        relay.on(Topic.TRANSFER, self._on_transfer)
        relay.on(Topic.FLIGHT, self._on_flight)
        relay.on(Topic.AVOIDANCE, self._on_avoidance)
        relay.on(Topic.RECORDER, self._on_recorder)
        self._obstacles.hear(relay)
        return relay

    def _on_parameters(self) -> None:
        self.desk.on_parameters()
        self.home.on_changed()

    def _on_transfer(self, transfer: TransferStatus) -> None:
        self._present.publish(TransferMessage(transfer=transfer))
        if transfer.direction == "upload" and transfer.phase in ("done", "failed"):
            self.home.on_changed()

    async def _on_state(self, state: VehicleState) -> None:
        was_armed = self.live.armed
        self.live.on_state(state)
        self.home.on_state(state)
        self._shared.on_vehicle()
        if was_armed and not state.armed:
            self.desk.on_disarmed()
        if state.armed and not was_armed:
            self._shared.scenarios.on_armed()
        await self._obstacles.on_state(state)

    def _on_text(self, text: VehicleText) -> None:
        if text.severity <= _CRITICAL:
            self._critical = text
        self.live.on_text(text)

    async def _on_link(self, status: LinkStatus) -> None:
        self._present.publish(LinkMessage(link=status))
        if status.adopted is None and self.live.state is not None:
            self.live.forget()
            self.home.forget()
            self._shared.on_vehicle()
        self.desk.on_link(status)
        self.ways.on_link(self._aboard.vehicle)
        self.home.on_link(self._aboard.vehicle)
        self._followed.look()
        await self.connections.on_status(status)
        await self.simulation.on_link(status)
        await self._obstacles.on_link(status)

    def _on_flight(self, flight: FlightStatus) -> None:
        self.live.on_flight(flight)
        self.desk.on_flight(flight)
        self.ways.on_flight(flight)

    def _on_avoidance(self, status: AvoidanceStatus) -> None:
        self._watch.on_avoidance(status)
        self.desk.refresh()

    async def _on_recorder(self, status: RecorderStatus) -> None:
        self.recording.on_status(status)
        await self._track_so_far.on_status(status)

    def as_other(self) -> Other:
        """As vehicles that wait for their start are held against it."""
        status = self.connections.status
        is_verified = status is not None and status.mission_state == "verified" and self._aboard.record is not None
        is_verified = is_verified and self._followed.is_settled
        return known(self.name, self.live, is_verified=is_verified, waits_in_air=self.desk.waits_in_air)

    # Pages and who is in charge

    def doc(self, near: VehicleAlarm | None) -> VehicleDoc:
        """For pages that show another vehicle. ``near``: the alarm, where another one comes near."""
        state, status, holder = self.live.state, self.connections.status, self.lease.holder
        record, answers = self._aboard.record, self.nodes.link_answers
        known = VehicleDoc(
            number=self.number,
            name=self.name,
            link="none" if status is None else status.state if answers or status.state == "none" else "lost",
            silent_s=None if status is None or not answers else status.silent_s,
            phase=self.live.flight.phase,
            holder=None if holder is None else holder.name,
            plan_name="" if record is None else record.name,
            alarm=self._loss() or near or self._alert(),
        )
        if state is None:
            return known
        seen = {
            "lat_deg": state.lat_deg,
            "lon_deg": state.lon_deg,
            "alt_rel_home_m": state.alt_rel_home_m,
            "ground_speed_m_s": state.ground_speed_m_s,
            "mode": state.mode,
            "armed": state.armed,
            "battery_share": state.battery_share,
        }
        return known.model_copy(update=seen)

    def _loss(self) -> VehicleAlarm | None:
        """Comes first: what a sensor said before it is old."""
        status = self.connections.status
        if self.live.armed and not self.nodes.link_answers:
            return VehicleAlarm(kind="loss", key="link", text=_LINK_FAILS[1])
        if self.live.armed and status is not None and status.state == "lost":
            text = "Nothing is heard of it any more. Take the pilot's transmitter."
            return VehicleAlarm(kind="loss", key="lost", text=text)
        return None

    def _alert(self) -> VehicleAlarm | None:
        critical = self._critical
        for doc in self._watch.state.alerts:
            if not doc.over and not doc.acknowledged:
                return VehicleAlarm(kind="alert", key=doc.alert.id, text=doc.alert.text)
        if self.live.state is not None and self.live.state.fence_breach not in (None, "none"):
            text = "The vehicle says that it is beyond its fence."
            return VehicleAlarm(kind="alert", key=f"fence {self.live.state.fence_breach}", text=text)
        if critical is not None and time.time() - critical.t_utc_s < _CRITICAL_FOR_S:
            return VehicleAlarm(kind="alert", key=f"{critical.t_utc_s} {critical.text}", text=critical.text)
        return None

    def present_for(self, session_key: str) -> list[ServerMessage]:
        """What a page is told right after its snapshot."""
        return [*self._present.messages(), self.operators.message(session_key)]
