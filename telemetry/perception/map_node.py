"""A perception node on the bus: reads always, works in a thread, looks ahead in another, publishes what comes of it."""

from __future__ import annotations

import asyncio
import logging
import time

from telemetry.bus.bus import Bus
from telemetry.bus.node import NodeContext
from telemetry.perception.ahead import Ahead, Flight
from telemetry.perception.frame_worker import CONFLICT, WHOLE
from telemetry.perception.map_changes import MapSender
from telemetry.perception.map_worker import MapWorker
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.perception.sensor_node import SensorNode, run_sensor_node
from telemetry.perception.warm_up import warm_up
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import MapDelta, MissionConflict
from telemetry.topics.requests import PerceptionRequest

_log = logging.getLogger(__name__)


class PerceptionNode(SensorNode):
    """One sensor's. Nothing in it waits for another sensor's node, and nothing that is slow holds up its frames."""

    def __init__(self, bus: Bus, context: NodeContext, kind: SensorKind) -> None:
        super().__init__(bus, context, kind)
        self._maps = MapSender(lambda delta: bus.publish(kind.maps, delta))
        self._flight_maps = MapSender(lambda delta: bus.publish(kind.flight_maps or kind.maps, delta))
        self._ahead = Ahead(kind.sensor, run=self._run)
        self._unseen: list[MapDelta] = []
        """Changes that the look ahead does not know yet."""
        self._flight: Flight | None = None
        self._look = asyncio.Event()
        self._worker = MapWorker(
            kind,
            self._inbox,
            give=self._from_thread(self._publish),
            tell_map=self._from_thread(self._on_changes),
            tell_flight_map=self._from_thread(self._on_flight_changes),
            ask_ground=self._from_thread(self._on_ground_wanted),
            look_ahead=self._from_thread(self._on_flight),
            run=self._run,
        )

    async def run(self) -> None:
        await asyncio.to_thread(warm_up, self._kind)
        await self._bus.serve(self._kind.sensor, self._handle, PerceptionRequest)
        await self._work(self._worker.run, [self._maps.run(), self._flight_maps.run(), self._keep_looking()])

    async def _handle(self, _: PerceptionRequest) -> None:
        done = self._loop.create_future()
        self._inbox.put(WHOLE, self._from_thread(lambda: done.done() or done.set_result(None)))
        await done
        await self._maps.sent()
        await self._flight_maps.sent()

    def _on_recording(self) -> None:
        self._inbox.put(WHOLE, lambda: None)

    # What the thread gives, in the event loop.

    def _on_changes(self, deltas: list[MapDelta]) -> None:
        if deltas[0].whole:
            self._unseen.clear()
        self._unseen += deltas
        if not self._maps.put(deltas):
            self._on_recording()

    def _on_flight_changes(self, deltas: list[MapDelta]) -> None:
        if not self._flight_maps.put(deltas):
            self._on_recording()

    def _on_flight(self, flight: Flight | None) -> None:
        self._flight = flight
        self._look.set()

    # What takes long, in threads of its own.

    async def _keep_looking(self) -> None:
        while True:
            await self._look.wait()
            self._look.clear()
            deltas, self._unseen = self._unseen, []
            t_mono_s, t_utc_s = time.monotonic(), time.time()
            try:
                conflict: MissionConflict | None = await asyncio.to_thread(self._ahead.look, deltas, self._flight)
            except Exception:
                # Frames, regions and their alerts go on without the look ahead.
                _log.exception("The mission ahead of the %s could not be looked at", self._kind.sensor)
                continue
            self._inbox.put(CONFLICT, conflict)
            for alert in self._ahead.alerts(conflict, t_mono_s, t_utc_s, time.monotonic()):
                self._publish(Topic.ALERT, alert)


def run_perception(kind: SensorKind, description: str) -> int:
    """Runs one sensor's node until it ends; returns the exit code."""
    return run_sensor_node(kind.sensor, description, lambda bus, context: PerceptionNode(bus, context, kind))
