"""Surface models as a whole: the demo's is made, with its plan, and none that a plan needs is deleted."""

from __future__ import annotations

import asyncio

from server.errors import InUseError, NotFoundError
from server.library import Library
from server.plan import demo
from server.plan.plan_desk import PlanDesk
from server.plan.plan_requests import PlanRequests
from server.schemas import Pages, TerrainDoc
from server.work.job_board import JobBoard


class TerrainDesk:
    def __init__(self, library: Library, desk: PlanDesk, plans: PlanRequests, board: JobBoard, pages: Pages) -> None:
        self._library, self._desk, self._plans, self._board, self._pages = library, desk, plans, board, pages
        self.demo_is_open = asyncio.Event()

    async def add_demo(self) -> TerrainDoc:
        """The generated demo model with its plan, made on first use, opened."""
        await self._board.run("The demo", lambda lane, progress: demo.ensure_terrain(self._library, lane, progress))
        self._pages.publish(self._library.message())
        return await self._open_demo(demo.terrain(self._library))

    async def open_made_demo(self) -> bool:
        """Whether the demo had been made before."""
        terrain = demo.terrain(self._library)
        if terrain is not None:
            await self._open_demo(terrain)
        return terrain is not None

    async def delete(self, terrain_id: str) -> None:
        """Raises InUseError while a plan needs it."""
        async with self._desk.editing:
            users = await asyncio.to_thread(self._library.plans_using, terrain_id)
            if self._desk.document.terrain_id == terrain_id:
                users = [self._desk.document.name, *users]
            if users:
                raise InUseError(
                    f"The surface model is used by the plan {users[0]!r}.",
                    advice="Delete that plan or give it another model first.",
                )
            await asyncio.to_thread(self._library.delete_terrain, terrain_id)
        self._pages.publish(self._library.message())

    async def _open_demo(self, terrain: TerrainDoc | None) -> TerrainDoc:
        if terrain is None:
            raise NotFoundError("The demo surface model was deleted meanwhile.", advice="Try again.")
        await self._plans.open(await asyncio.to_thread(demo.ensure_plan, self._library, terrain))
        self.demo_is_open.set()
        return terrain
