"""Mission, fence and rally points on their way to the vehicle: on board is what was read back, and nothing else."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Mapping
from dataclasses import replace

from server.flying.uploading.upload_task import MadeUpload
from server.heard.onboard import Aboard, onboard
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.errors import TransferError
from telemetry.topics.messages import PlanRecord, Topic
from telemetry.topics.onboard_lists import Item, OnboardMission, PlaceList, UploadReport
from telemetry.topics.requests import DownloadPlaces, Operator, Upload, UploadPlaces

_LISTS: dict[PlaceList, str] = {"fence": "fence", "rally": "list of rally points"}


class Uploads:
    def __init__(self, link: LinkClient, aboard: Aboard, bus: Bus) -> None:
        self._link, self._aboard, self._bus = link, aboard, bus
        self._sent: dict[PlaceList, tuple[Item, ...]] = {}
        """Fence and rally points that were sent last, whatever came of it."""

    def forget(self) -> None:
        """Another vehicle is flown."""
        self._sent = {}

    async def mission(
        self,
        operator: Operator,
        items: tuple[Item, ...],
        record: PlanRecord,
        home: tuple[float, float, float],
        *,
        while_holding: bool = False,
    ) -> OnboardMission:
        """``home``: latitude, longitude, height. Raises TransferError when what is read back is something else."""
        report = await self._link.call(Upload(operator, items, *home, while_holding=while_holding))
        if not report.verified:
            raise _not_verified(report, "mission")
        record = replace(record, digest=report.onboard.digest, t_utc_s=time.time())
        self._aboard.read_back(onboard(record, len(report.onboard.items), report.rounded))
        await self.note()
        return report.onboard

    async def places(
        self, operator: Operator, places: Mapping[PlaceList, tuple[Item, ...]], *, while_holding: bool = False
    ) -> None:
        """Raises TransferError."""
        for kind, items in places.items():
            self._sent[kind] = items
            report = await self._link.call(UploadPlaces(operator, kind, items, while_holding=while_holding))
            if not report.verified:
                raise _not_verified(report, _LISTS[kind])

    async def places_of_plan(self, operator: Operator, made: MadeUpload) -> None:
        """Before the mission, which counts as on board only with them. A list that the plan does not have is left as it
        is, unless it is that of the plan before, or of one that was not taken up."""
        for kind, items in made.places.items():
            if items or await self._is_left_over(operator, kind, made.places_before[kind]):
                await self.places(operator, {kind: items})

    async def _is_left_over(self, operator: Operator, kind: PlaceList, before: tuple[Item, ...]) -> bool:
        ours = [_marks(items) for items in (before, self._sent.get(kind, ())) if items]
        return bool(ours) and _marks(await self._link.call(DownloadPlaces(operator, kind))) in ours

    async def note(self) -> None:
        """What is on board now, for the recorder and for the next server."""
        self.tell_recorder()
        await asyncio.to_thread(self._aboard.save)

    def tell_recorder(self) -> None:
        """Which plan is flown."""
        if (record := self._aboard.record) is not None:
            self._bus.publish(Topic.PLAN, record)


def _marks(items: tuple[Item, ...]) -> list[tuple[int, int, int]]:
    """Alike for what was sent and for what a vehicle made of it."""
    return [(item.command, round(item.lat_deg * 1e7), round(item.lon_deg * 1e7)) for item in items]


def _not_verified(report: UploadReport, what: str) -> TransferError:
    first = report.differences[0] if report.differences else f"It answered, but holds another {what}."
    more = f" ({len(report.differences) - 1} more such differences.)" if len(report.differences) > 1 else ""
    return TransferError(
        f"The vehicle does not hold the {what} that was sent: {first}{more}",
        advice="Upload again. Do not start what is on board.",
    )
