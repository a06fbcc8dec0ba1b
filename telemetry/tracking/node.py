"""The tracks node on the bus: reads always, follows in a thread, publishes what comes of it."""

from __future__ import annotations

import asyncio

from mapping.tracker import Tracker
from telemetry.bus import Bus
from telemetry.node import NodeContext
from telemetry.perception.shell import NodeShell
from telemetry.tracking.kind import tracks_kind
from telemetry.tracking.warm_up import warm_up
from telemetry.tracking.worker import TracksWorker


class TracksNode(NodeShell):
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
        """Until nobody needs it any more."""
        await asyncio.to_thread(warm_up)
        await self._work(self._worker.run)


async def live(bus: Bus, context: NodeContext) -> None:
    """The whole node on an open bus."""
    await TracksNode(bus, context).run()
