"""Stations as they run: a router, a bus and a *stations* node for each, and vehicles whose place tells the time."""

from __future__ import annotations

import asyncio
import base64
import json
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import zenoh

from server.door.certificates import CertificateFiles, now_utc
from server.door.station_files import ROUTER_FILE, write_station_files
from telemetry.bus.bus import Bus
from telemetry.stations.plan_lines import MOST_POINTS, PlanLine, line_id, packed
from telemetry.topics.messages import ServerAlive, Topic
from telemetry.topics.station_recordings import (
    FetchRecording,
    FetchStatus,
    OfferedRecording,
    OwnRecordings,
    RecordingsRequest,
    RecordingsStatus,
    StationRecordings,
)
from telemetry.topics.station_vehicles import FleetLine, FleetVehicle, OtherVehicle, OwnVehicles, StationsStatus
from tests.free_ports import free_port

PATIENCE_S = 90.0
DEG_PER_S = 1e-4
_ROUTER = """
import sys, zenoh
session = zenoh.open(zenoh.Config.from_file(sys.argv[1]))
print("open", flush=True)
sys.stdin.read()
"""


@cache
def line_of(number: int) -> bytes:
    """As many points as there may be, and another one for each vehicle."""
    drawn = np.random.default_rng(number)
    lat_lon_deg = np.array([40.0, 8.0]) + np.cumsum(drawn.normal(0.0, 5e-4, (MOST_POINTS, 2)), axis=0)
    t_s = np.cumsum(drawn.uniform(2.0, 12.0, MOST_POINTS))
    return packed(PlanLine(lat_lon_deg, drawn.uniform(480.0, 520.0, MOST_POINTS), t_s, 1.0))


def own_vehicles(count: int) -> OwnVehicles:
    """All fly lines, and their latitude is the time."""
    now_s = time.monotonic()
    lat_deg = 40.0 + DEG_PER_S * (now_s % 10_000)
    vehicles = (
        FleetVehicle(
            number=number,
            name=f"Drone {number}",
            in_charge="Anna",
            mode="AUTO",
            phase="flying",
            armed=True,
            in_air=True,
            link="live",
            link_quality=0.99,
            position_t_mono_s=now_s,
            lat_deg=lat_deg,
            lon_deg=8.0,
            alt_amsl_m=500.0,
            alt_rel_home_m=30.0,
            alt_surface_m=12.0,
            v_enu_m_s=(0.0, 11.1, 0.0),
            heading_rad=0.0,
            within_m=0.6,
            battery_share=0.63,
            battery="63 %, 12 min to the reserve",
            plan="Ridge survey",
            plan_share=0.4,
            line=line_id(line_of(number)),
            line_s=now_s % 100.0,
        )
        for number in range(1, count + 1)
    )
    lines = (FleetLine("", number, line_of(number)) for number in range(1, count + 1))
    return OwnVehicles(now_s, tuple(vehicles), tuple(lines))


def true_age_s(other: OtherVehicle, at_mono_s: float) -> float:
    """Of its position: all processes here have one clock."""
    assert other.it.lat_deg is not None
    was_s = (other.it.lat_deg - 40.0) / DEG_PER_S
    return (at_mono_s - was_s + 5_000.0) % 10_000.0 - 5_000.0


