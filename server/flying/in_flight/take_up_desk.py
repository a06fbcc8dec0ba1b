"""A plan that is taken up in flight, step by step: the vehicle is held, the way and the rest are made and judged, and
what came on board is judged once more before it is the mission that ``resume`` flies."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

from planning.errors import DescribedError
from planning.formats.commands import has_position
from planning.formats.wpl import read_wpl
from planning.missions.vehicle_profile import parse_profile
from server.errors import ConflictError, JobCancelledError, NotReadyError
from server.flying.in_flight.take_up_task import AskedTakeUp, MadeTakeUp, check_take_up, make_take_up
from server.flying.work import check_uploadable
from server.heard.channel import Channel
from server.heard.onboard import Aboard
from server.library import Library
from server.library.terrain_of import FlownOver, terrain_of
from server.obstacles.coming_down_task import SHADOW_M
from server.obstacles.obstacle_watch import Watch
from server.obstacles.surroundings import returns_from, seen_before_near, seen_maps
from server.schemas import TakenUpDoc, TakeUpPlan
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus.link_client import LinkClient
from telemetry.errors import NotAllowedError, NoVehicleError, SilentError, TelemetryError
from telemetry.flight.guided.beginning import why_moves
from telemetry.flight.guided.handover import is_fresh
from telemetry.flight.home_watch import HomePlace, home_of, home_of_takeoff
from telemetry.flight.preflight.parameters import NAMES
from telemetry.mavlink.autopilot_orders import HOLD_MODES
from telemetry.mavlink.believing import is_in_the_air
from telemetry.mavlink.flight_keeper import item_of
from telemetry.topics.messages import PlanRecord
from telemetry.topics.onboard_lists import OnboardMission, PlacesOnboard
from telemetry.topics.requests import Download, DownloadPlaces, Operator, Pause, ReadParameters, TakeUp
from telemetry.topics.vehicle import VehicleState

E = TypeVar("E", bound=DescribedError)
HOLDS_WITHIN_S, LOOK_EVERY_S, STILL_S = 30.0, 0.1, 1.0
"""So long it must be still, at a stretch, before its place is taken for the beginning."""
RETRY = "Try again, return home, or land."
FOUND_WITHIN_S = 60.0
"""Longer nobody lets a vehicle hover for an answer; it can be told to return or land all the while."""
FIRMWARES = {"ardupilot": "ArduPilot", "px4": "PX4"}


@dataclass(frozen=True, slots=True)
class Before:
    """What was on board before anything was sent in this flight."""

    digest: str | None
    record: PlanRecord | None
    item: int
    """That was flown to."""
    places: PlacesOnboard | None = None
    """Fence and rally points; None: not read yet."""


class TakingUp:
    """Raises what the vehicle said, and DescribedErrors that say what is in the way."""

    def __init__(
        self,
        link: LinkClient,
        live: Channel,
        workspace: Workspace,
        library: Library,
        lane: Lane,
        watch: Watch,
        aboard: Aboard,
    ) -> None:
        self._link, self._live, self._workspace, self._library = link, live, workspace, library
        self._lane, self._watch, self._aboard = lane, watch, aboard
        self._until: asyncio.Timeout | None = None
        """Of what is being computed; None: nothing is."""
        self._is_cancelled = False
        self.forget()

    def forget(self) -> None:
        """Another flight, or what is on board is flown: no try that failed counts any more."""
        self._before: Before | None = None
        self._sent: Literal["nothing", "mission", "places"] = "nothing"

    @property
    def is_computing(self) -> bool:
        return self._until is not None

    @contextlib.asynccontextmanager
    async def computing(self) -> AsyncIterator[None]:
        """``cancel`` ends what is done in it, and the process that does it, with JobCancelledError: also where all was
        done already, so that nothing is sent that was cancelled."""
        self._is_cancelled = False
        try:
            async with asyncio.timeout(None) as self._until:
                yield
        except TimeoutError:
            if not self._is_cancelled:
                raise
        finally:
            self._until = None
        if self._is_cancelled:
            raise JobCancelledError("Taking up the plan was cancelled.")

    def cancel(self) -> None:
        """Raises ConflictError where nothing is being computed: what was sent to the vehicle is not called back."""
        if self._until is None:
            what = "Nothing is being computed that could be cancelled."
            raise ConflictError(what, advice="See what is on board; return home or land at any time.")
        if self._is_cancelled:
            return  # it is being ended
        self._is_cancelled = True
        self._until.reschedule(asyncio.get_running_loop().time())

    def check_flies(self) -> None:
        state = self._state()
        if not (state.armed and is_in_the_air(state)):
            raise NotAllowedError("The vehicle is not in the air.", advice="Upload the plan and check it.")

    def begin_try(self) -> None:
        """A try that failed has changed what is on board, not what this flight has flown."""
        if self._before is None or self._sent == "nothing":
            record = self._aboard.record
            digest = None if record is None else record.digest
            self._before = Before(digest, record, item_of(self._state()) or 1)

    def sends(self, *, places: bool) -> None:
        """A list is about to be sent."""
        self._sent = "places" if places or self._sent == "places" else "mission"

    async def hold(self, operator: Operator) -> None:
        """Until it has stood still for a while."""
        await self._link.call(Pause(operator))
        end_s, still_s = time.monotonic() + HOLDS_WITHIN_S, 0.0
        while still_s < STILL_S:
            if time.monotonic() > end_s:
                what = f"The vehicle does not stand still within {HOLDS_WITHIN_S:.0f} s."
                raise SilentError(what, advice="Look at it.")
            await asyncio.sleep(LOOK_EVERY_S)
            still_s = still_s + LOOK_EVERY_S if _holds(self._state()) else 0.0

    async def made(
        self, operator: Operator, body: TakeUpPlan, tell: Callable[[str], None]
    ) -> tuple[AskedTakeUp, MadeTakeUp]:
        """Nothing is sent. ``tell``: what is being done."""
        plan = self._workspace.state
        check_uploadable(plan, body.revision)
        assert self._before is not None
        document, state, before = plan.document, self._state(), self._before.record
        _check_same(document.profile.firmware, document.profile.name, state, before)
        terrain = terrain_of(FlownOver(document.terrain_id or ""), self._library.terrains())
        if terrain is None:
            raise NotReadyError("The plan's surface model has been deleted.", advice="Open another plan.")
        if before is not None and before.terrain_sha256 != terrain.sha256:
            what = f'The plan is over "{terrain.name}", the vehicle took off over "{before.terrain_name}".'
            raise NotAllowedError(what, where="surface model", advice="Plan over the model that the flight began over.")
        places = await self._places(operator)
        if self._sent == "nothing":
            self._before = replace(self._before, places=places)
        asked = AskedTakeUp(
            self._library.terrain_dir(terrain.id),
            document,
            terrain.name,
            before,
            self._before.item,
            state,
            time.monotonic(),
            await self._link.call(ReadParameters(NAMES["px4" if state.autopilot == "px4" else "ardupilot"])),
            places,
            self._before.places or places,
            await seen_maps(self._watch),
            home_of_takeoff(self._live.track.states),
        )
        asked = replace(asked, state=self._state(), now_mono_s=time.monotonic())
        limit = asyncio.timeout(FOUND_WITHIN_S)
        try:
            async with limit:
                made = await self._workspace.plan_lane.call(make_take_up, asked, progress=lambda step, _: tell(step))
        except TimeoutError:
            if not limit.expired():
                raise
            what = f"No way into the plan was found within {FOUND_WITHIN_S:.0f} s."
            raise NotReadyError(what, advice="Plan fewer points, or a smaller position error.") from None
        battery = made.doc.battery
        if battery.state != "good" and (battery.state != "accept" or "battery" not in body.accept):
            raise NotAllowedError(battery.text, where="battery", advice=battery.mend)
        return asked, replace(made, doc=await self._noted(made, asked))

    async def _noted(self, made: MadeTakeUp, asked: AskedTakeUp) -> TakenUpDoc:
        """With what does not count, and is to be said."""
        within_m = made.doc.required_m + SHADOW_M
        line_deg = await asyncio.to_thread(_looked_along, made, asked, within_m)
        words = await seen_before_near(self._watch, asked.maps, line_deg, within_m)
        return made.doc if words is None else made.doc.model_copy(update={"notes": [*made.doc.notes, words]})

    async def certificate(
        self, operator: Operator, asked: AskedTakeUp, onboard: OnboardMission
    ) -> tuple[str, HomePlace]:
        """Of what was read back, as JSON, and the home that it holds for."""
        aboard, maps = await self._places(operator), await seen_maps(self._watch)
        now = replace(asked, state=self._state(), now_mono_s=time.monotonic(), aboard=aboard, maps=maps)
        if (home := home_of(now.state)) is None:
            what = "The vehicle does not tell its home whole: what is on board can be certified for none."
            raise NotReadyError(what, where="home", advice="Wait for home, then take the plan up again.")
        return await self._lane.call(check_take_up, now, onboard), home

    async def begin(self, operator: Operator, digest: str, made: MadeTakeUp, home: HomePlace) -> None:
        """``home``: that it was certified for; the link refuses it for another one."""
        await self._link.call(TakeUp(operator, digest, *made.begins, home))
        self.forget()

    async def what_is_aboard(self, operator: Operator) -> str:
        """After something went wrong on the way: read now, not remembered. What Resume does is the link's to say."""
        does, before = self._does(), self._before
        if self._sent == "nothing":
            return self._as_before(does)
        try:
            found = await self._link.call(Download(operator))
        except TelemetryError as error:
            return f"{does}. What is on board is not known ({error.what.rstrip('.')}): Resume is refused. {RETRY}"
        if before is None or found.digest != before.digest:
            are = f"On board are {len(found.items)} items that are not the mission before, and they are not taken up"
            return f"{does}. {are}: Resume is refused. {RETRY}"
        if self._sent == "places":
            are = "The mission before is still on board, but fence or rally points of the new plan were sent"
            return f"{does}. {are}: Resume is refused. {RETRY}"
        return self._as_before(does)

    def _as_before(self, does: str) -> str:
        still = f"{does}, and the mission before is still on board"
        return f"{still}." if self._live.flight.way == "guided" else f"{still}: Resume flies that."

    def _does(self) -> str:
        state = self._live.state
        if state is None or not is_fresh(state, time.monotonic()):
            return "Whether the vehicle holds is not known"
        if state.mode not in HOLD_MODES.get(state.autopilot, ()):
            return f"The vehicle does not hold: it is in {state.mode}"
        return "The vehicle holds" if why_moves(state) is None else "The vehicle does not stand still yet"

    async def _places(self, operator: Operator) -> PlacesOnboard:
        try:
            fence = await self._link.call(DownloadPlaces(operator, "fence"))
            return PlacesOnboard(fence, await self._link.call(DownloadPlaces(operator, "rally")))
        except TelemetryError as error:
            return PlacesOnboard(unread=error.what)

    def _state(self) -> VehicleState:
        if self._live.state is None:
            raise NoVehicleError("No vehicle is connected.", advice="Connect one first.")
        return self._live.state


