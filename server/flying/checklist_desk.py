"""One vehicle's checklist before a start: which points are ticked, by whom, and for what the ticks hold.

They hold for these words, this vehicle and this mission, until it is disarmed or was not heard. They are not kept on
disk: a server that starts anew asks for them again, as it asks for the check.
"""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, replace
from functools import lru_cache

from planning.errors import PlanningError
from planning.missions.vehicle_profile import parse_profile
from server.errors import BadRequestError, CheckNeededError, StorageError
from server.flying.checklists import Checklists
from server.heard.onboard import Aboard
from server.schemas import ChecklistDoc, TickBody
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.topics.checklist import ChecklistPoint, ChecklistRecord, digest_of
from telemetry.topics.messages import LinkStatus, Topic
from telemetry.topics.requests import NoteChecklist, Operator, TickPoint

_LOOK_AGAIN = "Look at the list under Before the start again."


@dataclass(frozen=True, slots=True)
class _Asked:
    """What has to be ticked, and for what."""

    profile: str
    points: tuple[ChecklistPoint, ...]
    vehicle: str
    mission: str


class ChecklistDesk:
    def __init__(self, link: LinkClient, lists: Checklists, aboard: Aboard, bus: Bus) -> None:
        self._link, self._lists, self._aboard, self._bus = link, lists, aboard, bus
        self._for: _Asked | None = None
        self._ticked: dict[int, ChecklistPoint] = {}
        """Points by their number, 1 is the first."""
        self._why_again = ""
        self._noted: tuple[str, str, str] | None = None
        """The text that the log of commands was told last: its vehicle, profile and revision."""

    @property
    def doc(self) -> ChecklistDoc | None:
        """None where no mission of a plan is on board."""
        try:
            asked = self._settled()
        except StorageError as error:
            return ChecklistDoc(fault=f"{error.what} {error.advice}")
        if asked is None:
            return None
        return ChecklistDoc(
            profile=asked.profile,
            revision=digest_of(asked.points),
            points=list(self._points(asked)),
            why_again=self._why_again,
        )

    # What is heard

    def on_link(self, status: LinkStatus, *, armed: bool) -> None:
        """In flight nothing is asked again because a radio faded."""
        if status.adopted is None:
            self.forget("The vehicle was disconnected.")
        elif status.state == "lost" and not armed:
            self.forget("The vehicle was not heard for a while: it may have been switched off, or changed.")

    def forget(self, why: str) -> None:
        """Each point is open again."""
        if self._ticked:
            self._ticked, self._why_again = {}, why
            self._publish()

    # What is asked

    async def tick(self, operator: Operator, body: TickBody) -> None:
        """Raises CheckNeededError where the list, the vehicle or the mission is not the one that the page showed."""
        asked = self._needed(body.digest)
        if body.revision != digest_of(asked.points):
            raise CheckNeededError("The checklist was changed: its points are others now.", advice=_LOOK_AGAIN)
        if body.number > len(asked.points):
            raise BadRequestError(f"The checklist has {len(asked.points)} points, and no point {body.number}.")
        if (body.number in self._ticked) == body.ticked:
            return
        point = asked.points[body.number - 1]
        await self._note(operator, asked)
        await self._link.call(
            TickPoint(operator, body.number, len(asked.points), point.text, asked.profile, ticked=body.ticked)
        )
        if self._settled() != asked:
            raise CheckNeededError("What is on board, or the list, changed just now.", advice=_LOOK_AGAIN)
        if body.ticked:
            self._ticked[body.number] = replace(point, ticked_by=operator.name, ticked_utc_s=time.time())
        else:
            self._ticked.pop(body.number, None)
        if len(self._ticked) == len(asked.points):
            self._why_again = ""
        self._publish()

    async def log_changes(self, operator: Operator) -> None:
        """Texts that were changed since stand in the log of commands, whether anybody ticks them or not.

        Raises what keeps them from it: they are written at the next call.
        """
        for profile, change in self._lists.unlogged:
            told = change.points, change.revision, change.by, change.utc
            await self._link.call(NoteChecklist(operator, profile, *told, changed=True))
            await asyncio.to_thread(self._lists.logged, profile, change)

    async def _note(self, operator: Operator, asked: _Asked) -> None:
        """Who wrote what is ticked is in the log before the first tick of it: a change by somebody shows there."""
        kept = self._lists.of(asked.profile)
        noted = asked.vehicle, asked.profile, kept.revision
        if noted != self._noted:
            written = kept.changed_by, kept.changed_utc
            await self._link.call(NoteChecklist(operator, asked.profile, len(asked.points), kept.revision, *written))
            self._noted = noted

    def check(self, digest: str) -> None:
        """Raises CheckNeededError unless every point is ticked for this mission; StorageError where the lists are not
        known."""
        asked = self._needed(digest)
        left = [point for number, point in enumerate(asked.points, start=1) if number not in self._ticked]
        if left:
            of = f"{len(left)} of {len(asked.points)} points" if len(asked.points) > 1 else "The point"
            are = "are" if len(left) > 1 else "is"
            what = f'{of} of the checklist {are} open, first "{left[0].text}".'
            raise CheckNeededError(f"{what} {self._why_again}".strip(), advice="Look, then tick each of them.")

    def started(self) -> None:
        """The start is being given: for the recording, which begins with it."""
        self._publish(started_utc_s=time.time())

    # How

    def _needed(self, digest: str) -> _Asked:
        asked = self._settled()
        if asked is None or asked.mission != digest:
            raise CheckNeededError("Another mission is on board than the one that was looked at.", advice=_LOOK_AGAIN)
        return asked

    def _settled(self) -> _Asked | None:
        """What is asked now; ticks that were made for anything else are gone. Raises StorageError."""
        asked = self._asked()
        if asked != self._for:
            if self._ticked:
                self._ticked, self._why_again = {}, _what_changed(self._for, asked)
            self._for = asked
        return asked

    def _asked(self) -> _Asked | None:
        record, vehicle = self._aboard.record, self._aboard.vehicle
        if record is None or vehicle is None:
            return None
        profile = _profile_name(record.profile_toml)
        return _Asked(profile, self._lists.points(profile), vehicle, record.digest)

    def _points(self, asked: _Asked) -> tuple[ChecklistPoint, ...]:
        return tuple(self._ticked.get(number, point) for number, point in enumerate(asked.points, start=1))

    def _publish(self, *, started_utc_s: float | None = None) -> None:
        if (asked := self._for) is not None and asked.points:
            record = ChecklistRecord(
                time.time(), asked.profile, asked.vehicle, asked.mission, self._points(asked), started_utc_s
            )
            self._bus.publish(Topic.CHECKLIST, record)


def _what_changed(then: _Asked | None, now: _Asked | None) -> str:
    if then is None or now is None or then.mission != now.mission:
        return "Another mission is on board since it was ticked."
    if then.vehicle != now.vehicle:
        return "Another vehicle is connected since it was ticked."
    return "The list was changed since it was ticked."


@lru_cache(maxsize=8)
def _profile_name(profile_toml: str) -> str:
    """Empty for one that cannot be read: no check before the start passes with that."""
    try:
        return parse_profile(profile_toml.encode(), where="the profile of the mission on board").name
    except PlanningError:
        return ""
