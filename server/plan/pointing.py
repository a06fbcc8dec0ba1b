"""Clicks and drags in the 3D view, through the tool in hand: edits that have nobody to raise errors to."""

from __future__ import annotations

import logging

from server.errors import reported
from server.library.edits import clicked, moved, picked
from server.plan.on_show import OnShow
from server.plan.plan_desk import PlanDesk, Proposal
from server.schemas import ErrorDoc, NoticeMessage, Pages, PlaceDoc, PlanDoc, SelectionDoc

log = logging.getLogger("hedgehop.plan")


class Pointing:
    def __init__(self, desk: PlanDesk, on_show: OnShow, pages: Pages) -> None:
        self._desk, self._on_show, self._pages = desk, on_show, pages

    async def on_terrain(self, lat_deg: float, lon_deg: float, *, known: bool) -> None:
        """A click on the surface model; on that of a recording it means nothing."""
        if self._on_show.is_review:
            return
        asks_where = self._on_show.selection.tool in ("landing", "there")
        if not asks_where and clicked(self._desk.document, self._on_show.selection, lat_deg, lon_deg) is None:
            return
        if not known:
            self._pages.publish(NoticeMessage(level="warning", error=_unknown_ground(lat_deg, lon_deg)))
            return
        if asks_where:
            # Edits nothing: the page that took the tool asks for sites, or for a way there.
            self._on_show.select(SelectionDoc(place=PlaceDoc(lat_deg=lat_deg, lon_deg=lon_deg)))
            return
        selections: list[SelectionDoc] = []

        def click(document: PlanDoc) -> tuple[str, PlanDoc] | None:
            outcome = clicked(document, self._on_show.selection, lat_deg, lon_deg)
            if outcome is None:
                return None
            selections.append(outcome[2])
            return outcome[:2]

        if await self._propose(click) and selections:
            self._on_show.select(selections[0])

    async def on_mark_moved(self, mark: str, lat_deg: float, lon_deg: float) -> None:
        await self._propose(lambda document: moved(document, mark, lat_deg, lon_deg))

    def on_mark(self, mark: str) -> None:
        self._on_show.select(picked(self._desk.document, self._on_show.selection, mark))

    async def _propose(self, proposal: Proposal) -> bool:
        try:
            await self._desk.propose(proposal)
        except Exception as error:
            self._pages.publish(NoticeMessage(level="error", error=reported(error, log, "An edit in the 3D view")))
            return False
        return True


def _unknown_ground(lat_deg: float, lon_deg: float) -> ErrorDoc:
    return ErrorDoc(
        code="poi",
        what="The surface is unknown there.",
        where=f"{lat_deg:.7f}, {lon_deg:.7f}",
        advice="Choose a place on known ground.",
    )
