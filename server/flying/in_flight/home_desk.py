"""Home: judged where it is asked for, set by order, and the vehicle's own return judged anew once home was moved.

The return is judged by a worker, one judgement at a time; what has changed meanwhile is judged next.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

from mapping.errors import DescribedError
from mapping.geometry.frames import apart_m
from server.errors import ConflictError, NotFoundError, reported
from server.flying.in_flight.home_asked import AskedHome, looked_along
from server.flying.in_flight.home_task import HomeJudged, Led, judge_home, judge_return
from server.flying.in_flight.way_desk import WayDesk
from server.flying.in_flight.way_task import WayAsked
from server.heard.channel import Channel
from server.schemas import (
    HomeAskedDoc,
    HomeBody,
    HomeMessage,
    HomeState,
    Pages,
    ReasonDoc,
    ReturnDoc,
    SetHomeBody,
    WayBody,
)
from server.work.jobs import Lane
from telemetry.bus.bus import Bus
from telemetry.bus.link_client import LinkClient
from telemetry.flight.home_watch import HomePlace, home_of, home_of_takeoff, is_there
from telemetry.mavlink.believing import is_in_the_air
from telemetry.topics.messages import Topic, VehicleText
from telemetry.topics.requests import Operator, SetHome
from telemetry.topics.vehicle import VehicleState

_log = logging.getLogger(__name__)
ANYWHERE = WayBody(action="home")
"""Gathers what every way is judged by."""
FLOWN_M, OLD_S, OLDEST_S = 10.0, 15.0, 60.0
"""A return is judged again from so far away, and after so long wherever it is, while home lies elsewhere than at the
take-off: sensors see more meanwhile."""
NEW_MAP_S, PAUSE_SHARE = 5.0, 3.0
"""A return is judged again so soon where sensors have seen other things, and once so many times as long as a judgement
takes have passed: what looks all the time keeps no processor busy all the time."""
CRITICAL = 2
"""MAV_SEVERITY"""
NO_MORE = "Ground station: the vehicle's return was certified, and is not any more"
"""It stands among what the vehicle says."""
HOME_MOVED_AGAIN = "Home has moved again."
JUDGED_MEANWHILE = "Another home was judged meanwhile."
LOOK_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class _Judged:
    """Of the return: for which home, from where."""

    home: HomePlace
    at_deg: tuple[float, float]
    doc: ReturnDoc
    maps: tuple[int, ...]
    """Revision of the maps, before they were looked into."""
    took_s: float
    """By the worker, without what was waited for."""


class HomeDesk:
    """All methods belong to the event loop."""

    def __init__(
        self,
        link: LinkClient,
        live: Channel,
        ways: WayDesk,
        lane: Lane,
        pages: Pages,
        server: Callable[[], Operator],
        home_set: Callable[[], None],
        bus: Bus,
    ) -> None:
        """``ways``: gathers what is judged by; ``server``: in whose name it is asked for without a pilot; ``home_set``:
        home was, or may have been, set by order; ``bus``: what is said there is recorded, and told to all pages."""
        self._link, self._live, self._ways, self._lane, self._pages = link, live, ways, lane, pages
        self._server, self._home_set, self._bus = server, home_set, bus
        self._asked: AskedHome | None = None
        self._is_judging = self._is_judging_return = False
        self._judged: _Judged | None = None
        self._holds = False
        """The return was certified when it was last judged."""
        self._heard: HomePlace | None = None
        """Home that was heard first in this flight."""
        self._adopted: str | None = None
        self._gathered: WayAsked | None = None
        """What was read from the vehicle while home stood where it does: it is not read again for each judgement."""
        self._took_s = 0.0
        self._lacks_maps = False
        """The return is unknown because parts of a map are missing."""
        self._told = HomeState()
        self._moved = asyncio.Event()

    @property
    def state(self) -> HomeState:
        return HomeState(
            asked=None if self._asked is None else self._asked.doc,
            is_judging=self._is_judging,
            ret=None if self._judged is None else self._judged.doc,
            is_judging_return=self._is_judging_return,
        )

    async def judge(self, operator: Operator, body: HomeBody) -> HomeState:
        """Nothing is set. Raises what the vehicle said, NotAllowedError, NotReadyError."""
        if self._is_judging:
            raise ConflictError("Another home is being judged.", advice="Wait until it is done.")
        self._asked, self._is_judging, vehicle = None, True, self._adopted
        self._tell()
        try:
            asked = await self._ways.asked(operator, ANYWHERE)
            place = None if body.place is None else (body.place.lat_deg, body.place.lon_deg)
            judged: HomeJudged = await self._lane.call(judge_home, asked, place)
            home_deg = (judged.home.lat_deg, judged.home.lon_deg)
            ret = None if judged.ret is None else await self._noted(judged.ret, judged.led, home_deg, asked)
            if vehicle != self._adopted:
                raise ConflictError("Another vehicle was adopted meanwhile.", advice="Ask for home again.")
            doc = self._doc(replace(judged, ret=ret), asked.state, is_here=place is None)
            self._asked = AskedHome(doc, time.monotonic(), asked.state, asked.maps, judged.led)
        finally:
            self._is_judging = False
            self._tell()
        return self.state

    async def set(self, operator: Operator, body: SetHomeBody) -> None:
        """Raises NotFoundError, CheckNeededError, NotReadyError where parts of a map are missing, and what the vehicle
        said."""
        asked = self._asked
        if asked is None or asked.doc.id != body.id:
            raise NotFoundError(JUDGED_MEANWHILE, advice="Ask for it again.")
        asked.check_still(self._live.state)
        await asked.check_seen(self._live.state, self._ways)
        asked.check_still(self._live.state)
        if self._asked is not asked:
            raise NotFoundError(JUDGED_MEANWHILE, advice="Ask for it again.")
        doc = asked.doc
        try:
            await self._link.call(SetHome(operator, doc.lat_deg, doc.lon_deg, doc.alt_amsl_m))
        finally:
            self._home_set()
        if self._asked is asked:
            self._asked = None
        self._tell()

    def drop(self) -> HomeState:
        """What was judged is put away."""
        self._asked = None
        self._tell()
        return self.state

    def on_state(self, state: VehicleState) -> None:
        """Home that has moved in flight is judged at once."""
        home = home_of(state)
        if not (state.armed and is_in_the_air(state)) or home is None:
            if not state.armed and (self._heard or self._gathered) is not None:
                self._judged = self._heard = self._gathered = None
                self._holds = False
                self._tell()
            return
        self._heard = self._heard or home_of_takeoff(self._live.track.states) or home
        if self._judged is not None:
            if not is_there(home, self._judged.home):
                self._out_of_date(home, HOME_MOVED_AGAIN)
            return
        if not is_there(home, self._heard):
            self._moved.set()

    def on_link(self, vehicle: str | None) -> None:
        """Id of the adopted one: what was judged for another is not this one's."""
        if vehicle != self._adopted:
            self._adopted = vehicle
            self.forget()

    def on_changed(self) -> None:
        """Parameters, fence, rally points or mission of the vehicle are others, or may be: they are read anew, and what
        was judged by those before counts no more."""
        self._gathered = None
        if self._judged is not None:
            self._out_of_date(self._judged.home, "What the vehicle holds was changed.")
        elif self._is_judging_return:
            self._moved.set()

    def forget(self) -> None:
        """Another vehicle, or none."""
        self._asked = self._judged = self._heard = self._gathered = None
        self._holds = False
        self._moved.clear()
        self._tell()

    async def run(self) -> None:
        """Judges the return whenever home has moved, and again while the vehicle flies on or hovers."""
        while True:
            try:
                async with asyncio.timeout(LOOK_EVERY_S):
                    await self._moved.wait()
            except TimeoutError:
                if not (self._is_map_lost_or_back() or self._is_due() or await self._is_seen_otherwise()):
                    continue
            self._moved.clear()
            await self._judge_return()

    def _out_of_date(self, home: HomePlace, words: str) -> None:
        """What was judged is not shown as it was while it is judged anew."""
        assert self._judged is not None
        self._judged = replace(self._judged, home=home, doc=_unknown(words, "It is being judged anew."))
        self._gathered = None
        self._moved.set()
        self._tell()

    def _is_due(self) -> bool:
        state, judged = self._live.state, self._judged
        if judged is None or state is None or state.lat_deg is None or state.lon_deg is None or not state.armed:
            return False
        if time.monotonic() - judged.doc.judged_mono_s <= OLD_S:
            return False
        if time.monotonic() - judged.doc.judged_mono_s > OLDEST_S:
            return True
        return judged.doc.state == "unknown" or apart_m(judged.at_deg, (state.lat_deg, state.lon_deg)) > FLOWN_M

    def _is_map_lost_or_back(self) -> bool:
        """While parts of a map are missing the return is shown as unknown; it is judged once they are there."""
        judged, is_whole = self._judged, self._ways.are_maps_whole
        if judged is None or is_whole is not self._lacks_maps:
            return False
        self._lacks_maps = not is_whole
        if self._lacks_maps:
            doc = _unknown("Parts of a map are missing: what stands in the way is not known.", "They are waited for.")
            self._judged = replace(judged, doc=doc)
            self._tell()
        return True

    async def _is_seen_otherwise(self) -> bool:
        """Whether sensors have seen other things since. Heavy looks are made in threads, and seldom."""
        judged, asked, maps = self._judged, self._gathered, self._ways.maps_revision
        if judged is None or asked is None or maps == judged.maps:
            return False
        if time.monotonic() - judged.doc.judged_mono_s < max(NEW_MAP_S, PAUSE_SHARE * judged.took_s):
            return False
        try:
            if await self._ways.has_seen_other(asked):
                return True
        except Exception as error:
            reported(error, _log, "Comparing what was seen")
            return True
        if self._judged is judged:
            self._judged = replace(judged, maps=maps)
        return False

    async def _judge_return(self) -> None:
        state = self._live.state
        home = None if state is None else home_of(state)
        if state is None or home is None:
            return
        self._is_judging_return, vehicle = True, self._adopted
        maps = self._ways.maps_revision
        self._tell()
        try:
            doc = await self._judged_return()
        except DescribedError as error:
            doc = _unknown(error.what, error.advice)
        except Exception as error:
            reported(error, _log, "Judging the vehicle's return")
            doc = _unknown(
                "The return could not be judged: the server's own error is in its log.", "Do not rely on it."
            )
        finally:
            self._is_judging_return = False
        now = self._live.state
        if now is not None and now.armed and vehicle == self._adopted:
            at_deg = (state.lat_deg or 0.0, state.lon_deg or 0.0)
            self._judged = _Judged(home, at_deg, doc, maps, self._took_s)
            self._lacks_maps &= doc.state == "unknown"
            self._say_if_lost(doc)
            if not is_there(here := home_of(now), home):
                self._out_of_date(here or home, HOME_MOVED_AGAIN)
        self._tell()

    def _say_if_lost(self, doc: ReturnDoc) -> None:
        held, self._holds = self._holds, doc.state == "certified"
        if not held or self._holds:
            return
        first = doc.reasons[0] if doc.reasons else None
        why = "." if first is None else f": {first.text} {first.mend}".rstrip()
        instead = " A way home is certified: Guided flight, Home." if doc.instead else ""
        self._bus.publish(Topic.TEXT, VehicleText(time.time(), CRITICAL, f"{NO_MORE}{why}{instead}"))

    async def _judged_return(self) -> ReturnDoc:
        asked = self._gathered or await self._ways.asked(self._server(), ANYWHERE)
        self._gathered = asked = await self._ways.renewed(asked)
        began_s = time.monotonic()
        doc, led = await self._lane.call(judge_return, asked)
        if (home := home_of(asked.state)) is not None:
            doc = await self._noted(doc, led, (home.lat_deg, home.lon_deg), asked)
        self._took_s = time.monotonic() - began_s
        if self._gathered is asked:
            return doc
        return _unknown("What the vehicle holds was changed meanwhile.", "It is being judged anew.")

    async def _noted(self, ret: ReturnDoc, led: Led, home_deg: tuple[float, float], asked: WayAsked) -> ReturnDoc:
        """With what does not count, and is to be said."""
        line_deg = looked_along(ret, led, home_deg, (asked.state,))
        notes = await self._ways.seen_before(asked.maps, line_deg, led.required_m) if line_deg else []
        return ret.model_copy(update={"notes": notes})

    def _doc(self, judged: HomeJudged, state: VehicleState, *, is_here: bool) -> HomeAskedDoc:
        home, now = judged.home, home_of(state)
        moves_m = 0.0 if now is None else apart_m((now.lat_deg, now.lon_deg), (home.lat_deg, home.lon_deg))
        rises_m = 0.0 if now is None else home.alt_amsl_m - now.alt_amsl_m
        return HomeAskedDoc(
            id=secrets.token_hex(8),
            is_here=is_here,
            lat_deg=home.lat_deg,
            lon_deg=home.lon_deg,
            alt_amsl_m=home.alt_amsl_m,
            moves_m=moves_m,
            rises_m=rises_m,
            changes=_changes(rises_m, in_air=judged.ret is not None, has_mission=self._live.flight.way == "auto"),
            ret=judged.ret,
        )

    def _tell(self) -> None:
        if (state := self.state) != self._told:
            self._told = state
            self._pages.publish(HomeMessage(home=state))


def _unknown(what: str, advice: str) -> ReturnDoc:
    reason = ReasonDoc(code="home", text=what, mend=advice)
    return ReturnDoc(state="unknown", reasons=[reason], judged_mono_s=time.monotonic())


def _changes(rises_m: float, *, in_air: bool, has_mission: bool) -> list[str]:
    """What a pilot must know before it is set."""
    if not in_air:
        return ["It stays there when the vehicle arms, until the vehicle is switched off."]
    said = ["Return leads there, and every height counts from there."]
    if has_mission:
        shift = f"{abs(rises_m):.1f} m {'higher' if rises_m > 0 else 'lower'} than certified"
        said.append(f"The mission on board would be {shift}: it goes on only once its rest is certified from here.")
    return said
