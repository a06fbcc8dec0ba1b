"""The tracks node: ``python -m telemetry.nodes.tracks --runtime DIR``. Follows what moves, and says what comes near.

It reads the bus always, follows in a thread, and publishes what comes of it.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Callable

import numpy as np

from mapping.sensor_frames import RadarFrame
from mapping.tracking.tracker import Tracker
from telemetry.bus.bus import Bus
from telemetry.bus.node import NodeContext
from telemetry.perception.frame_worker import PLAN, SETTINGS, FrameWorker, Give
from telemetry.perception.inbox import Inbox
from telemetry.perception.perceiver import GroundWanted
from telemetry.perception.sensor_node import SensorNode, run_sensor_node
from telemetry.perception.status import Outcome
from telemetry.perception.warm_up import fly_past
from telemetry.topics.messages import Topic
from telemetry.topics.tracks import TracksStatus
from telemetry.tracking.object_tracking import ObjectTracking, tracks_kind


class TracksNode(SensorNode):
    """A process of its own: neither the radar's map nor anything else waits for it, or it for them."""

    def __init__(self, bus: Bus, context: NodeContext) -> None:
        super().__init__(bus, context, tracks_kind(Tracker()))
        self._worker = TracksWorker(
            self._inbox,
            give=self._from_thread(self._publish),
            ask_ground=self._from_thread(self._on_ground_wanted),
            run=self._run,
        )

    async def run(self) -> None:
        await asyncio.to_thread(warm_up)
        await self._work(self._worker.run)


class TracksWorker(FrameWorker):
    """Of what moves: tracks and approach alerts."""

    def __init__(
        self,
        inbox: Inbox,
        *,
        give: Give,
        ask_ground: Callable[[GroundWanted], None],
        run: str,
        clock: Callable[[], float] = time.monotonic,
        utc: Callable[[], float] = time.time,
    ) -> None:
        self._tracking = ObjectTracking(run=run, utc_minus_mono_s=utc() - clock())
        perceiver = self._tracking.perceiver
        super().__init__(perceiver, inbox, status=Topic.TRACKS, give=give, ask_ground=ask_ground, clock=clock)
        self._handlers = {**self._handlers, SETTINGS: self._tracking.on_settings, PLAN: self._tracking.on_plan}

    def _work(self, frame: RadarFrame) -> Outcome[TracksStatus]:
        return self._tracking.work(frame, self._clock)

    def _tick(self) -> Outcome[TracksStatus]:
        return self._tracking.tick(self._clock)


def warm_up() -> None:
    """An object flies past a vehicle that hovers, over made-up ground: seen, followed, dangerous."""
    tracking = ObjectTracking(run="warm-up", utc_minus_mono_s=0.0)
    fly_past(tracking.perceiver, tracking.work, _frame, frames=8)
    tracking.tick(lambda: 101.0)


def _frame(t_s: float, number: int) -> RadarFrame:
    xyz, speed = [[0.0, 20.0 - 0.4 * number, 0.5], [5.0, 12.0, 0.5]], [-4.0, 0.0]
    return RadarFrame.of(xyz, speed, np.full(2, 45.0), t_mono_s=t_s, t_utc_s=t_s, number=number, source="warm-up")


if __name__ == "__main__":
    sys.exit(run_sensor_node("tracks", "Follows what moves before a radar.", TracksNode))