def _looked_along(made: MadeTakeUp, asked: AskedTakeUp, within_m: float) -> list[tuple[float, float]]:
    """(lat_deg, lon_deg) along the way and the rest, and straight from there to home."""
    mission, home = read_wpl(made.record.mission_wpl), home_of(asked.state)
    turns = [(item.lat_deg, item.lon_deg) for item in mission.items if has_position(item)]
    return returns_from([made.begins[:2], *turns], [] if home is None else [(home.lat_deg, home.lon_deg)], within_m)


def with_words(error: E, words: str) -> E:
    """The same error, which also says where that leaves the vehicle."""
    return type(error)(error.what, where=error.where, advice=f"{error.advice} {words}".strip())


def _holds(state: VehicleState) -> bool:
    return state.mode in HOLD_MODES.get(state.autopilot, ()) and why_moves(state) is None


def _check_same(firmware: str, profile: str, state: VehicleState, before: PlanRecord | None) -> None:
    """Raises NotAllowedError for a plan of another vehicle."""
    if state.autopilot in FIRMWARES and state.autopilot != firmware:
        what = f"The plan was made for {FIRMWARES[firmware]}, the vehicle flies {FIRMWARES[state.autopilot]}."
        raise NotAllowedError(what, where="vehicle", advice="Choose the vehicle's own profile in Plan.")
    flown = None if before is None else parse_profile(before.profile_toml.encode(), where="the plan on board").name
    if flown is not None and flown != profile:
        what = f'The plan was made for "{profile}", the vehicle flies as "{flown}".'
        raise NotAllowedError(what, where="vehicle", advice="Choose the profile of this flight in Plan.")