class Router:
    """Zenoh's own, with the file that is written for zenohd."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._process: subprocess.Popen[str] | None = None

    async def start(self) -> None:
        command = [sys.executable, "-c", _ROUTER, str(self._file)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert self._process.stdout is not None
        said = asyncio.to_thread(self._process.stdout.readline)
        assert await asyncio.wait_for(said, PATIENCE_S) == "open\n"

    def kill(self) -> None:
        if self._process is None:
            return
        self._process.kill()
        self._process.communicate(timeout=PATIENCE_S)
        self._process = None


class FieldStation:
    """The server's place on a bus, and the node beside it. ``shown``: its certificate's name, if that is another."""

    def __init__(self, name: str, bus: Bus, folder: Path, router: str, *, shown: str, vehicles: int) -> None:
        self.name, self.bus, self._vehicles = name, bus, vehicles
        self.statuses: list[StationsStatus] = []
        self.offered: OwnRecordings | None = None
        """Said every 0.2 s, at the time of then."""
        self.recordings = RecordingsStatus(0.0)
        self.fetched = folder.parent / f"fetched-{bus.runtime_dir.name}"
        command = [sys.executable, "-m", "telemetry.nodes.stations", "--runtime", str(bus.runtime_dir)]
        command += ["--station", name, "--router", router, "--file", str(folder / f"{shown}.pem")]
        self._command = [*command, "--fetched", str(self.fetched)]
        self._log = (bus.runtime_dir / "log").open("wb")
        self.node = self._started()

    def _started(self) -> subprocess.Popen[bytes]:
        return subprocess.Popen(self._command, start_new_session=True, stderr=self._log)

    async def start_again(self) -> None:
        """After its node was killed."""
        self.node.kill()
        await asyncio.to_thread(self.node.wait, PATIENCE_S)
        self.node = self._started()

    async def live(self) -> None:
        """Until cancelled."""
        async with asyncio.TaskGroup() as group:
            group.create_task(self._tell())
            group.create_task(self._hear())
            group.create_task(self._hear_of_recordings())

    async def until(self, holds: Callable[[StationsStatus], bool]) -> StationsStatus:
        """The first status from now on of which it holds."""
        begun = len(self.statuses)
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for status in self.statuses[begun:]:
                    if holds(status):
                        return status
                begun = len(self.statuses)
                await asyncio.sleep(0.02)

    async def sees(self, *others: str, vehicles: int = 0) -> StationsStatus:
        """All of these live, with vehicles whose age is known, so many at least, and no others."""

        def holds(status: StationsStatus) -> bool:
            live = {station.name for station in status.stations if station.state == "live" and station.hears_us}
            aged = {other.station for other in status.vehicles if other.oldest_t_mono_s is not None}
            return status.router == "connected" and live == aged == set(others) and len(status.vehicles) >= vehicles

        return await self.until(holds)

    def offer(self, *paths: Path, is_on: bool = True, bytes_per_s: int = 1_000_000) -> None:
        """From now on; of no files: it fetches at that pace."""
        offered = tuple(
            OfferedRecording(str(path), path.name, path.stat().st_size, 1.7e9, 1.7e9 + 60.0, "Vehicle 1", "Ridge")
            for path in paths
        )
        self.offered = OwnRecordings(0.0, is_on, bytes_per_s, offered)

    async def asks(self, request: RecordingsRequest) -> None:
        await self.bus.call("stations", request, result=type(None), timeout_s=PATIENCE_S)

    async def lists(self, station: str, holds: Callable[[StationRecordings], bool]) -> StationRecordings:
        """Of that station's recordings, once it holds."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for each in self.recordings.stations:
                    if each.station == station and holds(each):
                        return each
                await asyncio.sleep(0.02)

    async def fetch(self, station: str, name: str) -> str:
        """Asks for one that it lists, and answers with its SHA-256."""
        listed = await self.lists(station, lambda each: name in {there.name for there in each.recordings})
        sha256 = next(there.sha256 for there in listed.recordings if there.name == name)
        await self.asks(FetchRecording(station, sha256))
        return sha256

    async def fetches(self, holds: Callable[[FetchStatus], bool]) -> FetchStatus:
        """The first fetch of which it holds."""
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for each in self.recordings.fetches:
                    if holds(each):
                        return each
                await asyncio.sleep(0.02)

    def end(self) -> None:
        self.node.kill()
        self.node.wait(timeout=PATIENCE_S)
        self._log.close()

    async def _tell(self) -> None:
        while True:
            self.bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), 1))
            self.bus.publish(Topic.STATIONS_OWN, own_vehicles(self._vehicles))
            if self.offered is not None:
                self.bus.publish(Topic.STATIONS_OFFERED, replace(self.offered, t_mono_s=time.monotonic()))
            await asyncio.sleep(0.2)

    async def _hear(self) -> None:
        async for _, message in self.bus.subscribe(Topic.STATIONS):
            if isinstance(message, StationsStatus):
                self.statuses.append(message)

    async def _hear_of_recordings(self) -> None:
        async for _, message in self.bus.subscribe(Topic.STATIONS_RECORDINGS):
            if isinstance(message, RecordingsStatus):
                self.recordings = message


class Field:
    """Several stations around a router. ``through`` gives each its own way to the router's port: a bad line."""

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self.folder, self.port = folder, free_port()
        self.files = folder / "fleet"
        endpoint = f"tls/127.0.0.1:{self.port}"
        authority = CertificateFiles(folder / "data")
        write_station_files(self.files, authority, names, ["127.0.0.1"], now_utc(), listen=[endpoint])
        self.router = Router(self.files / ROUTER_FILE)
        self.stations: dict[str, FieldStation] = {}

    @asynccontextmanager
    async def station(
        self, name: str, *, shown: str = "", vehicles: int = 2, port: int | None = None
    ) -> AsyncIterator[FieldStation]:
        """While it runs."""
        async with await Bus.open(self.folder / f"run-{len(self.stations)}", "server") as bus:
            router = f"tls/127.0.0.1:{port or self.port}"
            station = FieldStation(name, bus, self.files, router, shown=shown or name, vehicles=vehicles)
            self.stations[f"{name} {len(self.stations)}"] = station
            living = asyncio.ensure_future(station.live())
            try:
                yield station
            finally:
                living.cancel()
                await asyncio.wait([living])
                station.end()


def station_session(field: Field, name: str) -> zenoh.Session:
    """Of that station at the router, by hand."""
    begin = "-----BEGIN "
    parts = [begin + part for part in (field.files / f"{name}.pem").read_text().split(begin)[1:]]
    settings = {"mode": "client", "connect/endpoints": [f"tls/127.0.0.1:{field.port}"]}
    for what, part in zip(("connect_private_key", "connect_certificate", "root_ca_certificate"), parts, strict=True):
        settings[f"transport/link/tls/{what}_base64"] = base64.b64encode(part.encode()).decode()
    config = zenoh.Config()
    for key, value in {**settings, "transport/link/tls/enable_mtls": True, "scouting/multicast/enabled": False}.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)
