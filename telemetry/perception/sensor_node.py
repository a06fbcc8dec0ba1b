"""What nodes that work on a sensor's frames have in common: the bus is always read, the work is done in a thread."""

from __future__ import annotations

import argparse
import asyncio
import logging
import os
import time
from collections.abc import Callable, Coroutine, Sequence
from pathlib import Path
from typing import Any

from planning.errors import DescribedError
from telemetry.bus.bus import Bus
from telemetry.bus.node import LOOK_EVERY_S, NodeContext, run_node
from telemetry.errors import BusError
from telemetry.perception.frame_worker import AVOIDANCE, CAMERA, FLIGHT, GROUND, NOTICE, PLAN, SETTINGS, STATE
from telemetry.perception.inbox import Inbox
from telemetry.perception.known_ground import ground_around, why_none
from telemetry.perception.perceiver import GroundWanted
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.topics.messages import Published, RecorderStatus, Topic
from telemetry.topics.vehicle import VehicleState

_MOST_UNREAD = 2000
_LATEST = {
    Topic.PERCEPTION_SETTINGS: SETTINGS,
    Topic.PLAN: PLAN,
    Topic.FLIGHT: FLIGHT,
    Topic.AVOIDANCE: AVOIDANCE,
    Topic.GROUND: NOTICE,
}
_log = logging.getLogger(__name__)


class Listening:
    """What a node hears on the bus, and hands to its thread."""

    def __init__(self, bus: Bus, inbox: Inbox, kind: SensorKind, *, recording_began: Callable[[], None]) -> None:
        self._bus, self._inbox, self._kind = bus, inbox, kind
        self._recording_began = recording_began
        self._recording: str | None = None
        self.flying_mono_s: float | None = None
        """When the vehicle was last heard of; None: it was not armed then."""

    def parts(self) -> list[Coroutine[Any, Any, None]]:
        """To be run side by side until cancelled."""
        parts: list[Coroutine[Any, Any, None]] = [self._frames(), self._states(), self._recorder()]
        parts += [self._messages(topic, kind, each=False) for topic, kind in _LATEST.items()]
        if self._kind.uses_camera:
            parts.append(self._messages(Topic.SLAM_POSE, CAMERA, each=True))
        return parts

    async def _frames(self) -> None:
        # Of large clouds the bus keeps the newest only: no others must be fetched.
        each = self._kind.backlog > 1
        async for _, frame in self._bus.subscribe(self._kind.frames, keep_all=each, limit=_MOST_UNREAD):
            self._inbox.put_frame(frame)

    async def _states(self) -> None:
        async for _, state in self._bus.subscribe(Topic.VEHICLE, keep_all=True, limit=_MOST_UNREAD):
            if isinstance(state, VehicleState):
                self.flying_mono_s = time.monotonic() if state.armed else None
            self._inbox.put(STATE, state)

    async def _messages(self, topic: Topic, kind: str, *, each: bool) -> None:
        async for _, message in self._bus.subscribe(topic, keep_all=each, limit=_MOST_UNREAD):
            self._inbox.put(kind, message)

    async def _recorder(self) -> None:
        async for _, status in self._bus.subscribe(Topic.RECORDER):
            if isinstance(status, RecorderStatus):
                began = status.recording and status.name != self._recording
                self._recording = status.name if status.recording else None
                if began:
                    self._recording_began()


class SensorNode:
    """Inbox, listening, known ground, and the life of the node; what is worked on is the subclass's."""

    def __init__(self, bus: Bus, context: NodeContext, kind: SensorKind) -> None:
        self._bus, self._context, self._kind = bus, context, kind
        self._loop = asyncio.get_running_loop()
        self._run = f"{os.getpid()}-{int(time.time())}"
        self._inbox = Inbox(backlog=kind.backlog)
        self._listening = Listening(bus, self._inbox, kind, recording_began=self._on_recording)
        self._wanted, self._ground = asyncio.Event(), GroundWanted(None, None)

    async def run(self) -> None:
        """Until nobody needs it any more."""
        raise NotImplementedError

    async def _work(self, run: Callable[[], None], parts: Sequence[Coroutine[Any, Any, None]] = ()) -> None:
        """``run`` in a thread, and ``parts`` beside it, until nobody needs the node any more."""
        working = asyncio.ensure_future(asyncio.to_thread(run))
        try:
            async with asyncio.TaskGroup() as group:
                tasks = [group.create_task(p) for p in [*self._listening.parts(), *parts, self._keep_ground()]]
                while self._context.is_needed(self._listening.flying_mono_s) and not working.done():
                    await asyncio.sleep(LOOK_EVERY_S)
                for task in tasks:
                    task.cancel()
        finally:
            self._inbox.close()
            await asyncio.wait((working,))
        working.result()

    def _on_recording(self) -> None:
        """A recording has begun: what was told before it is not in it."""

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

    def _on_ground_wanted(self, wanted: GroundWanted) -> None:
        self._ground = wanted
        self._wanted.set()

    # What takes long, in threads of its own.

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


def run_sensor_node(name: str, description: str, make: Callable[[Bus, NodeContext], SensorNode]) -> int:
    """The program of every such node, until it ends; returns the exit code."""
    parser = argparse.ArgumentParser(prog=name, description=description)
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")

    async def live(bus: Bus, context: NodeContext) -> None:
        await make(bus, context).run()

    return run_node(name, parser.parse_args().runtime, live)
