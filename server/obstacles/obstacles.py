"""Obstacles as a whole: what hangs on the bus for them, and what the rest of flying tells them."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

from server.door.lease import Lease
from server.errors import reported
from server.heard.channel import Channel
from server.heard.ground_task import Ground
from server.heard.node_states import Nodes
from server.heard.onboard import Aboard
from server.heard.relay import Relay
from server.library import Library
from server.obstacles.coming_down import ComingDown
from server.obstacles.drawing import MapDrawing
from server.obstacles.manoeuvres import Manoeuvres
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_desk import ObstacleDesk
from server.obstacles.obstacle_watch import Watch
from server.obstacles.replayed import MAPS, STATUSES, Replayed
from server.obstacles.section import Looking
from server.obstacles.sensor_nodes import KnownGround, SensorNodes
from server.obstacles.surroundings import Surroundings
from server.obstacles.traffic import TrafficDesk, TrafficWatch
from server.scene.layers.sights import Sights
from server.schemas import Pages, Source
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.messages import LinkStatus, Topic
from telemetry.topics.obstacles import SENSORS, Sensor
from telemetry.topics.requests import WholeMap
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.obstacles")

_ASK_EVERY_S = 2.0


class Obstacles:
    """All methods belong to the event loop; each topic has a loop of its own, so that alerts wait for no map."""

    def __init__(
        self,
        folder: Path,
        bus: Bus,
        library: Library,
        workspace: Workspace,
        nodes: Nodes,
        link: LinkClient,
        live: Channel,
        aboard: Aboard,
        lane: Lane,
        lease: Lease,
        pages: Pages,
        replayed: Replayed,
        sights: Sights | None,
    ) -> None:
        """``folder``: where its settings are kept; ``sights``: where what it sees is drawn, None: nowhere."""
        self._bus, self._workspace, self._nodes, self._aboard = bus, workspace, nodes, aboard
        self.watches: dict[Source, Watch] = {"live": Watch("live", pages, live), "replay": replayed.watch}
        self.tracks: dict[Source, TracksWatch] = {
            "live": TracksWatch("live", pages, self.watches["live"]),
            "replay": replayed.tracks,
        }
        self.traffic = TrafficWatch("live", pages)
        self.traffic_desk = TrafficDesk(folder, bus, self.traffic)
        around = Surroundings(library, aboard, live, self.watches["live"], self.tracks["live"])
        self._manoeuvres = Manoeuvres(around, lane, link)
        self._coming_down = ComingDown(around, link, lane, lease)
        self._flight = SensedFlight()
        self._ground = KnownGround(library, bus)
        self.sensor_nodes = SensorNodes(bus, nodes)
        self._drawing = MapDrawing(sights, self.watches, self._manoeuvres, self.tracks)
        self.looking = Looking(self.watches, sights)
        self.desk = ObstacleDesk(
            folder,
            self.watches,
            self._manoeuvres,
            around,
            link,
            workspace.plans,
            lane,
            lease,
            bus,
        )

    def hear(self, relay: Relay) -> None:
        live = self.watches["live"]
        for topic in MAPS:
            relay.on(topic, live.on_map, each=True)
        for topic in STATUSES:
            relay.on(topic, live.on_status)
        relay.on(Topic.RADAR_LOOK, live.on_radar_look)
        relay.on(Topic.CLOUD_LOOK, live.on_cloud_look)
        relay.on(Topic.ALERT, self._manoeuvres.on_alert, each=True)
        relay.on(Topic.TRACKS, self.tracks["live"].on_status)
        relay.on(Topic.TRAFFIC, self.traffic.on_status)

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        whole = [self._ask_for_whole(sensor) for sensor in SENSORS]
        return [
            self._drawing.run(),
            self._manoeuvres.run(),
            self._coming_down.run(),
            *self.sensor_nodes.loops(),
            *whole,
        ]

    async def start(self) -> None:
        self.watches["live"].awaited |= await self._nodes.running_sensors()
        await self.desk.start()
        await self.traffic_desk.start()
        self.on_plan()

    async def simulated(self, ground: Ground, world: Path) -> None:
        """The demo's vehicle has radar and camera, and climbs over what they see."""
        await self.sensor_nodes.start("radar", "vision")
        await self._nodes.simulated_sensors(ground, world)
        self.desk.avoid_in_demo()

    async def on_state(self, state: VehicleState) -> None:
        for flies in self._flight.on_state(state):
            await self.watches["live"].on_flight(flies=flies)

    def tick(self) -> None:
        self._manoeuvres.tick()
        self.tracks["live"].tick()

    async def on_link(self, status: LinkStatus) -> None:
        self.on_plan()
        if status.adopted is None:
            self.traffic.forget()
        await self.desk.on_link(status)

    def on_plan(self) -> None:
        """Another plan on board or open, or another answer to it."""
        self.desk.brake_as(self._aboard.record)
        self._ground.want(self._aboard.record, self._workspace.document.terrain_id)
        self.watches["live"].seen_in_plan = self._workspace.seen_columns
        self.watches["live"].refresh()

    async def _ask_for_whole(self, sensor: Sensor) -> None:
        """A part was missed, or came before this server was there: the node tells its map once more."""
        needed = self.watches["live"].needs_whole[sensor]
        while True:
            await needed.wait()
            needed.clear()
            try:
                await self._bus.call(sensor, WholeMap(), result=type(None))
            except Exception as error:
                log.warning("Asking the %s for its map: %s", sensor, reported(error, log, "Asking for a map").what)
            await asyncio.sleep(_ASK_EVERY_S)


class SensedFlight:
    """Which flight sensors see in: what was seen counts in it where a map begins anew, and no longer.

    From when a vehicle is in the air until it is disarmed, or another one is heard.

    It is the same vehicle wherever it is heard from, as its numbers say. One that is out of reach flies on. Arming is
    none: home is set by it, maps begin anew around it, and who stands beside the vehicle then goes away.
    """

    def __init__(self) -> None:
        self._vehicle: tuple[int, int] | None = None
        """System and component."""
        self._flies: bool | None = None

    def on_state(self, state: VehicleState) -> list[bool]:
        """What has changed, in order: True where a flight begins, False where none is under way any more."""
        if not state.armed and state.heartbeat_t_mono_s is None:
            return []  # nobody knows yet whether it is disarmed
        vehicle, changes = (state.system_id, state.component_id), list[bool]()
        if self._vehicle not in (None, vehicle) and self._flies:
            changes.append(False)
            self._flies = False
        self._vehicle = vehicle
        flies = state.armed and (bool(self._flies) or is_in_the_air(state))
        if flies is not self._flies:
            changes.append(flies)
            self._flies = flies
        return changes
