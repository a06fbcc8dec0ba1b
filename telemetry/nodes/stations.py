"""The stations node: tells other stations of this one's vehicles, and hears of theirs, through a Zenoh router.

``python -m telemetry.nodes.stations --runtime DIR --station NAME --router tls/HOST:PORT --file FILE``. Nothing that
flies needs it: without a router it tries again, and says so. It tells no vehicle anything. Recordings go both ways when
they are asked for, behind all else; with ``--fetched DIR`` those of others may be fetched.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import math
import secrets
import sys
import time
from datetime import UTC, datetime
from pathlib import Path

from telemetry.bus.bus import Bus
from telemetry.bus.node import LOOK_EVERY_S, NodeContext, run_node
from telemetry.errors import StationsError
from telemetry.stations.recordings.exchange import Exchange
from telemetry.stations.roster import Roster
from telemetry.stations.router_wire import Wire
from telemetry.stations.station_messages import encode
from telemetry.stations.station_names import beacon_key, checked_name, line_key, vehicle_key
from telemetry.stations.station_proof import Route, ends_soon, why_refused
from telemetry.stations.when_told import LineTelling, Telling
from telemetry.topics.messages import Topic
from telemetry.topics.station_recordings import OwnRecordings, RecordingsRequest, RecordingsStatus
from telemetry.topics.station_vehicles import OwnVehicles, StationsStatus

_log = logging.getLogger(__name__)

TURN_S, BEACON_S, STATUS_S, AGAIN_S = 0.1, 1.0, 0.5, 1.0
RECORDINGS_TURN_S, RECORDINGS_STATUS_S = 0.05, 2.0
REOPEN_S, ENDS_EVERY_S = 5.0, 600.0
_MEANS = "Other stations are neither seen nor told anything. Own vehicles are not affected."
KNOWS_S = 3.0
"""Without the server's word, which comes five times a second, for so long this node says nothing: what it said before
may be true no more."""
OFFERS_S = 10.0
"""The same of recordings, which it names every second."""


class StationsNode:
    """Belongs to one event loop; Zenoh's threads stay behind ``Wire``."""

    def __init__(self, bus: Bus, context: NodeContext, station: str, route: Route, fetched: Path | None) -> None:
        self._bus, self._context, self._station, self._route = bus, context, station, route
        run = secrets.randbits(32)
        self._roster, self._telling = Roster(station, run), Telling(run)
        self._lines = LineTelling()
        self._own = OwnVehicles(0.0)
        self._recordings, self._offered_s = Exchange(station, fetched), -math.inf
        self._told_recordings = RecordingsStatus(-math.inf)
        self._wire: Wire | None = None
        self._fault = self._ends = ""
        self._since_s: float | None = None
        self._told: StationsStatus | None = None

    async def run(self) -> None:
        """Until nobody needs it any more."""
        await self._bus.serve("stations", self._recordings.handle, RecordingsRequest)
        parts = self._hear_own, self._hear_offered, self._keep_wire, self._tell_bus, self._recordings.run
        async with asyncio.TaskGroup() as group:
            tasks = [group.create_task(part()) for part in parts]
            while self._context.is_needed():
                await asyncio.sleep(LOOK_EVERY_S)
            for task in tasks:
                task.cancel()

    async def _hear_own(self) -> None:
        async for _, message in self._bus.subscribe(Topic.STATIONS_OWN):
            if isinstance(message, OwnVehicles):
                self._own = message

    async def _hear_offered(self) -> None:
        async for _, message in self._bus.subscribe(Topic.STATIONS_OFFERED):
            if isinstance(message, OwnRecordings):
                self._offered_s = message.t_mono_s
                self._recordings.on_own(message)

    async def _keep_wire(self) -> None:
        """Until cancelled. A router that is away for a moment Zenoh finds again itself; after that it is asked why."""
        while True:
            try:
                stamp = await asyncio.to_thread(_stamp, self._route.file)
                self._wire = await Wire.open(self._route, time.monotonic, self._station)
            except StationsError:
                why = await asyncio.to_thread(why_refused, self._route, datetime.now(UTC))
                self._note(f"{why} {_MEANS}")
                await asyncio.sleep(AGAIN_S)
                continue
            try:
                async with asyncio.TaskGroup() as group:
                    wire = self._wire
                    parts = [
                        group.create_task(part)
                        for part in (
                            self._tell_others(wire),
                            self._hear_others(wire),
                            self._exchange_recordings(wire),
                            self._watch_ends(),
                        )
                    ]
                    await self._watch_router(wire, stamp)
                    for part in parts:
                        part.cancel()
            finally:
                # Also where it is open again before anybody looks: what was said meanwhile was not heard.
                wire, self._wire, self._since_s = self._wire, None, None
                await wire.close()

    async def _tell_others(self, wire: Wire) -> None:
        beacon_s = 0.0
        while True:
            now_s = time.monotonic()
            if now_s - self._own.t_mono_s > KNOWS_S:
                await asyncio.sleep(TURN_S)
                continue
            if now_s - beacon_s >= BEACON_S:
                beacon_s = now_s
                beacon = self._roster.beacon(len(self._own.vehicles), now_s=now_s, now_utc_s=time.time())
                wire.put(beacon_key(self._station), encode(beacon))
            for number, message in self._telling.due(self._own.vehicles, now_s):
                wire.put(vehicle_key(self._station, number), encode(message))
            self._lines.want(self._roster.take_wanted())
            due = self._lines.due({line.number: line.packed for line in self._own.lines}, now_s)
            if due is not None:
                wire.put(line_key(self._station, due[0]), due[1])
            await asyncio.sleep(TURN_S)

    async def _hear_others(self, wire: Wire) -> None:
        while True:
            await wire.arrived.wait()
            wire.arrived.clear()
            waiting, refused = wire.inbox.take()
            utc_less_mono_s = time.time() - time.monotonic()
            for key, (payload, came_s) in waiting.items():
                self._roster.on_message(key, payload, now_s=came_s, now_utc_s=came_s + utc_less_mono_s)
            if refused:
                self._roster.refuse_unread(refused, time.monotonic())

    async def _exchange_recordings(self, wire: Wire) -> None:
        """In turns of its own, so that a slow disk holds up no position."""
        while True:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(RECORDINGS_TURN_S):
                    await wire.mail_arrived.wait()
            wire.mail_arrived.clear()
            for key, payload, came_s in wire.mail.take():
                self._recordings.on_message(key, payload, came_s)
            now_s = time.monotonic()
            if now_s - self._offered_s <= OFFERS_S:
                for key, payload in await self._recordings.turn(self._roster.live(now_s), now_s):
                    wire.put(key, payload, waits=True)

    async def _watch_router(self, wire: Wire, stamp: int) -> None:
        """Until it is to be opened anew: it was lost for ``REOPEN_S``, or the station's file is another one."""
        where, lost_s = ", ".join(self._route.routers), math.inf
        while True:
            now_s = time.monotonic()
            if await wire.is_connected():
                lost_s = math.inf
                self._note("")
            else:
                lost_s = min(lost_s, now_s)
                self._note(f"The router at {where} does not answer: start it again, or mend the network. {_MEANS}")
            if now_s - lost_s > REOPEN_S or await asyncio.to_thread(_stamp, self._route.file) not in (0, stamp):
                return
            await asyncio.sleep(STATUS_S)

    async def _watch_ends(self) -> None:
        while True:
            self._ends = await asyncio.to_thread(ends_soon, self._route, datetime.now(UTC))
            await asyncio.sleep(ENDS_EVERY_S)

    def _note(self, fault: str) -> None:
        if fault != self._fault:
            self._fault = fault
            _log.log(logging.WARNING if fault else logging.INFO, "%s", fault or "The router answers.")

    async def _tell_bus(self) -> None:
        while True:
            status, told = self._status(), self._told
            if told is None or status.t_mono_s - told.t_mono_s >= STATUS_S or _differ(status, told):
                self._told = status
                self._bus.publish(Topic.STATIONS, status)
            self._tell_recordings()
            await asyncio.sleep(TURN_S)

    def _tell_recordings(self) -> None:
        status, told = self._recordings.status(time.monotonic()), self._told_recordings
        since_s = status.t_mono_s - told.t_mono_s
        is_other = (status.stations, status.fetches) != (told.stations, told.fetches)
        if since_s >= RECORDINGS_STATUS_S or (is_other and since_s >= STATUS_S):
            self._told_recordings = status
            self._bus.publish(Topic.STATIONS_RECORDINGS, status)

    def _status(self) -> StationsStatus:
        now_s, roster = time.monotonic(), self._roster
        connected = self._wire is not None and not self._fault
        self._since_s = (self._since_s or now_s) if connected else None
        text = self._fault or ("" if connected else "The router is being looked for.")
        leaves_out = roster.leaves_out(now_s)
        text = " ".join(filter(None, (leaves_out, text, self._ends if connected else "")))
        return StationsStatus(
            t_mono_s=now_s,
            station=self._station,
            router="connected" if connected else "lost",
            text=text,
            listens_since_t_mono_s=self._since_s,
            leaves_out=leaves_out,
            stations=roster.stations(now_s, time.time()),
            vehicles=roster.vehicles(now_s),
            lines=roster.lines(),
            refused=roster.refused,
            refused_last=roster.refused_last,
        )


def _stamp(file: Path) -> int:
    """Another one: another file. 0: it is not there, which ends nothing that runs."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return 0


def _differ(status: StationsStatus, told: StationsStatus) -> bool:
    """A router or a station came or went."""
    return (status.router, [(s.name, s.state) for s in status.stations]) != (
        told.router,
        [(s.name, s.state) for s in told.stations],
    )


def main() -> int:
    parser = argparse.ArgumentParser(prog="stations", description="Sees the vehicles of other stations.")
    parser.add_argument("--runtime", type=Path, required=True, help="directory of the bus's sockets")
    parser.add_argument("--station", type=checked_name, required=True, help="this station's name")
    parser.add_argument("--router", action="append", required=True, help="tls/HOST:PORT; may be given several times")
    parser.add_argument("--file", type=Path, required=True, help="the station's key and certificates (PEM)")
    parser.add_argument("--fetched", type=Path, help="where recordings lie while they are fetched from other stations")
    options = parser.parse_args()
    route = Route(tuple(options.router), options.file)

    async def live(bus: Bus, context: NodeContext) -> None:
        await StationsNode(bus, context, options.station, route, options.fetched).run()

    return run_node("stations", options.runtime, live)


if __name__ == "__main__":
    sys.exit(main())
