"""Guided flight: a way is asked for, judged from where the vehicle is, shown to all pages, and flown if it may be."""

from __future__ import annotations

import asyncio
import time
from dataclasses import replace

from server.errors import CheckNeededError, ConflictError, NotCertifiedError, NotFoundError, NotReadyError
from server.flying.apart.way_apart import Apart, Others, way_apart
from server.flying.in_flight.judged_way import (
    InHand,
    asked_again,
    flown_places,
    is_over,
    is_same_way,
    looked_along,
    required_m,
    to_its_end,
    way_doc,
)
from server.flying.in_flight.way_task import WayAsked, WayJudged, judge_way
from server.heard.channel import Channel, ShownWay
from server.heard.led_way import LedWay
from server.library import Library
from server.obstacles.coming_down_task import SHADOW_M
from server.obstacles.obstacle_watch import Watch
from server.obstacles.surroundings import (
    are_maps_whole,
    is_more_seen_near,
    is_same_seen,
    maps_revision,
    seen_before_near,
    seen_maps,
)
from server.scene.mirror import Voxels
from server.schemas import (
    FlyWayBody,
    GuidedMessage,
    GuidedState,
    Pages,
    TerrainDoc,
    WayBody,
    WaySpeedBody,
)
from server.schemas.flight_docs import CHECK_FRESH_S
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus.link_client import LinkClient
from telemetry.errors import BusError, NoVehicleError
from telemetry.flight.certified_way import way_request
from telemetry.flight.guided.beginning import why_moves
from telemetry.flight.home_watch import home_of, home_of_takeoff, is_there
from telemetry.flight.preflight.parameters import NAMES
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.messages import FlightStatus
from telemetry.topics.onboard_lists import PlacesOnboard
from telemetry.topics.requests import DownloadPlaces, Operator, ReadParameters, SetSpeed
from telemetry.topics.vehicle import VehicleState

SEEN_WITHIN_S = 1.0
"""A way that is to be flown now waits no longer for a map that is just being told."""
SEEN_AGO_S, LOOKS = 10.0, 3
"""What a way is judged by once more when it is ordered is no older when it is flown; so often it is judged at most."""
TOLD_WITHIN_S = 120.0
"""Of a way that was ordered, and whose answer was lost, the vehicle has told by then if it flies it."""
NOWHERE = "Nothing is judged any more, or another way was judged meanwhile."


