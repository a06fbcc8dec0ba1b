"""The station: the vehicles that it flies, and what there is once for all of them: recordings, review, the 3D view."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Coroutine, Sequence
from typing import Any

from server.door.alarms import Alarms
from server.door.hub import Hub
from server.errors import BadRequestError, NotFoundError, NotReadyError
from server.flying.apart.airspace import Airspace
from server.flying.apart.nearness import Flown, Nearness, flown_of
from server.flying.apart.other_stations import Meeting, OtherStations
from server.flying.apart.other_vehicles import OtherVehicles
from server.flying.apart.own_lines import OwnLines
from server.flying.apart.own_told import fleet_vehicle
from server.flying.apart.recordings_there import RecordingsThere
from server.flying.bags.bag_desk import BagDesk
from server.flying.checklists import Checklists
from server.flying.recordings import RecordingDesk
from server.flying.reviewing import Reviewing
from server.flying.scenery import Scenery
from server.heard.channel import Channel
from server.heard.present import Present
from server.heard.relay import Relay
from server.library import Library
from server.library.recording_list import FETCHED, RecordingShelf
from server.obstacles.replayed import Replayed
from server.scene.layers.vehicles import actor_of
from server.schemas import FleetMessage, ServerMessage
from server.schemas.station_docs import FIRST_VEHICLE
from server.settings import RUNTIME_FOLDER, Settings
from server.stations import Flying, Shared, VehicleWanted
from server.studies.scenario_desk import ScenarioDesk
from server.traversability.live_uwb import LiveUwb
from server.work.jobs import Lane
from server.workspace import Workspace
from telemetry.bus.node_lock import running_nodes
from telemetry.topics.messages import Topic
from telemetry.topics.station_vehicles import FleetVehicle

TELL_EVERY_S = 0.2


class Fleet:
    """All methods belong to the event loop. Replay and the UWB radar are on the first vehicle's bus."""

    def __init__(
        self, flights: Sequence[Flying], present: Present, shared: Shared, settings: Settings | None = None
    ) -> None:
        """``settings`` say where other stations are met, if they are, and what those may fetch."""
        meeting = None if settings is None else _meeting(settings, shared.library)
        self._flights = {flying.number: flying for flying in flights}
        self._present, self._shared = present, shared
        workspace, library, shelf = shared.workspace, shared.library, shared.shelf
        self.shelf, self.checklists, self._replay = shelf, shared.checklists, Channel("replay", present)
        self.reviewing = Reviewing(
            library,
            shelf,
            workspace.on_show,
            self._replay,
            self.first.nodes,
            workspace.board,
            shared.replayed,
            present,
        )
        self.recordings = RecordingDesk(shelf, workspace.board, self.reviewing, present)
        self.bags = BagDesk(library, workspace.board, self.recordings)
        self.uwb = LiveUwb(workspace.traversability, library, self.first.bus)
        self._lines = OwnLines({flying.number: flying.live for flying in flights})
        self._stations = meeting and OtherStations(
            meeting, self.first.bus, self.first.nodes, shared.hub, self._own, self._lines.lines
        )
        stations = self._stations
        self._there: RecordingsThere | None = None
        if stations is not None and settings is not None:
            self._there = RecordingsThere(
                self.first.bus,
                self.first.nodes,
                shared.hub,
                self.recordings,
                lambda: stations.status,
                is_on=settings.stations_recordings,
                kb_s=settings.stations_recordings_kb_s,
            )
        self._nearness = Nearness(
            {flying.number: (flying.name, flying.live) for flying in flights},
            elsewhere=(lambda _: ()) if stations is None else stations.flown,
        )
        self._others = OtherVehicles(
            {flying.number: flying.as_other for flying in flights},
            {flying.number: flying.desk.on_others for flying in flights},
            elsewhere=(lambda: None) if stations is None else stations.row,
            flown_elsewhere=(lambda _: ()) if stations is None else stations.flown,
        )
        self._scenery = Scenery(
            workspace.stage,
            {**{actor_of("live", f.number): f.live for f in flights}, "replay": self._replay},
            {actor_of("live", f.number): f.name for f in flights} if len(flights) > 1 else {},
        )
        self._airspace = Airspace(
            workspace.traffic_stage,
            [(f.live, f.traffic) for f in flights],
            (self._replay, shared.replayed.traffic),
            self._stations,
        )

    @classmethod
    async def open(
        cls, settings: Settings, library: Library, hub: Hub, workspace: Workspace, scenarios: ScenarioDesk, demo: bool
    ) -> Fleet:
        """Joins the buses; nodes that a server before this one has left running are taken over.

        Raises BusError.
        """
        present = Present(hub)
        shelf = await asyncio.to_thread(RecordingShelf, library)
        checklists = await asyncio.to_thread(Checklists, library.root)
        shared = Shared(library, hub, workspace, scenarios, shelf, Lane("flight"), Replayed(present), checklists)
        flights: list[Flying] = []
        try:
            for wanted in await asyncio.to_thread(_wanted, settings, library, demo):
                flights.append(await Flying.open(wanted, shared))
        except BaseException:
            await asyncio.gather(*(flying.close() for flying in flights))
            raise
        return cls(flights, present, shared, settings)

    # The vehicles

    @property
    def first(self) -> Flying:
        return self._flights[FIRST_VEHICLE]

    @property
    def flights(self) -> list[Flying]:
        return list(self._flights.values())

    def of(self, number: int) -> Flying:
        """Raises NotFoundError."""
        if number not in self._flights:
            advice = f"There are {', '.join(map(str, self._flights))}."
            elsewhere = "" if self._stations is None else self._stations.elsewhere(number)
            raise NotFoundError(f"There is no vehicle {number}.", advice=f"{advice} {elsewhere}".strip())
        return self._flights[number]

    def named(self, number: str | None) -> Flying:
        """By what a request says. Where there are several it must say it.

        Raises BadRequestError, NotFoundError; OtherStationError, where it names another station's.
        """
        if number is not None and self._stations is not None:
            number = self._stations.who_commands(number) or number
        if number is None and len(self._flights) == 1:
            return self.first
        if number is None:
            raise BadRequestError(
                f"There are {len(self._flights)} vehicles, and the request names none.",
                advice="Say the number of one: in the header Hedgehop-Vehicle, or with --vehicle.",
            )
        if not (number.isascii() and number.isdecimal() and len(number) < 4):
            raise BadRequestError(f"Hedgehop-Vehicle is {number[:20]!r}, which is no number of a vehicle.")
        return self.of(int(number))

    def others_in_air(self, number: int) -> list[Flown]:
        """All but that one: the station's own, those that are ordered to take off with them, and other stations'."""
        own = [
            flown_of(flying.name, flying.live)
            for flying in self.flights
            if flying.number != number and (flying.live.in_air or flying.live.led is not None)
        ]
        return [*own, *([] if self._stations is None else self._stations.flown(time.monotonic()))]

    @property
    def recordings_there(self) -> RecordingsThere:
        """Of other stations. Raises NotReadyError where none are met."""
        if self._there is None:
            raise NotReadyError(
                "This station meets no others.", advice="Set stations_router and stations_file, and start it again."
            )
        return self._there

    @property
    def any_armed(self) -> bool:
        return any(flying.live.armed for flying in self.flights)

    @property
    def holders(self) -> set[str]:
        """Keys of the sessions that are in charge of a vehicle."""
        return {holder.session_key for flying in self.flights if (holder := flying.lease.holder) is not None}

    # Life

    def loops(self, alarms: Alarms, *, demo: bool = False) -> list[Coroutine[Any, Any, None]]:
        """To be run by the application's task group until it ends."""
        return [
            *(loop for flying in self.flights for loop in flying.loops(demo=demo)),
            *self._relay().loops(),
            self._hear_of_plan(),
            *([self._tell(), self._nearness.run(), self._others.run()] if self._has_others else []),
            *([self.first.nodes.no_stations()] if self._stations is None else self._stations.loops(alarms)),
            *([] if self._stations is None else [self._lines.run()]),
            *([] if self._there is None else self._there.loops()),
            self.recordings.run(),
            self._scenery.run(),
            self._airspace.run(),
            *self.uwb.loops(),
        ]

    async def close(self) -> None:
        """Nodes go on while their vehicle is armed: the next server finds them again."""
        if self.any_armed:
            armed = "The vehicle is" if len(self._flights) == 1 else "At least one vehicle is"
            sys.stdout.write(f"{armed}{_LEFT_FLYING}")
            sys.stdout.flush()
        await asyncio.gather(*(flying.close() for flying in self.flights))
        self._replay.close()
        await self._shared.lane.close()

    async def _hear_of_plan(self) -> None:
        changed = self._shared.workspace.changed
        while True:
            await changed.wait()
            changed.clear()
            for flying in self.flights:
                flying.on_plan()

    def _relay(self) -> Relay:
        relay = Relay(self.first.bus)
        # Its scans are placed between positions: each one counts.
        relay.on(Topic.VEHICLE, self.uwb.on_state, each=True)
        relay.on(Topic.UWB_SCAN, self.uwb.on_scan, each=True)
        relay.on(Topic.REPLAY, self.reviewing.on_status)
        relay.on(Topic.VEHICLE, self._replay.on_state, replayed=True)
        relay.on(Topic.TEXT, self._replay.on_text, replayed=True, each=True)
        relay.on(Topic.FLIGHT, self._replay.on_flight, replayed=True)
        self._shared.replayed.hear(relay)
        return relay

    # Pages

    def present(self) -> list[ServerMessage]:
        """What a page is told right after its snapshot, whichever vehicle it shows."""
        others = [] if self._stations is None else [self._stations.message()]
        there = [] if self._there is None else self._there.messages()
        return [*self._present.messages(), *([self._message] if self._has_others else []), *others, *there]

    @property
    def _has_others(self) -> bool:
        """A vehicle beside the first one, or another station's."""
        return len(self._flights) > 1 or self._stations is not None

    def _own(self) -> list[FleetVehicle]:
        """As other stations are told of them."""
        near = self._nearness.alarms
        return [
            fleet_vehicle(
                flying.doc(near.get(flying.number)),
                flying.live,
                flying.connections.status,
                in_charge_silent=flying.lease.is_silent,
                line=self._lines.told(flying.number),
            )
            for flying in self.flights
        ]

    @property
    def _message(self) -> FleetMessage:
        near = self._nearness.alarms
        return FleetMessage(vehicles=[flying.doc(near.get(flying.number)) for flying in self.flights])

    async def _tell(self) -> None:
        while True:
            self._shared.hub.publish(self._message)
            await asyncio.sleep(TELL_EVERY_S)


