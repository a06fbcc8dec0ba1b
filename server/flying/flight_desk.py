"""The desk from which a vehicle is flown: mission up, check, start, and every other command.

Commands are made here from live data only; nothing of a replay comes near it.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import AsyncIterator, Collection
from dataclasses import replace

from planning.errors import DescribedError
from planning.flight_time.return_speeds import ReturnSpeeds
from server.errors import CheckNeededError, ConflictError
from server.flying.apart.other_vehicles import PENDING
from server.flying.check_task import Checked
from server.flying.checklist_desk import ChecklistDesk
from server.flying.in_flight.take_up_desk import TakingUp, with_words
from server.flying.in_flight.take_up_task import AskedTakeUp, MadeTakeUp
from server.flying.starting import Ready, check_firmware, check_goes_on, check_start, preflight_now
from server.flying.uploading.mission_uploads import Uploads
from server.flying.work import FlightWork
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.obstacles.obstacle_watch import Watch
from server.schemas import (
    CheckRow,
    FlyMessage,
    FlyState,
    Pages,
    PreflightDoc,
    StartFlight,
    TakenUpDoc,
    TakeUpPlan,
    TickBody,
)
from server.workspace import Workspace
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, NoVehicleError
from telemetry.mavlink.flight_keeper import item_of
from telemetry.topics.messages import FlightStatus, LinkStatus, PlanRecord, Topic
from telemetry.topics.requests import (
    Download,
    LinkRequest,
    Operator,
    Resume,
    StartAuto,
    StartGuided,
)
from telemetry.topics.vehicle import VehicleState


class FlightDesk:
    def __init__(
        self,
        link: LinkClient,
        work: FlightWork,
        aboard: Aboard,
        checklist: ChecklistDesk,
        workspace: Workspace,
        live: Channel,
        watch: Watch,
        bus: Bus,
        pages: Pages,
        taking_up: TakingUp,
        *,
        is_alone: bool,
    ) -> None:
        """``is_alone``: the station has no other vehicle."""
        self._link, self._work, self._aboard, self._workspace = link, work, aboard, workspace
        self._checklist, self._taking_up, self._uploads = checklist, taking_up, Uploads(link, aboard, bus)
        self._live, self._watch, self._bus, self._pages = live, watch, bus, pages
        self._utc_minus_mono_s = time.time() - time.monotonic()
        self._flight = FlightStatus()
        self._ready: Ready | None = None
        self._others = None if is_alone else PENDING
        self._busy = self._at_fence = ""
        self._rises_m: float | None = None
        self._rises_of: tuple[str | None, str] = None, ""
        """Vehicle and mission that it was found for."""
        self._written = 0
        """How often parameters were written."""
        self._told: FlyState | None = None
        self._taken_up: TakenUpDoc | None = None

    @property
    def state(self) -> FlyState:
        return FlyState(
            onboard=self._aboard.doc(self._workspace.document),
            preflight=None if self._ready is None else self._preflight(self._ready),
            checklist=self._checklist.doc,
            resume_from_item=self._flight.broke_off_at,
            at_fence=self._at_fence,
            taken_up=None if self._taken_up is None else self._taken_up.model_copy(update={"others": self._others}),
            busy=self._busy,
            can_cancel=self._taking_up.is_computing,
        )

    @property
    def home_rises_m(self) -> float | None:
        """The vehicle's home above the planned one, by the surface model; None: the last check does not tell it, or is
        void for more than parameters that were written."""
        return self._rises_m if self._rises_of == (self._aboard.vehicle, self._aboard.digest) else None

    # What is heard

    def on_link(self, status: LinkStatus) -> None:
        before = self._aboard.vehicle
        self._aboard.on_link(status)
        if self._aboard.vehicle != before:
            self._at_fence, self._taken_up, self._live.returns = "", None, ReturnSpeeds()
            self._taking_up.forget()
            self._uploads.forget()
        self._checklist.on_link(status, armed=self._live.state is not None and self._live.state.armed)
        if self._ready is not None and not _still_holds(self._ready, status):
            self._ready = self._rises_m = None
        self.refresh()

    def on_flight(self, flight: FlightStatus) -> None:
        self._flight = flight
        if flight.phase != "paused" and not self._busy:
            self._taken_up = None
        if flight.way == "auto" and flight.phase in ("taking_off", "flying") and not self._busy:
            self._taking_up.forget()
        self.refresh()

    def on_others(self, row: CheckRow) -> None:
        """What the station's other vehicles mean for a start now."""
        if row != self._others:
            self._others = row
            self.refresh()

    def on_disarmed(self) -> None:
        """A flight changes what was checked before it, the battery above all."""
        self._ready = self._rises_m = None
        self._taking_up.forget()
        self._checklist.forget("The vehicle was disarmed: each flight is ticked for itself.")
        self.refresh()

    def on_home_set(self) -> None:
        """By order, or perhaps: what was checked before a start was checked for the home before."""
        self._ready = self._rises_m = None
        self.refresh()

    def on_parameters(self) -> None:
        """Some were written, or may have been: what was checked before may not hold any more."""
        self._ready, self._at_fence, self._live.returns = None, "", ReturnSpeeds()
        self._written += 1
        self.refresh()

    def refresh(self) -> None:
        """Tells the pages, if there is anything new; also when the open plan has changed."""
        if (state := self.state) != self._told:
            self._told = state
            self._pages.publish(FlyMessage(fly=state))

    def tell_recorder(self) -> None:
        """Which plan is flown."""
        self._uploads.tell_recorder()

    # What is asked

    async def upload(self, operator: Operator, revision: int) -> FlyState:
        """Raises NotReadyError, NotCertifiedError, StaleRevisionError, TransferError and what the vehicle said."""
        async with self._doing("Uploading"):
            self._ready = self._rises_m = None
            made = await self._work.made_upload(revision, self._aboard.uploaded)
            check_firmware(made.record, self._state())
            await self._uploads.places_of_plan(operator, made)
            home = made.home_lat_deg, made.home_lon_deg, made.home_alt_m
            await self._uploads.mission(operator, made.items, made.record, home)
        return self.state

    async def take_up(self, operator: Operator, body: TakeUpPlan) -> FlyState:
        """Holds the vehicle, makes the way from there into the open plan and the plan's rest its mission, and leaves it
        holding: ``resume`` flies that. Raises what is in the way, and says where that leaves the vehicle."""
        async with self._doing("Holding the vehicle"):
            self._ready = self._taken_up = None
            self._others = None if self._others is None else PENDING
            taking = self._taking_up
            taking.check_flies()
            taking.begin_try()
            try:
                await taking.hold(operator)
                async with taking.computing():
                    self._set_busy("Finding the way into the plan")
                    asked, made = await taking.made(operator, body, self._set_busy)
                self._set_busy("Uploading")
                await self._put_on_board(operator, asked, made)
            except DescribedError as error:
                raise with_words(error, await taking.what_is_aboard(operator)) from error
            self._taken_up = made.doc
        return self.state

    def cancel_take_up(self) -> FlyState:
        """While the way or the certificate is computed. Raises ConflictError otherwise."""
        self._taking_up.cancel()
        return self.state

    async def check(self, operator: Operator) -> FlyState:
        """Raises MissionUnknownError when what is on board did not come from here."""
        async with self._doing("Checking the start"):
            self._ready = self._rises_m = None
            vehicle, state, written = self._vehicle_id(), self._state(), self._written
            checked = await self._checked(operator, state)
            if (moved := checked.moved) is not None:
                self._set_busy("Moving the heights to the vehicle's home")
                await self._uploads.mission(operator, moved.items, moved.record, moved.home)
                checked = await self._checked(operator, state, rereferenced_m=moved.shift_m)
            if vehicle != self._vehicle_id():
                raise CheckNeededError("Another vehicle was adopted during the check.", advice="Press Check again.")
            if written != self._written:
                raise CheckNeededError("Parameters were written during the check.", advice="Press Check again.")
            self._at_fence, self._live.returns = checked.at_fence, checked.returns
            self._ready = Ready(checked, self._aboard.digest, vehicle, state, time.monotonic())
            self._rises_m, self._rises_of = checked.home_rises_m, (vehicle, self._aboard.digest)
            if checked.certificate_json:
                self._aboard.certified(checked.certificate_json)
                await self._uploads.note()
        return self.state

    async def start(self, operator: Operator, body: StartFlight) -> None:
        """Raises CheckNeededError unless a fresh check of this very mission went well, given what is accepted, and each
        point of the crew's checklist is ticked for it."""
        async with self._doing("Starting"):
            ready = self._check_start(body)
            record = self._aboard.known_record(body.digest)
            request = await self._start_request(operator, body, record, ready)
            # What was prepared meanwhile may have taken its time.
            self._check_start(body)
            self._bus.publish(Topic.PLAN, replace(record, t_utc_s=time.time()))
            self._checklist.started()
            await self._link.call(request)

    async def tick(self, operator: Operator, body: TickBody) -> FlyState:
        """Raises CheckNeededError where what was ticked is not what is asked any more."""
        try:
            await self._checklist.tick(operator, body)
        finally:
            self.refresh()
        return self.state

    @property
    def waits_in_air(self) -> bool:
        """With a plan that was taken up, of which nothing is flown yet."""
        record, state = self._aboard.record, self._live.state
        is_new = record is not None and record.taken_up and self._flight.phase == "paused"
        return is_new and state is not None and (item_of(state) or 1) == 1

    async def resume(self, operator: Operator, accept: Collection[str]) -> None:
        """Raises CheckNeededError where a plan that was taken up would meet another vehicle now."""
        if self._taken_up is not None or self.waits_in_air:
            check_goes_on(self._others, accept)
        await self._link.call(Resume(operator))

    async def command(self, request: LinkRequest) -> None:
        """At any time: whatever else is being done, the vehicle can be told to hold, return or land."""
        await self._link.call(request)

    # How

    def _preflight(self, ready: Ready) -> PreflightDoc:
        return preflight_now(ready, self._watch.avoidance, self._others, utc_minus_mono_s=self._utc_minus_mono_s)

    def _check_start(self, body: StartFlight) -> Ready:
        ready = check_start(
            self._ready,
            body,
            self._state(),
            self._watch.avoidance,
            self._others,
            now_mono_s=time.monotonic(),
            utc_minus_mono_s=self._utc_minus_mono_s,
        )
        self._checklist.check(body.digest)
        return ready

    async def _put_on_board(self, operator: Operator, asked: AskedTakeUp, made: MadeTakeUp) -> None:
        """Only what was read back, and certified as such, is taken up."""
        if made.places:
            self._taking_up.sends(places=True)
            await self._uploads.places(operator, made.places, while_holding=True)
        home = (asked.state.home_lat_deg or 0.0, asked.state.home_lon_deg or 0.0, made.record.home_alt_dsm_m or 0.0)
        self._taking_up.sends(places=False)
        found = await self._uploads.mission(operator, made.items, made.record, home, while_holding=True)
        async with self._taking_up.computing():
            self._set_busy("Certifying what is on board")
            certificate_json, certified_home = await self._taking_up.certificate(operator, asked, found)
        self._set_busy("Taking it up")
        self._aboard.certified(certificate_json)
        await self._uploads.note()  # before: what fails here leaves it not taken up
        await self._taking_up.begin(operator, found.digest, made, certified_home)

    async def _checked(
        self, operator: Operator, state: VehicleState, *, rereferenced_m: float | None = None
    ) -> Checked:
        mission = await self._link.call(Download(operator))
        record = self._aboard.known_record(mission.digest)
        check_firmware(record, state)
        untaken = lambda: self._state().fence_kinds_untaken  # noqa: E731
        return await self._work.checked(operator, record, mission, state, rereferenced_m, untaken)

    async def _start_request(
        self, operator: Operator, body: StartFlight, record: PlanRecord, ready: Ready
    ) -> StartAuto | StartGuided:
        if body.way == "guided":
            if body.from_item != 1:
                raise NotAllowedError(
                    "The navigation script begins at the first waypoint.", advice="Go on with the mission in AUTO."
                )
            if ready.checked.not_guided:
                advice = "Choose GUIDED under Required clearance in Plan and upload again, or fly in AUTO."
                raise NotAllowedError(ready.checked.not_guided, advice=advice)
            plan = await self._work.guided(record)
            spare_m = ready.checked.guided_spare_m
            return StartGuided(operator, plan.targets, plan.takeoff_alt_rel_home_m, end=plan.end, spare_m=spare_m)
        if body.from_item == 1:
            return StartAuto(operator, body.digest)
        from_item, climb_to_m = await self._work.way_back(record, ready.checked, body.from_item)
        return StartAuto(operator, body.digest, from_item, climb_to_m)

    def _state(self) -> VehicleState:
        if (state := self._live.state) is None:
            raise NoVehicleError("No vehicle is connected.", advice="Connect one first.")
        return state

    def _vehicle_id(self) -> str:
        vehicle = self._aboard.vehicle
        if vehicle is None:
            raise NoVehicleError("No vehicle is adopted.", advice="Connect to one first.")
        return vehicle

    @contextlib.asynccontextmanager
    async def _doing(self, what: str) -> AsyncIterator[None]:
        if self._busy:
            raise ConflictError(f"Hedgehop is busy with the vehicle: {self._busy}.", advice="Wait until it is done.")
        self._set_busy(what)
        try:
            yield
        finally:
            self._set_busy("")

    def _set_busy(self, what: str) -> None:
        self._busy = what
        self.refresh()


def _still_holds(ready: Ready, status: LinkStatus) -> bool:
    """A status from before the end of the check says nothing about it."""
    if status.t_mono_s < ready.checked_mono_s:
        return True
    same = status.adopted is not None and status.adopted.id == ready.vehicle
    return same and status.mission_state == "verified" and status.mission_digest == ready.digest
