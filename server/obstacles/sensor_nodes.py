"""The sensors' nodes: each runs from its first frame on, or at once in the demo, and is told which ground is known."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any

from server.errors import NotFoundError
from server.heard.node_states import Nodes
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.library.terrains import ground_notice
from telemetry.bus.bus import Bus
from telemetry.topics.messages import PlanRecord, Topic
from telemetry.topics.obstacles import SENSORS, GroundNotice, Sensor

FRAMES: dict[Sensor, Topic] = {
    "radar": Topic.RADAR_FRAME,
    "vision": Topic.CLOUD_FRAME,
    "ranges": Topic.RANGE_FRAME,
}


class SensorNodes:
    """A process for each sensor, which share nothing: what kills one leaves the others."""

    def __init__(self, bus: Bus, nodes: Nodes) -> None:
        self._bus, self._nodes = bus, nodes

    def loops(self) -> list[Coroutine[Any, Any, None]]:
        return [self._await_frame(sensor) for sensor in SENSORS]

    async def start(self, *sensors: Sensor) -> None:
        for sensor in sensors:
            await self._start(sensor)

    async def _await_frame(self, sensor: Sensor) -> None:
        """Heard once: later frames are none of the server's business."""
        subscription = self._bus.subscribe(str(FRAMES[sensor]))
        try:
            async for _ in subscription:
                break
        finally:
            subscription.close()
        await self._start(sensor)

    async def _start(self, sensor: Sensor) -> None:
        """Moving objects are told from the radar's frames by a process of its own, beside the map's."""
        await self._nodes.sensor(sensor)
        if sensor == "radar":
            await self._nodes.tracks()


class KnownGround:
    """The surface model of the plan on board, else the open one.

    Published when it changes; a node that starts later gets the last word from the bus.
    """

    def __init__(self, library: Library, bus: Bus) -> None:
        self._library, self._bus = library, bus
        self._said: GroundNotice | None = None

    def want(self, record: PlanRecord | None, open_terrain_id: str | None) -> None:
        """Without either the last one stays: a vehicle may be in the air over it."""
        notice = self._notice(record, open_terrain_id)
        if notice is not None and notice != self._said:
            self._said = notice
            self._bus.publish(Topic.GROUND, notice)

    def _notice(self, record: PlanRecord | None, open_terrain_id: str | None) -> GroundNotice | None:
        if record is not None:
            found = terrain_of(FlownOver(record.terrain_id, record.terrain_sha256), self._library.terrains())
            open_terrain_id = open_terrain_id if found is None else found.id
        if open_terrain_id is None:
            return None
        try:
            return ground_notice(self._library.terrain_dir(open_terrain_id))
        except NotFoundError:
            return None
