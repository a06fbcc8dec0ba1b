"""Which surface model counts as known ground: that of the plan on board, else the open one."""

from __future__ import annotations

from collections.abc import Callable

from server.errors import NotFoundError
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.library.terrains import ground_notice
from telemetry.topics.messages import PlanRecord
from telemetry.topics.obstacles import GroundNotice


class KnownGround:
    """Published when it changes; a node that starts later gets the last word from the bus."""

    def __init__(self, library: Library, publish: Callable[[GroundNotice], None]) -> None:
        self._library, self._publish = library, publish
        self._said: GroundNotice | None = None

    def want(self, record: PlanRecord | None, open_terrain_id: str | None) -> None:
        """Without either the last one stays: a vehicle may be in the air over it."""
        notice = self._notice(record, open_terrain_id)
        if notice is not None and notice != self._said:
            self._said = notice
            self._publish(notice)

    def _notice(self, record: PlanRecord | None, open_terrain_id: str | None) -> GroundNotice | None:
        if record is not None:
            found = terrain_of(FlownOver(record.terrain_id, record.terrain_sha256), self._library.terrains())
            open_terrain_id = open_terrain_id if found is None else found.id
        if open_terrain_id is None:
            return None
        try:
            return ground_notice(self._library.terrain_dir(open_terrain_id))
        except NotFoundError:
            return None
