"""What the flight desk has done in worker processes, and what it asks the vehicle for that."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from server.errors import NotCertifiedError, NotReadyError, StaleRevisionError
from server.flying.check_task import Checked, check_start, climb_for_resuming, guided_targets
from server.flying.uploading.upload_task import MadeUpload, make_upload
from server.library import Library
from server.library.documents import seen_in
from server.library.terrain_of import FlownOver, terrain_of
from server.schemas import PlanState, TerrainDoc
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus.link_client import LinkClient
from telemetry.errors import TelemetryError
from telemetry.flight.preflight.parameters import NAMES
from telemetry.topics.messages import PlanRecord
from telemetry.topics.onboard_lists import OnboardMission, PlacesOnboard
from telemetry.topics.requests import DownloadPlaces, Operator, ReadParameters
from telemetry.topics.vehicle import VehicleState

if TYPE_CHECKING:
    from telemetry.flight.guided.script_targets import GuidedPlan


class FlightWork:
    """The plan lane's worker still has the plan that is on show; the check, on ``lane``, does not wait for planning."""

    def __init__(self, library: Library, link: LinkClient, workspace: Workspace, lane: Lane) -> None:
        self._library, self._link, self._workspace, self._lane = library, link, workspace, lane

    async def made_upload(self, revision: int, before: PlanRecord | None) -> MadeUpload:
        """Raises StaleRevisionError, NotReadyError, NotCertifiedError."""
        plan = self._workspace.state
        check_uploadable(plan, revision)
        terrain = self._terrain(FlownOver(terrain_id=plan.document.terrain_id or ""))
        directory = self._library.terrain_dir(terrain.id)
        return await self._workspace.plan_lane.call(make_upload, directory, plan.document, terrain.name, before)

    async def checked(
        self,
        operator: Operator,
        record: PlanRecord,
        mission: OnboardMission,
        state: VehicleState,
        rereferenced_m: float | None,
        untaken_kinds: Callable[[], int],
    ) -> Checked:
        """Judges what was read back, with the vehicle's own return height, fence and rally points.

        ``untaken_kinds``: of the fence, as the vehicle's state tells them now; reading may have shown some.
        """
        aboard = await self._aboard(operator)
        parameters = await self._link.call(ReadParameters(NAMES[record.firmware]))
        state = replace(state, fence_kinds_untaken=untaken_kinds())
        return await self._lane.call(
            check_start, self._directory(record), record, mission, state, parameters, aboard, rereferenced_m
        )

    async def guided(self, record: PlanRecord) -> GuidedPlan:
        """Raises MissionError for a mission that the navigation script cannot fly."""
        return await self._lane.call(guided_targets, record)

    async def way_back(self, record: PlanRecord, checked: Checked, from_item: int) -> tuple[int, float]:
        """The item to go on at, and the height above home to fly there at. Raises NotAllowedError."""
        return await self._lane.call(
            climb_for_resuming,
            self._directory(record),
            checked.mission,
            checked.clearance,
            from_item,
            seen_in(record),
        )

    async def _aboard(self, operator: Operator) -> PlacesOnboard:
        try:
            fence = await self._link.call(DownloadPlaces(operator, "fence"))
            return PlacesOnboard(fence, await self._link.call(DownloadPlaces(operator, "rally")))
        except TelemetryError as error:
            return PlacesOnboard(unread=error.what)

    def _directory(self, record: PlanRecord) -> Path:
        terrain = self._terrain(FlownOver(record.terrain_id, record.terrain_sha256))
        return self._library.terrain_dir(terrain.id)

    def _terrain(self, flown: FlownOver) -> TerrainDoc:
        terrain = terrain_of(flown, self._library.terrains())
        if terrain is None:
            raise NotReadyError(
                "The surface model of this plan has been deleted.", advice="Add it again, then upload the plan."
            )
        return terrain


def check_uploadable(plan: PlanState, revision: int) -> None:
    """Raises what stands between the open plan and the vehicle."""
    answer = plan.computation
    if plan.revision != revision:
        raise StaleRevisionError(
            f"The plan has changed meanwhile (revision {plan.revision}, asked for {revision}).",
            advice="Look at the present plan and upload again.",
        )
    if answer.state != "ready" or answer.revision != plan.revision or answer.result is None:
        hint = answer.hint or (answer.error.what if answer.error is not None else "Wait until the plan is computed.")
        raise NotReadyError("There is no finished plan to upload.", advice=hint)
    if not answer.result.certified:
        reason = answer.result.reasons[0] if answer.result.reasons else None
        raise NotCertifiedError(
            "The plan is not certified" + ("." if reason is None else f": {reason.text}"),
            advice="" if reason is None else reason.mend,
        )
