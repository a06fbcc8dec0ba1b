"""A long flight on a virtual clock: what the link, the flown path and the alerts keep of it must not grow."""

from __future__ import annotations

import asyncio
import gc
import time
from pathlib import Path
from typing import Literal

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from server.heard.flown_track import Track
from server.obstacles.alert_list import LatchedAlerts
from telemetry.topics.messages import FlightStatus, Published
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.frames import attitude, heartbeat, packed
from tests.telemetry.replayed_link import ReplayedLink
from tests.trust.rows import Row, judged

MOST_MB, EVERY_S, ALERT_EVERY = 5.0, 0.25, 40
MOST_OBJECTS = 5000
"""Of a leak of one object each second there were 86,400 after a day."""
WARM_UP = 0.2
"""Of the flight: what is kept of a bounded time is full by then."""
BEGUN_UTC_S = 1.8e9
PHASES: tuple[Literal["begins", "ends"], ...] = ("begins", "ends")


class LongFlight(ReplayedLink):
    """The link's own code, and what a server keeps of what it publishes."""

    def __init__(self) -> None:
        super().__init__()
        self.track, self.alerts, self.heard = Track(), LatchedAlerts(), 0

    def publish(self, topic: str, message: Published) -> None:
        if isinstance(message, VehicleState):
            self.heard += 1
            self.track.add(message, None)
        elif isinstance(message, FlightStatus):
            self.told = [(self.now_s, message)]

    async def fly(self, hours: float) -> tuple[int, float]:
        """How many objects, and megabytes of memory, there are more than after the warm-up."""
        self.now_s = self.start_utc_s = BEGUN_UTC_S
        steps, rows = round(hours * 3600 / EVERY_S), []
        async with self._linked():
            for step in range(steps):
                await self._until(BEGUN_UTC_S + step * EVERY_S)
                for frame in _frames(step):
                    self._hear(frame)
                await self._turn()
                self.line.sent.clear()
                self._alert(step)
                if step in (round(WARM_UP * steps), steps - 1):
                    rows.append(_held())
        (objects, memory_mb), (objects_after, memory_after_mb) = rows
        return objects_after - objects, memory_after_mb - memory_mb

    def _alert(self, step: int) -> None:
        if step % ALERT_EVERY == 0:
            number = step // ALERT_EVERY
            for phase in PHASES:
                words = f"Radar, obstacle {number}"
                alert = ObstacleAlert(
                    str(number), "radar", "obstacle", phase, self.now_s, self.now_s, self.now_s, words
                )
                self.alerts.on_alert(alert, self.now_s)


def _frames(step: int) -> list[bytes]:
    """Four times a second, as a vehicle that flies round and round for a day."""
    t_boot_ms = round(1000 * step * EVERY_S)
    turn = step % 2400
    place = mavlink.MAVLink_global_position_int_message(
        t_boot_ms, -371244507 + 10 * turn, 1756892878, 820_000, 20_000, 100, 0, 0, 9000
    )
    messages = [attitude(t_boot_ms), place]
    if step % 4 == 0:
        messages.append(heartbeat())
    if step % 40 == 0:
        messages.append(mavlink.MAVLink_statustext_message(6, f"Round {step // 40}".encode()))
    return [packed(message, sequence=(3 * step + k) % 256) for k, message in enumerate(messages)]


def _held() -> tuple[int, float]:
    gc.collect()
    resident = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmRSS"))
    return len(gc.get_objects()), int(resident.split()[1]) / 1e3


def growth_row(hours: float) -> Row:
    flight, started_s = LongFlight(), time.perf_counter()
    objects, memory_mb = asyncio.run(flight.fly(hours))
    took_s = time.perf_counter() - started_s
    figure = (
        f"{hours:g} h of flight in {took_s:.0f} s: {memory_mb:+.2f} MB and {objects:+d} objects"
        f" after the first {WARM_UP:.0%} of it; {flight.heard} states published"
    )
    held = flight.heard > hours * 3600 and memory_mb < MOST_MB and objects < MOST_OBJECTS
    promise = "A long flight: link, flown path and alerts hold no more at its end than after its first part"
    return Row("R15", promise, judged(held), figure, f'make trust TRUST_ARGS="--hours {hours:g}"')
