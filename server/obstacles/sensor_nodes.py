"""Which of the sensors' nodes run: each from the first frame of its sensor on, or at once in the demo."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any

from server.heard.node_states import Nodes
from telemetry.bus import Bus
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import SENSORS, Sensor

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
