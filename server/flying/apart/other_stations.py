"""Other stations and their vehicles: shown on every page, and held apart from this station's own. No command crosses.

A position counts at the worse end of its age. What is not heard any more is taken to stand anywhere around where it was
seen last, and that is said.
"""

from __future__ import annotations

import asyncio
import logging
import math
import time
from collections.abc import Callable, Coroutine, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from server.door.alarms import Alarms
from server.door.hub import Hub
from server.door.station_files import station_of
from server.errors import StartError, error_doc
from server.flying.apart.commanded_there import own_number
from server.flying.apart.nearness import AHEAD_S, STANDS_M_S, STRAIGHT_S, VEER_SHARE, Flown
from server.flying.apart.others_heard import NODE_SILENT_S, is_vague, name_of, row_of_others, with_missing
from server.flying.apart.others_lines import OthersLines, ahead_of, off_line_m
from server.heard.node_states import Nodes
from server.heard.relay import Relay
from server.schemas import CheckRow, ErrorDoc, OtherStationDoc, OtherVehicleDoc, StationsMessage
from telemetry.bus.bus import Bus
from telemetry.stations.plan_lines import PlanLine
from telemetry.topics.messages import Topic
from telemetry.topics.station_vehicles import FleetLine, FleetVehicle, OtherVehicle, OwnVehicles, StationsStatus
from telemetry.topics.vehicle import VehicleState

log = logging.getLogger("hedgehop.flying")

OLD_S, COUNTS_S = 3.0, 30.0
"""A position that is older is shown as old; and one that is older than the second says no more where its vehicle is."""
UNCOMPARED_S = 10.0
"""Added to the age of what came from a station whose clock was not compared yet."""
FASTEST_M_S = 15.0
"""Of a vehicle that tells no velocity: so fast it may fly, anywhere."""
TELL_EVERY_S, SHOW_EVERY_S, LOOK_FOR_FILE_S = 0.2, 0.5, 2.0
_UNMET = (
    "Other stations are neither seen nor told anything until it can: it is tried again by itself. Own vehicles are not "
    "affected."
)
_STILL_MET = (
    "The stations process of an earlier start still runs, as {name}: others are seen and told by it. Once it ends it "
    "is not started again until the file can be used, which is tried by itself. Own vehicles are not affected."
)
_NODE_SILENT = (
    "The stations node does not answer: other stations are neither seen nor told anything. Own vehicles are not "
    "affected. It is started again by itself."
)


@dataclass(frozen=True, slots=True)
class Meeting:
    """Where this station meets others, and the file that says who it is among them."""

    routers: tuple[str, ...]
    file: Path
    fetched: Path
    """Where recordings of others lie until they are whole."""


