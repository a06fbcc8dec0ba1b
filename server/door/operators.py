"""How control passes between operators, and what their pages are told of it."""

from __future__ import annotations

import asyncio
import logging

from server.door.hub import Hub
from server.door.lease import SILENT_S, Lease
from server.errors import reported
from server.schemas import ErrorDoc, LeaseDoc, LeaseMessage, NoticeMessage
from server.schemas.station_docs import FIRST_VEHICLE

log = logging.getLogger("hedgehop.flying")

HEARD_S = 2.0
"""A page that was heard so recently is there."""


class Operators:
    """All methods belong to the event loop."""

    def __init__(self, lease: Lease, hub: Hub, vehicle: int = FIRST_VEHICLE, name: str = "the vehicle") -> None:
        """``name``: what the vehicle is called in sentences."""
        self._lease, self._hub, self._pages, self._name = lease, hub, hub.of_vehicle(vehicle), name
        self._told_silent = False

    def message(self, session_key: str) -> LeaseMessage:
        return LeaseMessage(lease=self._lease.doc_for(session_key))

    async def look(self) -> None:
        """Once a second: who is there, and who got no answer."""
        asker = self._lease.look(self._hub.session_keys(heard_within_s=HEARD_S))
        if asker is not None:
            holder = self._lease.holder
            who = "Who is in charge" if holder is None else holder.name
            advice = "Ask again, or sign that session out under Accounts to take control without an answer."
            self._tell(asker.session_key, "warning", f"{who} has not answered.", advice)
        if asker is not None or self._lease.is_silent != self._told_silent:
            self._publish()

    async def take(self, session_key: str, name: str) -> LeaseDoc:
        """Raises ConflictError while somebody else asks."""
        await self.look()  # a holder whose page is just back is asked
        before = self._lease.press(session_key, name)
        if before is not None:
            what = f"{name} has taken control of {self._name}: nothing was heard of this page for {SILENT_S:g} s."
            self._tell(before.session_key, "warning", what, "Press Take control to ask for it.")
        holder = self._lease.holder
        if holder is not None and holder.session_key != session_key and not self._pages.are_of(holder.session_key):
            what = f"{name} asks for control of {self._name}, which this page does not show."
            self._tell(holder.session_key, "warning", what, "Show it to hand over or keep it.")
        return await self._changed(session_key)

    async def hand_over(self, session_key: str) -> LeaseDoc:
        before = self._lease.holder
        asker = self._lease.hand_over(session_key)
        if before is not None:
            self._tell(
                asker.session_key,
                "info",
                f"{before.name} has handed control over: you are in charge of {self._name}.",
                "",
            )
        return await self._changed(session_key)

    async def keep(self, session_key: str) -> LeaseDoc:
        asker = self._lease.keep(session_key)
        holder = self._lease.holder
        if holder is not None:
            self._tell(asker.session_key, "warning", f"{holder.name} keeps control of {self._name}.", "")
        return await self._changed(session_key)

    async def release(self, session_key: str) -> LeaseDoc:
        if self._lease.release(session_key):
            return await self._changed(session_key)
        return self._lease.doc_for(session_key)

    async def _changed(self, session_key: str) -> LeaseDoc:
        self._publish()
        try:
            await asyncio.to_thread(self._lease.save)
        except Exception as error:
            log.warning("Noting who is in charge: %s", reported(error, log, "Noting who is in charge").what)
        return self._lease.doc_for(session_key)

    def _publish(self) -> None:
        self._told_silent = self._lease.is_silent
        self._pages.publish_each(self.message)

    def _tell(self, session_key: str, level: str, what: str, advice: str) -> None:
        doc = ErrorDoc(code="lease", what=what, advice=advice)
        notice = NoticeMessage(level="info" if level == "info" else "warning", error=doc)
        self._hub.publish_to(session_key, notice)
