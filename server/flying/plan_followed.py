"""Keeps the live vehicle held against the right plan: the one on board, else only the surface model on show."""

from __future__ import annotations

import asyncio
import logging

from planning.terrain.dsm import Dsm
from server.errors import reported
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.heard.plan_follower import Followed, Follower
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.workspace import Workspace
from telemetry.topics.messages import PlanRecord

log = logging.getLogger("hedgehop.flying")


class PlanFollowed:
    """``look`` after every change; ``run`` makes what is on board ready beside the event loop. The last one counts."""

    def __init__(self, library: Library, channel: Channel, aboard: Aboard, workspace: Workspace) -> None:
        self._library, self._channel, self._aboard, self._workspace = library, channel, aboard, workspace
        self._wake = asyncio.Event()
        self._made: tuple[str, Dsm | None] | None = None

    @property
    def is_settled(self) -> bool:
        """What is followed is what is on board now."""
        return _same(self._key(self._aboard.record), self._made)

    def look(self) -> None:
        if not _same(self._key(self._aboard.record), self._made):
            self._wake.set()

    async def run(self) -> None:
        """Until cancelled; a plan that cannot be followed is flown all the same."""
        while True:
            await self._wake.wait()
            self._wake.clear()
            record = self._aboard.record
            key = self._key(record)
            try:
                follower = await asyncio.to_thread(self._follower, record)
            except Exception as error:
                log.warning("The plan on board cannot be followed: %s", reported(error, log, "Following").what)
                follower = Follower(over=self._workspace.dsm)
            self._channel.follower, self._made = follower, key

    def _key(self, record: PlanRecord | None) -> tuple[str, Dsm | None]:
        """Without a plan the model on show is enough; which one it is, is told by identity."""
        return ("", self._workspace.dsm) if record is None else (f"{record.digest} {record.home_alt_dsm_m}", None)

    def _follower(self, record: PlanRecord | None) -> Follower:
        if record is None:
            return Follower(over=self._workspace.dsm)
        terrain = terrain_of(FlownOver(record.terrain_id, record.terrain_sha256), self._library.terrains())
        if terrain is None:
            return Follower(over=self._workspace.dsm)
        return Follower(Followed.of(record, self._library.load_terrain(terrain.id)))


def _same(key: tuple[str, Dsm | None], made: tuple[str, Dsm | None] | None) -> bool:
    return made is not None and key[0] == made[0] and key[1] is made[1]
