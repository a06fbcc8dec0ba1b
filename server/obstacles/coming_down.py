"""After a climb: the rest is planned again in a worker, and flown at its proper height once it is certified."""

from __future__ import annotations

import asyncio
import logging

from server.door.lease import Lease
from server.errors import reported
from server.obstacles.coming_down_task import RestPlanned, plan_rest
from server.obstacles.surroundings import Surroundings
from server.work.jobs import Lane
from telemetry.bus.link_client import LinkClient
from telemetry.topics.requests import FlyRest

log = logging.getLogger("hedgehop.obstacles")

LOOK_S, AGAIN_S = 0.5, 5.0
"""What cannot be certified from here may be from farther on."""


class ComingDown:
    def __init__(self, around: Surroundings, link: LinkClient, lane: Lane, lease: Lease) -> None:
        self._around, self._watch, self._link, self._lane, self._lease = around, around.watch, link, lane, lease

    @property
    def _is_higher(self) -> bool:
        status = self._watch.avoidance
        return self._watch.settings.comes_down and status.state == "offset" and status.height_offset_m > 0.0

    async def run(self) -> None:
        """Until cancelled. Whatever goes wrong it stays higher, which is clear, and says why."""
        while True:
            await asyncio.sleep(LOOK_S)
            if not self._is_higher:
                self._say("")
                continue
            await self.come_down()
            await asyncio.sleep(AGAIN_S if self._is_higher else 0.0)

    async def come_down(self) -> None:
        try:
            situation = await self._around.situation()
            planned = RestPlanned(why="Its plan is not known.")
            if situation is not None:
                planned = await self._lane.call(plan_rest, situation)
            if planned.targets and self._is_higher:
                await self._link.call(FlyRest(self._lease.server_operator(), planned.targets))
            self._say(planned.why)
        except Exception as error:
            self._say(reported(error, log, "Planning the rest of the flight").what)

    def _say(self, why: str) -> None:
        self._watch.stays_higher = why
        self._watch.refresh()
