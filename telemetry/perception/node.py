"""A perception node on the bus: reads always, works in a thread, looks ahead in another, publishes what comes of it."""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Callable

from planning.errors import DescribedError
from telemetry.bus import Bus
from telemetry.errors import BusError
from telemetry.messages import Published, Topic
from telemetry.node import NodeContext
from telemetry.obstacles import MapDelta, MissionConflict
from telemetry.perception.ahead import Ahead, Flight
from telemetry.perception.ground import ground_around, why_none
from telemetry.perception.inbox import Inbox
from telemetry.perception.kinds import SensorKind
from telemetry.perception.listening import Listening
from telemetry.perception.perceiver import GroundWanted
from telemetry.perception.sending import MapSender
from telemetry.perception.warm_up import warm_up
from telemetry.perception.worker import CONFLICT, GROUND, WHOLE, Worker
from telemetry.requests import PerceptionRequest

_log = logging.getLogger(__name__)

_UNATTENDED_S, _GIVEN_UP_S = 60.0, 600.0
_LOOK_EVERY_S = 0.5


class PerceptionNode:
    """One sensor's. Nothing in it waits for another sensor's node, and nothing that is slow holds up its frames."""

    def __init__(self, bus: Bus, context: NodeContext, kind: SensorKind) -> None:
        self._bus, self._context, self._kind = bus, context, kind
        self._loop = asyncio.get_running_loop()
        self._run = f"{os.getpid()}-{int(time.time())}"
        self._inbox = Inbox(backlog=kind.backlog)
        self._listening = Listening(bus, self._inbox, kind, recording_began=self._tell_whole)
        self._maps = MapSender(lambda delta: bus.publish(kind.maps, delta))
        self._ahead = Ahead(kind.sensor, run=self._run)
        self._unseen: list[MapDelta] = []
        """Changes that the look ahead does not know yet."""
        self._flight: Flight | None = None
        self._look, self._wanted, self._ground = asyncio.Event(), asyncio.Event(), GroundWanted(None, None)
        self._worker = Worker(
            kind,
            self._inbox,
            give=self._from_thread(self._publish),
            tell_map=self._from_thread(self._on_changes),
            ask_ground=self._from_thread(self._on_ground_wanted),
            look_ahead=self._from_thread(self._on_flight),
            run=self._run,
        )

    async def run(self) -> None:
        """Until nobody needs it any more."""
        await asyncio.to_thread(warm_up, self._kind)
        await self._bus.serve(self._kind.sensor, self._handle, PerceptionRequest)
        working = asyncio.ensure_future(asyncio.to_thread(self._worker.run))
        try:
            async with asyncio.TaskGroup() as group:
                parts = [*self._listening.parts(), self._maps.run(), self._keep_looking(), self._keep_ground()]
                tasks = [group.create_task(part) for part in parts]
                while self._is_needed() and not working.done():
                    await asyncio.sleep(_LOOK_EVERY_S)
                for task in tasks:
                    task.cancel()
        finally:
            self._inbox.close()
            await asyncio.wait((working,))
        working.result()

    def _is_needed(self) -> bool:
        """A flight goes on without a server, but not one that nobody has heard of for long."""
        unattended_s = self._context.unattended_s()
        return unattended_s < _UNATTENDED_S or (
            self._listening.armed and time.monotonic() - self._listening.heard_mono_s < _GIVEN_UP_S
        )

    async def _handle(self, _: PerceptionRequest) -> None:
        done = self._loop.create_future()
        self._inbox.put(WHOLE, self._from_thread(lambda: done.done() or done.set_result(None)))
        await done
        await self._maps.sent()

    def _tell_whole(self) -> None:
        """A recording has begun: what was told before it is not in it."""
        self._inbox.put(WHOLE, lambda: None)

    # What the thread gives, in the event loop.

    def _from_thread(self, function: Callable[..., object]) -> Callable[..., None]:
        def call(*arguments: object) -> None:
            self._loop.call_soon_threadsafe(function, *arguments)

        return call

    def _publish(self, topic: str, message: Published) -> None:
        try:
            self._bus.publish(topic, message)
        except BusError:
            _log.info("Nothing is told any more: the bus is closed")

    def _on_changes(self, deltas: list[MapDelta]) -> None:
        if deltas[0].whole:
            self._unseen.clear()
        self._unseen += deltas
        if not self._maps.put(deltas):
            self._tell_whole()

    def _on_flight(self, flight: Flight | None) -> None:
        self._flight = flight
        self._look.set()

    def _on_ground_wanted(self, wanted: GroundWanted) -> None:
        self._ground = wanted
        self._wanted.set()

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

    async def _keep_ground(self) -> None:
        while True:
            await self._wanted.wait()
            self._wanted.clear()
            wanted = self._ground
            if wanted.notice is None or wanted.origin is None:
                continue
            try:
                grid = await asyncio.to_thread(ground_around, wanted.notice, wanted.origin)
            except DescribedError as error:
                _log.warning("%s", error)
                self._inbox.put(GROUND, (wanted, None, f"Known ground is not told apart: {why_none(error)}"))
            else:
                self._inbox.put(GROUND, (wanted, grid, ""))


async def live(bus: Bus, context: NodeContext, kind: SensorKind) -> None:
    """The whole node on an open bus."""
    await PerceptionNode(bus, context, kind).run()
