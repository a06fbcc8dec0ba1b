"""Perception nodes as the processes that they are, and a made-up flight on the bus."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, TypeVar

from telemetry.bus.bus import Bus
from telemetry.topics.messages import ServerAlive, Topic
from telemetry.topics.obstacles import MapDelta, ObstacleAlert, PerceptionStatus
from tests.telemetry import perception_flights as flights

PATIENCE_S = 90.0
FROM_S, FLOWN_S = 5.0, 12.0
"""Of the way to the wall: a flight takes off in the middle of it, and begins anew when the wall is reached."""


class Processes:
    """Starts nodes and ends what is left of them."""

    def __init__(self, folder: Path) -> None:
        self.runtime, self.recordings = folder / "run", folder / "recordings"
        self.nodes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, *arguments: str) -> None:
        command = [sys.executable, "-m", f"telemetry.nodes.{name}", "--runtime", str(self.runtime), *arguments]
        self.nodes[name] = subprocess.Popen(command, start_new_session=True)

    def send(self, name: str, number: signal.Signals) -> None:
        self.nodes[name].send_signal(number)

    def end(self) -> None:
        for node in self.nodes.values():
            node.send_signal(signal.SIGCONT)
            node.kill()
            node.wait(timeout=PATIENCE_S)


class Flight(ABC):
    """Something that flies on the bus in real time, and keeps what comes back."""

    def __init__(self, bus: Bus) -> None:
        self.bus = bus

    @abstractmethod
    async def live(self) -> None:
        """Until cancelled."""

    async def until(self, condition: Callable[[], Any]) -> Any:
        async with asyncio.timeout(PATIENCE_S):
            while not (found := condition()):
                await asyncio.sleep(0.02)
            return found

    async def hear(self, topic: str, into: list[Any]) -> None:
        async for _, message in self.bus.subscribe(topic, keep_all=True):
            into.append(message)


F = TypeVar("F", bound=Flight)


def flown(processes: Processes, take_off: Callable[[Bus], F], act: Callable[[F], Awaitable[object]]) -> None:
    """Runs ``act`` while a flight goes on."""

    async def whole() -> None:
        async with await Bus.open(processes.runtime, "link") as bus:
            flight = take_off(bus)
            flying, acting = asyncio.ensure_future(flight.live()), asyncio.ensure_future(act(flight))
            try:
                await asyncio.wait((flying, acting), return_when=asyncio.FIRST_COMPLETED)
                if flying.done():
                    flying.result()
                acting.result()
            finally:
                for task in (flying, acting):
                    task.cancel()
                await asyncio.gather(flying, acting, return_exceptions=True)

    asyncio.run(whole())


class Sky(Flight):
    """Flies towards a wall, again and again."""

    def __init__(self, bus: Bus, *, sensors: tuple[str, ...] = ("radar", "vision")) -> None:
        super().__init__(bus)
        self.sensors = sensors
        self.deltas: dict[str, list[MapDelta]] = {"radar": [], "vision": [], "ranges": []}
        self.statuses: dict[str, list[PerceptionStatus]] = {"radar": [], "vision": [], "ranges": []}
        self.alerts: list[ObstacleAlert] = []
        self.armed = True
        self.frames = True
        self.again = True
        """Fly anew when the wall is reached: each flight begins its map afresh."""
        self.t_s = 0.0
        self._number = 0
        self.begin_anew(on_ground_s=0.0)

    async def live(self) -> None:
        """Until cancelled."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._fly())
            for sensor in self.sensors:
                group.create_task(self.hear(f"map/{sensor}", self.deltas[sensor]))
                group.create_task(self.hear(f"perception/{sensor}", self.statuses[sensor]))
            group.create_task(self.hear(Topic.ALERT, self.alerts))

    def begin_anew(self, *, on_ground_s: float = 1.0) -> None:
        """Back to where it takes off, on the ground for a moment."""
        ahead_s = on_ground_s - FROM_S
        self._begin_mono_s, self._begin_utc_s = time.monotonic() + ahead_s, time.time() + ahead_s

    def reaches_mono_s(self, north_m: float) -> float:
        """When the vehicle comes to so far north on the present flight."""
        return self._begin_mono_s + north_m / flights.SPEED_M_S

    async def _fly(self) -> None:
        """States at 20 Hz, radar frames and ranges at 10 Hz, clouds at 5 Hz, camera poses at 20 Hz."""
        tick = 0
        while True:
            self.t_s = time.monotonic() - self._begin_mono_s
            if self.t_s > FLOWN_S and self.again:
                self.begin_anew()
                continue
            self._tell(tick)
            tick += 1
            await asyncio.sleep(0.05)

    def _tell(self, tick: int) -> None:
        t_s, t0_mono_s, t0_utc_s = self.t_s, self._begin_mono_s, self._begin_utc_s
        if tick % 10 == 0:
            self.bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), 1))
        armed = self.armed and t_s >= FROM_S
        self.bus.publish(Topic.VEHICLE, flights.state_at(t_s, t0_mono_s, t0_utc_s, armed=armed))
        if not self.frames or t_s < FROM_S:
            return
        self._number += 1
        if "vision" in self.sensors:
            self.bus.publish(Topic.SLAM_POSE, flights.slam_pose(t_s, t0_mono_s))
            if tick % 4 == 0:
                self.bus.publish(Topic.CLOUD_FRAME, flights.cloud_frame(t_s, self._number // 4, t0_mono_s, t0_utc_s))
        if tick % 2 == 0:
            if "radar" in self.sensors:
                self.bus.publish(Topic.RADAR_FRAME, flights.radar_frame(t_s, self._number // 2, t0_mono_s, t0_utc_s))
            if "ranges" in self.sensors:
                self.bus.publish(Topic.RANGE_FRAME, flights.range_frame(t_s, self._number // 2, t0_mono_s, t0_utc_s))


def fly(
    processes: Processes, act: Callable[[Sky], Awaitable[object]], *, sensors: tuple[str, ...] = ("radar", "vision")
) -> None:
    """Runs ``act`` while flights towards the wall go on."""
    flown(processes, lambda bus: Sky(bus, sensors=sensors), act)