class OtherStations:
    """All methods belong to the event loop. Everything that it hears is on the first vehicle's bus."""

    def __init__(
        self,
        meeting: Meeting,
        bus: Bus,
        nodes: Nodes,
        hub: Hub,
        own: Callable[[], Sequence[FleetVehicle]],
        own_lines: Callable[[], Sequence[FleetLine]] = lambda: (),
        *,
        now_mono_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._meeting, self._bus, self._nodes, self._hub, self._own = meeting, bus, nodes, hub, own
        self._own_lines, self._now_mono_s = own_lines, now_mono_s
        self._lines = OthersLines()
        self._name, self._fault = "", ""
        self.status: StationsStatus | None = None

    def loops(self, alarms: Alarms) -> list[Coroutine[Any, Any, None]]:
        relay = Relay(self._bus)
        relay.on(Topic.STATIONS, self.on_status)
        return [*relay.loops(), self.start(alarms), self._tell(), self._show()]

    async def start(self, alarms: Alarms) -> None:
        """Once the station's file can be read: until then its crew flies without other stations, and is told so."""
        meeting = self._meeting
        while True:
            try:
                self._name = await asyncio.to_thread(station_of, meeting.file)
                break
            except StartError as error:
                self._on_fault(error_doc(error), alarms)
            await asyncio.sleep(LOOK_FOR_FILE_S)
        if self._fault:
            log.info("The station's file can be read: this station is %s.", self._name)
        self._fault = ""
        alarms.end("stations")
        await self._nodes.stations(self._name, meeting.routers, meeting.file, meeting.fetched)

    def _on_fault(self, error: ErrorDoc, alarms: Alarms) -> None:
        status = self.status
        is_met = status is not None and self._now_mono_s() - status.t_mono_s <= NODE_SILENT_S
        fault = f"{error.what} {_STILL_MET.format(name=status.station) if status is not None and is_met else _UNMET}"
        if fault != self._fault:
            self._fault = fault
            log.warning("%s (%s) %s", fault, error.where, error.advice)
            self._hub.publish(self.message())
        alarms.begin("stations", error.model_copy(update={"what": fault}))

    def on_status(self, status: StationsStatus) -> None:
        before = self.status
        self.status = status = with_missing(before, status)
        self._lines.on_status(status)
        was = {station.name: station.state for station in before.stations} if before else {}
        for station in status.stations:
            if station.state != was.get(station.name, station.state):
                log.warning("%s", station.text or f"{station.name} is heard again.")
        if {station.name: station.state for station in status.stations} != was:
            self._hub.publish(self.message())

    def flown(self, now_s: float) -> list[Flown]:
        """In the air and seen somewhere: each from where it was at the earliest."""
        return [
            _flown(other, now_s, self._lines.of(other))
            for other in self._vehicles
            if other.it.in_air and other.it.lat_deg is not None
        ]

    def line_of(self, other: OtherVehicle) -> PlanLine | None:
        """What it flies, as it is told and while it is: for the 3D view."""
        return self._lines.of(other)

    def who_commands(self, words: str) -> str | None:
        """What a request means that names a vehicle as ``STATION/NUMBER``: one of this station's by its number.

        None: it names no station. Raises OtherStationError where another station commands it, or nobody known.
        """
        return own_number(words, self._name, self.status, self._now_mono_s())

    def elsewhere(self, number: int) -> str:
        """Which of the others have a vehicle of that number, in words; empty: none."""
        have = [f"{other.station}/{number}" for other in self._vehicles if other.it.number == number]
        return f"{', '.join(have)} is another station's: only that one commands it." if have else ""

    def row(self) -> CheckRow:
        """Of the check before a start."""
        return row_of_others(self.status, self._now_mono_s(), self._fault)

    def message(self) -> StationsMessage:
        now_s, status = self._now_mono_s(), self.status
        if status is None:
            return StationsMessage(
                now_mono_s=now_s,
                old_s=OLD_S,
                station=self._name,
                router="lost",
                text=self._fault or "Other stations are being looked for.",
                stations=[],
                refused=0,
            )
        silent = now_s - status.t_mono_s > NODE_SILENT_S
        return StationsMessage(
            now_mono_s=now_s,
            old_s=OLD_S,
            station=self._name or status.station,
            router="lost" if silent else status.router,
            text=self._fault or (_NODE_SILENT if silent else status.text),
            stations=[
                OtherStationDoc(
                    name=station.name,
                    state="lost" if silent else station.state,
                    silent_s=max(0.0, now_s - station.heard_t_mono_s),
                    round_trip_s=station.round_trip_s,
                    clock_ahead_s=station.clock_ahead_s,
                    text=station.text,
                    vehicles=[_doc(other, now_s) for other in status.vehicles if other.station == station.name],
                )
                for station in status.stations
            ],
            refused=status.refused,
        )

    @property
    def _vehicles(self) -> tuple[OtherVehicle, ...]:
        return () if self.status is None else self.status.vehicles

    async def _tell(self) -> None:
        while True:
            own = OwnVehicles(self._now_mono_s(), tuple(self._own()), tuple(self._own_lines()))
            self._bus.publish(Topic.STATIONS_OWN, own)
            await asyncio.sleep(TELL_EVERY_S)

    async def _show(self) -> None:
        while True:
            self._hub.publish(self.message())
            await asyncio.sleep(SHOW_EVERY_S)


def age_s(other: OtherVehicle, now_s: float) -> float | None:
    """Of its position, at the worse end; None: it has none."""
    if other.it.position_t_mono_s is None:
        return None
    if other.oldest_t_mono_s is None:
        return max(0.0, now_s - other.it.position_t_mono_s) + UNCOMPARED_S
    return max(0.0, now_s - other.oldest_t_mono_s)


def counts(other: OtherVehicle, now_s: float) -> bool:
    """Whether its position still says where it may be."""
    age = age_s(other, now_s)
    return age is not None and age <= COUNTS_S


def _flown(other: OtherVehicle, now_s: float, line: PlanLine | None) -> Flown:
    """It may be where it was told at the earliest of the times that are possible, or at the latest.

    It flies straight on; and, judged as well, along ``line`` while it is on that, freshly seen and its age known.
    From ``OLD_S`` on it may have flown elsewhere; after ``COUNTS_S`` it stands anywhere that it could reach until then.
    """
    it = other.it
    likely_s = it.position_t_mono_s or 0.0
    oldest_s = likely_s - UNCOMPARED_S if other.oldest_t_mono_s is None else other.oldest_t_mono_s
    unsure_s = UNCOMPARED_S if other.oldest_t_mono_s is None else other.unsure_s
    east_m_s, north_m_s, up_m_s = it.v_enu_m_s or (0.0, 0.0, 0.0)
    speed_m_s, age = math.hypot(east_m_s, north_m_s, up_m_s), age_s(other, now_s) or 0.0
    unsure_m = speed_m_s * unsure_s + FASTEST_M_S * (min(max(age, OLD_S), COUNTS_S) - OLD_S)
    if it.v_enu_m_s is None:
        unsure_m = FASTEST_M_S * (COUNTS_S + STRAIGHT_S)
    is_silent = not counts(other, now_s)
    if is_silent:
        ahead_s = AHEAD_S if speed_m_s < STANDS_M_S else STRAIGHT_S
        unsure_m += (1.0 + VEER_SHARE) * speed_m_s * (COUNTS_S + ahead_s)
        oldest_s, east_m_s, north_m_s, up_m_s = now_s, 0.0, 0.0, 0.0
    state = VehicleState(
        0,
        0,
        armed=it.armed,
        position_t_mono_s=oldest_s,
        lat_deg=it.lat_deg,
        lon_deg=it.lon_deg,
        alt_amsl_m=it.alt_amsl_m,
        v_east_m_s=east_m_s,
        v_north_m_s=north_m_s,
        v_down_m_s=-up_m_s,
        horizontal_accuracy_m=it.within_m,
    )
    key = f"{other.station} {it.number}"
    straight = Flown(name_of(other), state, None, unsure_m, is_silent, key)
    if line is None or other.oldest_t_mono_s is None or age > OLD_S:
        return straight
    return replace(straight, told=_on_line(straight, it, line, unsure_s))


def _on_line(straight: Flown, it: FleetVehicle, line: PlanLine, unsure_s: float) -> Flown | None:
    """None: it is not on it, or nothing of it is left. What it is off its line, and twice what that may be wrong by (at
    its place, and ahead), is added to its ball."""
    off_m = off_line_m(line, it)
    left = None if off_m is None or it.line_s is None else ahead_of(line, it.line_s)
    if off_m is None or left is None:
        return None
    ahead, fastest_m_s = left
    unsure_m = off_m + 2.0 * line.error_m + fastest_m_s * unsure_s
    # Heights on the line count above the sea, as if its home stood there.
    return replace(straight, state=replace(straight.state, home_alt_amsl_m=0.0), ahead=ahead, unsure_m=unsure_m)


def _doc(other: OtherVehicle, now_s: float) -> OtherVehicleDoc:
    it, age = other.it, age_s(other, now_s)
    return OtherVehicleDoc(
        number=it.number,
        name=it.name,
        age_s=age if other.oldest_t_mono_s is not None else None,
        is_old=age is None or age > OLD_S,
        lat_deg=it.lat_deg,
        lon_deg=it.lon_deg,
        alt_rel_home_m=it.alt_rel_home_m,
        alt_amsl_m=it.alt_amsl_m,
        alt_surface_m=it.alt_surface_m,
        ground_speed_m_s=None if it.v_enu_m_s is None else math.hypot(*it.v_enu_m_s[:2]),
        in_charge=it.in_charge,
        in_charge_silent=it.in_charge_silent,
        mode=it.mode,
        phase=it.phase,
        armed=it.armed,
        in_air=it.in_air,
        link=it.link,
        battery_share=it.battery_share,
        battery=it.battery,
        plan=it.plan,
        plan_share=it.plan_share,
        text=" ".join(_words(other, age)),
    )


def _words(other: OtherVehicle, age: float | None) -> Iterator[str]:
    it = other.it
    if it.in_air and is_vague(other):
        yield f"It is in the air, and where is known only to {it.within_m:.0f} m: it is not held apart from yours."
    elif it.in_air and age is None:
        yield "It is in the air, and where is not known: it is not held apart from yours."
    elif it.in_air and age is not None and age > COUNTS_S:
        yield (
            "It is not seen any more, and may be anywhere: yours are held apart from where it could fly in "
            f"{COUNTS_S:.0f} s. Call its pilot."
        )
    if it.link == "lost":
        yield f"{other.station} hears nothing of it any more."
    if it.alarm:
        yield it.alarm
