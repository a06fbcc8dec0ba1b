"""Keeps the live vehicle held against the right plan: the one on board, else only the surface model on show."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from planning.terrain.dsm import Dsm
from server.errors import reported
from server.heard.channel import Channel
from server.heard.plan_follower import Followed, Follower
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from telemetry.topics.messages import PlanRecord

log = logging.getLogger("hedgehop.flying")


class PlanFollowed:
    """``want`` what is on board; ``run`` makes it ready beside the event loop. The last wish counts."""

    def __init__(self, library: Library, channel: Channel, *, open_dsm: Callable[[], Dsm | None]) -> None:
        self._library, self._channel, self._open_dsm = library, channel, open_dsm
        self._wanted: PlanRecord | None = None
        self._wake = asyncio.Event()
        self._made: tuple[str, Dsm | None] | None = None

    def want(self, record: PlanRecord | None) -> None:
        """None: nothing is known of what is on board."""
        if not _same(self._key(record), self._made):
            self._wanted = record
            self._wake.set()

    async def run(self) -> None:
        """Until cancelled; a plan that cannot be followed is flown all the same."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            record, key = self._wanted, self._key(self._wanted)
            try:
                follower = await asyncio.to_thread(self._follower, record)
            except Exception as error:
                log.warning("The plan on board cannot be followed: %s", reported(error, log, "Following").what)
                follower = Follower(over=self._open_dsm())
            self._channel.follower, self._made = follower, key

    def _key(self, record: PlanRecord | None) -> tuple[str, Dsm | None]:
        """Without a plan the model on show is enough; which one it is, is told by identity."""
        return ("", self._open_dsm()) if record is None else (f"{record.digest} {record.home_alt_dsm_m}", None)

    def _follower(self, record: PlanRecord | None) -> Follower:
        if record is None:
            return Follower(over=self._open_dsm())
        terrain = terrain_of(FlownOver(record.terrain_id, record.terrain_sha256), self._library.terrains())
        if terrain is None:
            return Follower(over=self._open_dsm())
        return Follower(Followed.of(record, self._library.load_terrain(terrain.id)))


def _same(key: tuple[str, Dsm | None], made: tuple[str, Dsm | None] | None) -> bool:
    return made is not None and key[0] == made[0] and key[1] is made[1]
