"""Desks of a vehicle in flight over the demo's model: what they are told, what they tell, nobody at the vehicle."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from mapping.geometry.frames import moved_deg
from server.flying.apart.nearness import Flown
from server.flying.in_flight import home_desk
from server.flying.in_flight.home_desk import HomeDesk
from server.flying.in_flight.way_desk import WayDesk
from server.heard.channel import Channel
from server.obstacles.obstacle_watch import Watch
from server.schemas import FlyWayBody, GuidedState, HomeAskedDoc, HomeBody, HomeState, PlaceDoc, WayBody, WayDoc
from server.work.jobs import Lane
from telemetry.flight.home_watch import home_of
from telemetry.topics.messages import Topic, VehicleText
from telemetry.topics.vehicle import VehicleState
from tests.server.fakes import Told
from tests.server.flying_desk_bench import ME, Made, Vehicle

FAR = {"east_m": 0.0, "north_m": 80.0}
LONG_S = 600.0
"""Positions are of now for so long: a busy machine judges slowly."""


class HomeBench:
    """A vehicle that took off at the plan's home and hovers 30 m above it."""

    def __init__(self, made: Made, lane: Lane, *, up_m: float = 30.0, bus: Any = None) -> None:
        self.made, self.vehicle, self.document = made, Vehicle(), made.document
        self.told: list[HomeState] = []
        me: Any = self
        self.live = Channel("live", Told())
        stands, now_s = made.standing(), time.monotonic() + LONG_S
        flies = {"armed": True, "landed": "in_air", "alt_rel_home_m": up_m} if up_m else {}
        self.live.state = replace(stands, position_t_mono_s=now_s, gnss_t_mono_s=now_s, **flies)
        self.live.track.states = [stands, self.live.state]
        self.watch = Watch("live", Told())
        for mirror in self.watch.mirrors.values():
            mirror.on_flight(flies=up_m > 0.0)
        ways = WayDesk(me.vehicle, self.live, me, made.library, lane, self.watch, Told())
        self.sets = 0
        self.said: list[str] = []
        on: Any = bus or SimpleNamespace(publish=self.hears)
        self.desk = HomeDesk(me.vehicle, self.live, ways, lane, me, lambda: ME, self.home_set, on)

    def hears(self, topic: Topic, text: VehicleText) -> None:
        assert (topic, text.severity) == (Topic.TEXT, home_desk.CRITICAL)
        self.said.append(text.text)

    def home_set(self) -> None:
        self.sets += 1

    def publish(self, message: Any) -> None:
        self.told.append(message.home)

    @property
    def state(self) -> VehicleState:
        assert self.live.state is not None
        return self.live.state

    def moves(self, east_m: float, up_m: float = 0.0) -> None:
        """Home, by whomever."""
        home = home_of(self.state)
        assert home is not None
        lat_deg, lon_deg = moved_deg((home.lat_deg, home.lon_deg), east_m, 0.0)
        told = {"home_lat_deg": lat_deg, "home_lon_deg": lon_deg, "home_alt_amsl_m": home.alt_amsl_m + up_m}
        self.live.state = replace(self.state, **told)
        self.desk.on_state(self.state)

    async def asked(self, east_m: float | None = None) -> HomeAskedDoc:
        place = None
        if east_m is not None:
            there = self.made.standing(east_m=east_m)
            place = {"lat_deg": there.lat_deg, "lon_deg": there.lon_deg}
        doc = (await self.desk.judge(ME, HomeBody.model_validate({"place": place}))).asked
        assert doc is not None
        return doc


async def shows(there: Callable[[], object]) -> None:
    async with asyncio.timeout(60.0):
        while not there():
            await asyncio.sleep(0.02)


class WayBench:
    """A desk over the demo's model, and a vehicle that hovers over the plan's home."""

    def __init__(self, made: Made, lane: Lane, *, up_m: float = 30.0) -> None:
        self.made, self.vehicle, self.document = made, Vehicle(), made.document
        self.told: list[GuidedState] = []
        self.others: list[Flown] = []
        me: Any = self
        self.live = Channel("live", Told())
        self.hovers(made.standing(), up_m)
        self.watch = Watch("live", Told())
        self.desk = WayDesk(me.vehicle, self.live, me, made.library, lane, self.watch, me)

    def publish(self, message: Any) -> None:
        self.told.append(message.guided)

    def hovers(self, standing: VehicleState, up_m: float) -> None:
        now_s = time.monotonic() + LONG_S
        flies = {"armed": True, "landed": "in_air", "alt_rel_home_m": up_m} if up_m else {}
        self.live.state = replace(standing, position_t_mono_s=now_s, gnss_t_mono_s=now_s, **flies)
        self.live.track.states = [standing, self.live.state]

    async def fly(self, body: FlyWayBody) -> None:
        await self.desk.fly(ME, body, lambda: self.others)

    def beside(self, east_m: float, north_m: float) -> PlaceDoc:
        there = self.made.standing(east_m=east_m, north_m=north_m)
        assert there.lat_deg is not None
        assert there.lon_deg is not None
        return PlaceDoc(lat_deg=there.lat_deg, lon_deg=there.lon_deg)

    async def judged(self, **body: Any) -> WayDoc:
        way = (await self.desk.judge(ME, WayBody.model_validate(body), lambda: self.others)).way
        assert way is not None
        return way
