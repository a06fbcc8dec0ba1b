"""After a climb: the rest is planned again in a worker, and flown at its proper height once it is certified."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

from server.errors import reported
from server.heard.channel import Asks
from server.obstacles.coming_down_task import RestPlanned
from server.obstacles.manoeuvre_situation import Situation
from server.obstacles.obstacle_watch import Watch
from telemetry.topics.requests import FlyRest, Operator

log = logging.getLogger("hedgehop.obstacles")

LOOK_S, AGAIN_S = 0.5, 5.0
"""What cannot be certified from here may be from farther on."""


class ComingDown:
    def __init__(
        self,
        watch: Watch,
        link: Asks,
        *,
        situation: Callable[[], Situation | None],
        plan: Callable[[Situation], Awaitable[RestPlanned]],
        operator: Callable[[], Operator],
    ) -> None:
        self._watch, self._link, self._situation, self._plan = watch, link, situation, plan
        self._operator = operator

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
            situation = await asyncio.to_thread(self._situation)
            planned = RestPlanned(why="Its plan is not known.") if situation is None else await self._plan(situation)
            if planned.targets and self._is_higher:
                await self._link.call(FlyRest(self._operator(), planned.targets))
            self._say(planned.why)
        except Exception as error:
            self._say(reported(error, log, "Planning the rest of the flight").what)

    def _say(self, why: str) -> None:
        self._watch.stays_higher = why
        self._watch.refresh()