def _meeting(settings: Settings, library: Library) -> Meeting | None:
    file = settings.stations_file
    return None if file is None else Meeting(settings.stations_router, file, library.root / FETCHED / ".parts")


def _wanted(settings: Settings, library: Library, demo: bool) -> list[VehicleWanted]:
    """Those of the settings; then those that a station with more of them has left flying."""
    wanted = dict(enumerate(settings.vehicles, FIRST_VEHICLE))
    if demo:
        for number in range(len(wanted) + 1, settings.demo_vehicles + 1):
            wanted[number] = f"Vehicle {number}", ()
    for number, folder in library.vehicle_dirs().items():
        if number not in wanted and running_nodes(folder / RUNTIME_FOLDER):
            wanted[number] = f"Vehicle {number}", ()
    return [
        VehicleWanted(
            number,
            name,
            links,
            is_alone=len(wanted) == 1,
            demo_radar=settings.demo_radar,
            demo_world=settings.demo_world,
            demo_autopilot=settings.demo_autopilot(number - FIRST_VEHICLE),
            demo_traffic=settings.demo_traffic,
        )
        for number, (name, links) in wanted.items()
    ]


_LEFT_FLYING = (
    " armed: its link and the recording go on without the server, for 10 seconds.\n"
    "Start Hedgehop again within that time to stay in touch. After it, Hedgehop falls silent and the vehicle's own\n"
    "failsafe decides; in GUIDED it is told to hold its position first.\n"
)