class WayDesk:
    """All methods belong to the event loop."""

    def __init__(
        self,
        link: LinkClient,
        live: Channel,
        workspace: Workspace,
        library: Library,
        lane: Lane,
        watch: Watch,
        pages: Pages,
    ) -> None:
        self._link, self._live, self._workspace, self._library = link, live, workspace, library
        self._lane, self._watch, self._pages = lane, watch, pages
        self._in_hand: InHand | None = None
        self._is_judging = self._is_ordering = False
        self._adopted: str | None = None

    @property
    def state(self) -> GuidedState:
        return GuidedState(way=None if self._in_hand is None else self._in_hand.doc, is_judging=self._is_judging)

    async def judge(self, operator: Operator, body: WayBody, others: Others) -> GuidedState:
        """Nothing moves. Raises what the vehicle said, NotAllowedError, NotReadyError, MissionError, ParameterError."""
        if self._is_judging or self._is_ordering:
            does = "judged" if self._is_judging else "ordered"
            raise ConflictError(f"Another way is being {does}.", advice="Wait until it is done.")
        before = self._in_hand
        flown = before if before is not None and before.doc.flies else None
        if flown is not None and self._live.flight.phase != "paused":
            raise ConflictError("A way is being flown.", advice="Hold first, then ask for the next way.")
        self._check_stands(body)
        terrain = self._terrain()
        # What is paused can be gone on with, until another way is there.
        self._in_hand, self._is_judging, vehicle = flown, True, self._adopted
        self._tell()
        try:
            asked = await self.asked(operator, body)
            judged: WayJudged = await self._lane.call(judge_way, asked)
            in_hand = await self._taken(asked, judged, terrain.name, others)
            self._check_still(vehicle, flown)
            self._in_hand = in_hand
        finally:
            self._is_judging = False
            self._tell()
        return self.state

    async def _taken(self, asked: WayAsked, judged: WayJudged, over: str, others: Others) -> InHand:
        home = home_of(asked.state)
        notes = await self.seen_before(asked.maps, looked_along(judged, home), required_m(judged))
        apart = await self._apart(judged, others)
        return InHand(way_doc(judged, asked.body, over, notes, apart), judged, time.monotonic(), home, asked, apart)

    async def fly(self, operator: Operator, body: FlyWayBody, others: Others) -> None:
        """Raises NotFoundError, NotCertifiedError, CheckNeededError where home was moved, more was seen, or another
        vehicle came into its way since, and NotAllowedError where the vehicle is elsewhere by now."""
        if self._is_ordering:
            raise ConflictError("A way is being ordered.", advice="Wait until it is flown or refused.")
        self._is_ordering = True
        try:
            await self._order(operator, body, others)
        finally:
            self._is_ordering = False

    async def _order(self, operator: Operator, body: FlyWayBody, others: Others) -> None:
        in_hand = self._in_hand
        if in_hand is None or in_hand.doc.id != body.id or in_hand.doc.flies:
            raise NotFoundError(NOWHERE, advice="Ask for the way again.")
        doc = in_hand.doc
        if time.monotonic() - in_hand.judged_mono_s > CHECK_FRESH_S:
            what = f"The way was judged more than {CHECK_FRESH_S:.0f} s ago: more may have been seen since."
            raise CheckNeededError(what, advice="Ask for the way again.")
        if doc.problem in ("way", "others") or (doc.problem == "return" and not body.accept_return):
            first = doc.reasons[0] if doc.reasons else None
            what = "Another vehicle is in the way" if doc.problem == "others" else "The way is not certified"
            what += "." if first is None else f": {first.text}"
            raise NotCertifiedError(what, advice="" if first is None else first.mend)
        shown = in_hand
        in_hand = await self._by_what_is_seen_now(shown, others)
        self._check_home(shown)
        judged, since_utc_s = in_hand.judged, time.time()
        speed_m_s, most_m_s = judged.speed_m_s, judged.most_m_s
        request = way_request(operator, judged.way, judged.wish, in_hand.home, speed_m_s=speed_m_s, most_m_s=most_m_s)
        before = self._live.led
        # Before others are looked at: of two that are ordered at the same moment at least one sees the other's.
        self._live.led = LedWay(*to_its_end(judged), judged.speed_m_s, since_utc_s)
        try:
            await self._check_apart(in_hand, others)
            await self._link.call(request)
        except (BusError, asyncio.CancelledError):
            raise  # it may be done all the same
        except BaseException:
            self._live.led = before
            raise
        if self._in_hand is in_hand:
            doc = in_hand.doc.model_copy(update={"flies": True})
            self._in_hand = replace(in_hand, doc=doc, flies_since_utc_s=since_utc_s)
            self._tell()

    async def set_speed(self, operator: Operator, body: WaySpeedBody) -> None:
        """Raises NotAllowedError where no way is flown, or it is certified for less."""
        await self._link.call(SetSpeed(operator, body.speed_m_s))
        if self._live.led is not None:
            self._live.led.at_speed(body.speed_m_s)
        if (in_hand := self._in_hand) is not None and in_hand.doc.flies:
            doc = in_hand.doc.model_copy(update={"speed_m_s": body.speed_m_s})
            self._in_hand = replace(in_hand, doc=doc)
            self._tell()

    def drop(self) -> GuidedState:
        """What was judged is put away; what is flown or being ordered goes on, and stays on show."""
        if self._in_hand is not None and not self._in_hand.doc.flies and not self._is_ordering:
            self._in_hand = None
            self._tell()
        return self.state

    def on_flight(self, flight: FlightStatus) -> None:
        """What is over is put away."""
        self._end_led(flight)
        since_utc_s = None if self._in_hand is None else self._in_hand.flies_since_utc_s
        if since_utc_s is None or flight.since_utc_s is None or flight.since_utc_s < since_utc_s:
            return
        if is_over(flight):
            self._in_hand = None
            self._tell()

    def _end_led(self, flight: FlightStatus) -> None:
        """A way that is held stays where it may fly, whatever was judged since: it may be gone on with."""
        led = self._live.led
        if led is None:
            return
        if flight.since_utc_s is None or flight.since_utc_s < led.since_utc_s:
            if time.time() - led.since_utc_s > TOLD_WITHIN_S:
                self._live.led = None  # it was never begun
            return
        led.is_new = False
        if is_over(flight):
            self._live.led = None

    def on_link(self, vehicle: str | None) -> None:
        """Id of the adopted one. What was judged for another is not this one's; what is flown goes on where the vehicle
        is heard from elsewhere."""
        if vehicle == self._adopted:
            return
        self._adopted, self._live.led = vehicle, None if vehicle is None else self._live.led
        if self._in_hand is not None and (vehicle is None or not self._in_hand.doc.flies):
            self._in_hand = None
            self._tell()

    async def asked(self, operator: Operator, body: WayBody) -> WayAsked:
        """All that a way is judged by now. Raises what the vehicle said, NoVehicleError, NotReadyError."""
        terrain, state = self._terrain(), self._vehicle()
        parameters = await self._link.call(ReadParameters(NAMES["px4" if state.autopilot == "px4" else "ardupilot"]))
        fence = await self._link.call(DownloadPlaces(operator, "fence"))
        rally = await self._link.call(DownloadPlaces(operator, "rally"))
        maps = await seen_maps(self._watch)
        return WayAsked(
            body,
            self._library.terrain_dir(terrain.id),
            self._workspace.document,
            self._vehicle(),
            time.monotonic(),
            parameters,
            PlacesOnboard(fence, rally),
            maps,
            flown_places(self._live.track.states),
            home_of_takeoff(self._live.track.states),
        )

    async def renewed(self, asked: WayAsked) -> WayAsked:
        """What is seen and heard by now; what the vehicle holds was read for ``asked``."""
        return replace(
            asked,
            terrain=self._library.terrain_dir(self._terrain().id),
            document=self._workspace.document,
            maps=await seen_maps(self._watch),
            state=self._vehicle(),
            now_mono_s=time.monotonic(),
            flown=flown_places(self._live.track.states),
            took_off=home_of_takeoff(self._live.track.states),
        )

    @property
    def maps_revision(self) -> tuple[int, ...]:
        """Another one: what sensors have seen may be another."""
        return maps_revision(self._watch)

    @property
    def are_maps_whole(self) -> bool:
        """Whether all that sensors have seen is known here."""
        return are_maps_whole(self._watch)

    async def has_seen_other(self, asked: WayAsked) -> bool:
        """Whether sensors have seen other things by now than ``asked`` is judged by."""
        seen = await seen_maps(self._watch)
        return not await asyncio.to_thread(is_same_seen, asked.maps, seen)

    async def has_seen_more_near(
        self,
        maps: tuple[Voxels, ...],
        line_deg: list[tuple[float, float]],
        clearance_m: float,
        *,
        with_shadow: bool = True,
    ) -> bool:
        """Whether sensors have seen more by now than ``maps``, so near to a line (lat_deg, lon_deg) that keeps such a
        clearance that it may matter. Raises NotReadyError where nobody knows."""
        seen = await seen_maps(self._watch, SEEN_WITHIN_S)
        # Of a take-off who walks about farther away is no matter: nothing is flown along yet that could be behind him.
        near_m = clearance_m + (SHADOW_M if with_shadow and is_in_the_air(self._vehicle()) else 0.0)
        return await asyncio.to_thread(is_more_seen_near, maps, seen, line_deg, near_m)

    async def seen_before(
        self, maps: tuple[Voxels, ...], line_deg: list[tuple[float, float]], clearance_m: float
    ) -> list[str]:
        """What does not count, and is to be said of a line (lat_deg, lon_deg) that keeps such a clearance."""
        words = await seen_before_near(self._watch, maps, line_deg, clearance_m + SHADOW_M)
        return [] if words is None else [words]

    # How

    async def _by_what_is_seen_now(self, in_hand: InHand, others: Others) -> InHand:
        """Judged anew where sensors have seen more near the way, or near a return from anywhere on it that is certified
        with it, since it was judged: wrong matches of a camera come and go with each frame, and do not matter where the
        way is as it was. Raises CheckNeededError where it is not, with what it is now in hand; NotReadyError where
        nobody knows what is seen."""
        if not await self._sees_more(in_hand):
            return in_hand
        self._is_judging = True
        self._tell()
        try:
            for _ in range(LOOKS):
                begun_mono_s, asked = time.monotonic(), await self._once_more(in_hand.asked)
                judged: WayJudged = await self._lane.call(judge_way, asked)
                now = await self._taken(asked, judged, in_hand.doc.terrain_name, others)
                self._check_in_hand(in_hand)
                if not is_same_way(judged, in_hand.judged) or not now.apart.noted <= in_hand.apart.noted:
                    self._in_hand = now
                    what = "Sensors have seen more near the way since it was judged: now it is as it is shown."
                    raise CheckNeededError(what, advice="Look at it again before it is flown.")
                sees_more = await self._sees_more(now, in_hand, with_shadow=False)
                if not sees_more and time.monotonic() - begun_mono_s <= SEEN_AGO_S:
                    self._in_hand = replace(
                        now, doc=now.doc.model_copy(update={"id": in_hand.doc.id}), judged_mono_s=in_hand.judged_mono_s
                    )
                    return self._in_hand
        finally:
            self._is_judging = False
            self._tell()
        what = f"Sensors see more close to the way each time that it is judged, {LOOKS} times by now."
        raise CheckNeededError(what, advice="Look what is there, and ask for the way again.")

    async def _once_more(self, asked: WayAsked) -> WayAsked:
        """By what is seen now, all else as it was shown; from the same place, as long as it only wanders there."""
        return asked_again(asked, await self.renewed(asked))

    async def _sees_more(self, judged: InHand, in_hand: InHand | None = None, *, with_shadow: bool = True) -> bool:
        """Than ``judged`` was judged by. Raises NotReadyError where nobody knows, NotFoundError where what is in hand
        was put away."""
        line_deg = looked_along(judged.judged, judged.home)
        sees_more = await self.has_seen_more_near(
            judged.asked.maps, line_deg, required_m(judged.judged), with_shadow=with_shadow
        )
        self._check_in_hand(in_hand or judged)
        return sees_more

    def _check_in_hand(self, in_hand: InHand) -> None:
        """Raises NotFoundError where it was put away meanwhile."""
        if self._in_hand is not in_hand:
            raise NotFoundError(NOWHERE, advice="Ask for the way again.")

    async def _apart(self, judged: WayJudged, others: Others) -> Apart:
        """By where all are now."""
        places, t_s = to_its_end(judged)
        return await asyncio.to_thread(way_apart, self._vehicle(), places, t_s, tuple(others()), time.monotonic())

    async def _check_apart(self, in_hand: InHand, others: Others) -> None:
        """Raises CheckNeededError where it would lead near another vehicle by now of which the card says nothing."""
        apart = await self._apart(in_hand.judged, others)
        self._check_in_hand(in_hand)
        if apart.reasons:
            raise CheckNeededError(apart.reasons[0].text, advice=apart.reasons[0].mend)
        if new := apart.noted - in_hand.apart.noted:
            names = " and ".join(sorted({name for name, _ in new}))
            what = f"Since the way was judged {names} came to where it leads, or may have."
            raise CheckNeededError(what, advice="Ask for the way again.")

    def _check_home(self, in_hand: InHand) -> None:
        """Raises CheckNeededError where home was moved since: the way's places would be elsewhere. A vehicle on the
        ground takes its home when it arms, which is looked at then."""
        state, home = self._vehicle(), in_hand.home
        if not (state.armed and is_in_the_air(state)) or (home is not None and is_there(home_of(state), home)):
            return
        self._in_hand = None
        self._tell()
        raise CheckNeededError("Home was moved since the way was judged.", advice="Ask for the way again.")

    def _check_still(self, vehicle: str | None, flown: InHand | None) -> None:
        """Raises ConflictError for a way that nobody can fly any more, once it is judged."""
        if vehicle != self._adopted:
            raise ConflictError("Another vehicle was adopted meanwhile.", advice="Ask for the way again.")
        if flown is not None and self._in_hand is flown and self._live.flight.phase != "paused":
            raise ConflictError("The way before is flown again.", advice="Hold first, then ask for the next way.")

    def _check_stands(self, body: WayBody) -> None:
        if body.action != "take_off" and (refusal := why_moves(self._vehicle())) is not None:
            raise refusal

    def _vehicle(self) -> VehicleState:
        if self._live.state is None:
            raise NoVehicleError("No vehicle is connected.", advice="Connect one first.")
        return self._live.state

    def _terrain(self) -> TerrainDoc:
        """The open plan's."""
        terrain_id = self._workspace.document.terrain_id
        terrain = next((each for each in self._library.terrains() if each.id == terrain_id), None)
        if terrain is None:
            raise NotReadyError(
                "No surface model is open: no way can be certified.", advice="Open one in Plan, then ask again."
            )
        return terrain

    def _tell(self) -> None:
        in_hand = self._in_hand
        self._live.way = None if in_hand is None else ShownWay(in_hand.judged.way.places, in_hand.doc.problem is None)
        self._pages.publish(GuidedMessage(guided=self.state))
