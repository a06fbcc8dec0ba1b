"""Obstacles as a whole: what hangs on the bus for them, and what the rest of flying tells them."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

from server.errors import reported
from server.heard.channel import Asks, Channel
from server.heard.ground_task import Ground
from server.heard.node_states import Nodes
from server.heard.relay import Relay
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.obstacles.coming_down import ComingDown
from server.obstacles.coming_down_task import plan_rest
from server.obstacles.drawing import MapDrawing
from server.obstacles.known_ground import KnownGround
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.manoeuvre_task import prepare
from server.obstacles.manoeuvres import Manoeuvres
from server.obstacles.moving_objects import TracksWatch
from server.obstacles.obstacle_desk import ObstacleDesk
from server.obstacles.obstacle_watch import Watch, is_in_air
from server.obstacles.rest_of_plan import Underway
from server.obstacles.section import Looking
from server.obstacles.sensor_nodes import SensorNodes
from server.schemas import ServerMessage, Source
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus import Bus
from telemetry.topics.messages import LinkStatus, PlanRecord, Topic
from telemetry.topics.obstacles import SENSORS, AvoidanceStatus, ObstacleAlert, Sensor
from telemetry.topics.requests import Operator, WholeMap

log = logging.getLogger("hedgehop.obstacles")

_MAPS = (Topic.MAP_RADAR, Topic.MAP_VISION, Topic.MAP_VISION_FLIGHT, Topic.MAP_RANGES)
_STATUSES = (Topic.PERCEPTION_RADAR, Topic.PERCEPTION_VISION, Topic.PERCEPTION_RANGES)
_ASK_EVERY_S = 2.0


class Obstacles:
    """All methods belong to the event loop; each topic has a loop of its own, so that alerts wait for no map."""

    def __init__(
        self,
        bus: Bus,
        library: Library,
        workspace: Workspace,
        nodes: Nodes,
        link: Asks,
        live: Channel,
        *,
        lane: Lane,
        server_operator: Callable[[], Operator],
        onboard: Callable[[], PlanRecord | None],
        tell: Callable[[ServerMessage], None],
    ) -> None:
        self._bus, self._library, self._workspace, self._nodes = bus, library, workspace, nodes
        self._live, self._onboard, self._lane = live, onboard, lane
        self.watches: dict[Source, Watch] = {
            "live": Watch("live", tell, in_air=lambda: is_in_air(live.state)),
            "replay": Watch("replay", tell),
        }
        self.sees_differently: Callable[[], None] = lambda: None
        """Called whenever what avoidance says of itself has changed."""
        watch = self.watches["live"]
        self.tracks: dict[Source, TracksWatch] = {
            source: TracksWatch(source, tell, each.on_alert) for source, each in self.watches.items()
        }
        self._manoeuvres = Manoeuvres(
            watch, situation=self._situation, prepare=self._prepare, vehicle=lambda: live.state
        )
        self._coming_down = ComingDown(
            watch,
            link,
            situation=lambda: self._situation(None, None),
            plan=lambda situation: lane.call(plan_rest, situation),
            operator=server_operator,
        )
        self._ground = KnownGround(library, lambda notice: bus.publish(Topic.GROUND, notice))
        self.sensor_nodes = SensorNodes(bus, nodes)
        self._drawing = MapDrawing(workspace.sights, self.watches, self._manoeuvres, self.tracks)
        self.desk = ObstacleDesk(
            library.root,
            self.watches,
            self._manoeuvres,
            link,
            workspace.plans,
            lane=lane,
            underway=self._flown,
            publish_settings=lambda settings: bus.publish(Topic.PERCEPTION_SETTINGS, settings),
            server_operator=server_operator,
            looking=Looking(self.watches, workspace.sights),
        )

    def hear(self, relay: Relay) -> None:
        live, replay = self.watches["live"], self.watches["replay"]
        for topic in _MAPS:
            relay.on(topic, live.on_map, each=True)
            relay.on(topic, replay.on_map, replayed=True, each=True)
        for topic in _STATUSES:
            relay.on(topic, live.on_status)
            relay.on(topic, replay.on_status, replayed=True)
        for watch, replayed in ((live, False), (replay, True)):
            relay.on(Topic.RADAR_LOOK, watch.on_radar_look, replayed=replayed)
            relay.on(Topic.CLOUD_LOOK, watch.on_cloud_look, replayed=replayed)
            relay.on(Topic.ALERT, watch.on_alert, replayed=replayed, each=True)
            relay.on(Topic.AVOIDANCE, watch.on_avoidance if replayed else self._on_avoidance, replayed=replayed)
        for source, tracks in self.tracks.items():
            relay.on(Topic.TRACKS, tracks.on_status, replayed=source == "replay")

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
        await self.desk.start()
        self.on_plan()

    async def simulated(self, ground: Ground, world: Path) -> None:
        """The demo's vehicle has radar and camera, and climbs over what they see."""
        await self.sensor_nodes.start("radar", "vision")
        await self._nodes.simulated_sensors(ground, world)
        self.desk.avoid_in_demo()

    def tick(self) -> None:
        self.watches["live"].tick()
        self.tracks["live"].tick()

    def forget_replay(self) -> None:
        """Another recording, or none."""
        self.watches["replay"].forget()
        self.tracks["replay"].forget()

    async def on_link(self, status: LinkStatus) -> None:
        self.on_plan()
        await self.desk.on_link(status)

    def on_plan(self) -> None:
        """Another plan on board or open, or another answer to it."""
        self.desk.brake_as(self._onboard())
        self._ground.want(self._onboard(), self._workspace.document.terrain_id)
        self.watches["live"].seen_in_plan = self._workspace.seen_columns
        self.watches["live"].refresh()

    def _on_avoidance(self, status: AvoidanceStatus) -> None:
        self.watches["live"].on_avoidance(status)
        self.sees_differently()

    def _flown(self) -> Underway | None:
        record, state = self._onboard(), self._live.state
        return None if record is None or state is None else Underway(record, self._live.flight, state)

    def _situation(self, standing: ObstacleAlert | None, moving: ObstacleAlert | None) -> Situation | None:
        """None without a vehicle, its plan, or the surface model of that."""
        record, state = self._onboard(), self._live.state
        if record is None or state is None:
            return None
        terrain = terrain_of(FlownOver(record.terrain_id, record.terrain_sha256), self._library.terrains())
        if terrain is None:
            return None
        watch = self.watches["live"]
        tracks = self.tracks["live"].fresh()
        statuses = [*watch.statuses.values(), *([] if tracks is None else [tracks])]
        origin = next((status.origin for status in statuses if status.origin is not None), None)
        if origin is None:
            return None
        mirrors = [watch.mirrors[sensor] for sensor in SENSORS]
        maps = tuple(mirror.voxels() for mirror in mirrors if mirror.origin is not None)
        directory = self._library.terrain_dir(terrain.id)
        return Situation(
            standing,
            state,
            self._live.flight,
            watch.avoidance.height_offset_m,
            record,
            directory,
            origin,
            maps,
            watch.settings.vehicle_radius_m,
            ceiling_m=watch.settings.climb_ceiling_m,
            radar_high_deg=watch.settings.radar_high_deg,
            approach=moving,
            tracks=tracks,
            safety_radius_m=watch.settings.safety_radius_m,
        )

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

    async def _prepare(self, situation: Situation) -> Any:
        return await self._lane.call(prepare, situation)
