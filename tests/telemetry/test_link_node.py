"""The link node as processes see it: asked over the bus, killed in flight, and found again as it was."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from telemetry.bus.bus import Bus
from telemetry.bus.link_client import COMMAND_S, LinkClient
from telemetry.bus.node_lock import running_node
from telemetry.errors import AddressError, BusError, MissionUnknownError, NoVehicleError
from telemetry.link.audit_chain import check_chain
from telemetry.link.keys import audit_key_file
from telemetry.link.session import AVOIDS_AGAIN
from telemetry.simulation.simulator.run import SimOptions, flying
from telemetry.topics.messages import FlightStatus, LinkStatus, ServerAlive, Topic, VehicleText
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.requests import (
    Arm,
    Connect,
    Operator,
    Pause,
    ReadParameters,
    Resume,
    SetAvoidance,
    StartAuto,
    Upload,
)
from telemetry.topics.vehicle import VehicleState
from tests.free_ports import free_port
from tests.telemetry.bus_runs import ROOT, run
from tests.telemetry.link_bench import until
from tests.telemetry.test_mavlink_flights import ALT_M, LAT_DEG, LON_DEG, QUICKLY_DOWN, items

ME = Operator("Ann", 7)


class Node:
    """The process, and what it publishes."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.runtime = folder, folder / "run"
        self._processes: list[subprocess.Popen[bytes]] = []
        self.last: dict[type, Any] = {}
        self.texts: list[str] = []
        self.links_since_start: list[LinkStatus] = []

    def start(self, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "telemetry.nodes.link", "--runtime", str(self.runtime), *arguments]
        process = subprocess.Popen(command, cwd=ROOT, stderr=subprocess.DEVNULL)
        self._processes.append(process)
        return process

    def kill_and_start_again(self) -> None:
        process = self._processes[-1]
        process.kill()
        process.wait()
        self.last.clear()
        self.links_since_start.clear()
        self.start()

    def end(self) -> None:
        for process in self._processes:
            process.kill()
            process.wait()

    @property
    def status(self) -> LinkStatus:
        return self.last.get(LinkStatus, LinkStatus(0.0))

    @property
    def state(self) -> VehicleState:
        return self.last.get(VehicleState, VehicleState(0, 0))

    @property
    def flight(self) -> FlightStatus:
        return self.last.get(FlightStatus, FlightStatus())

    @property
    def avoidance(self) -> AvoidanceStatus:
        return self.last.get(AvoidanceStatus, AvoidanceStatus())

    async def listen(self, bus: Bus) -> None:
        async for _, message in bus.subscribe("**", keep_all=True):
            self.last[type(message)] = message
            if isinstance(message, LinkStatus):
                self.links_since_start.append(message)
            if isinstance(message, VehicleText):
                self.texts.append(message.text)


async def stand_for_a_server(bus: Bus) -> None:
    while True:
        bus.publish(Topic.SERVER, ServerAlive(time.monotonic(), os.getpid()))
        await asyncio.sleep(0.5)


@contextlib.asynccontextmanager
async def station(folder: Path, **options: Any) -> AsyncIterator[tuple[Node, LinkClient]]:
    node = Node(folder)
    async with await Bus.open(node.runtime, "server") as bus:
        tasks = [asyncio.create_task(part) for part in (node.listen(bus), stand_for_a_server(bus))]
        try:
            yield node, LinkClient(bus, **options)
        finally:
            node.end()
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


def test_it_is_asked_over_the_bus_and_its_errors_arrive_as_they_are(tmp_path: Path) -> None:
    async def whole() -> None:
        async with station(tmp_path) as (node, client):
            process = node.start()
            with pytest.raises(AddressError, match="no serial device"):
                await client.call(Connect(ME, "/etc/passwd"))
            with pytest.raises(NoVehicleError, match="No vehicle"):
                await client.call(Arm(ME))
            assert await client.call(Connect(ME, f"udpin:127.0.0.1:{free_port()}")) is None
            process.terminate()
            await until(lambda: process.poll() is not None)
            assert process.returncode == 0

    run(whole)


def test_killed_in_flight_it_is_started_again_and_finds_vehicle_mission_and_flight(tmp_path: Path) -> None:
    async def whole() -> None:
        where: dict[str, Any] = {"link": "tcpin:127.0.0.1:0", "speedup": 4.0, "boot_s": 0.5}
        options = SimOptions(LAT_DEG, LON_DEG, ALT_M, **where, parameters=QUICKLY_DOWN)
        async with flying(options) as simulator, station(tmp_path) as (node, client):
            node.start("--link", simulator.address.replace("tcpin", "tcp"))
            await until(lambda: node.status.state == "live" and node.state.ready_to_arm and node.state.estimator_ok)
            assert running_node(node.runtime, "link") is not None
            report = await client.call(Upload(ME, items(6), LAT_DEG, LON_DEG, ALT_M))
            assert report.verified
            assert await client.call(ReadParameters(("RTL_ALT",))) == {"RTL_ALT": 1500.0}
            with pytest.raises(MissionUnknownError):
                await client.call(StartAuto(ME, "another"))
            await client.call(SetAvoidance(ME, enabled=True, by="sidestep"))
            node.kill_and_start_again()
            await until(lambda: node.avoidance.enabled and node.status.mission_state == "verified")
            assert AVOIDS_AGAIN not in node.texts, "on the ground there was nothing to avoid"
            await until(lambda: node.state.ready_to_arm)
            await client.call(StartAuto(ME, report.onboard.digest))
            await until(lambda: node.flight.phase == "flying")
            facts = running_node(node.runtime, "link")
            assert facts is not None
            assert not facts.replaceable
            since = node.flight.since_utc_s

            node.kill_and_start_again()
            await until(lambda: node.status.state == "live")
            assert all(status.adopted for status in node.links_since_start), "a vehicle in the air is lost, not none"
            await until(lambda: node.status.mission_state == "verified" and node.flight.phase == "flying")
            assert node.status.mission_digest == report.onboard.digest
            assert node.flight.since_utc_s == since
            assert (node.status.adopted and node.status.adopted.system_id) == 1
            await until(lambda: node.avoidance.enabled)
            assert node.avoidance.by == "sidestep"
            await until(lambda: AVOIDS_AGAIN in node.texts)
            simulator.options = replace(simulator.options, speedup=15.0)
            await until(lambda: node.flight.phase == "landed")
            await until(lambda: (facts := running_node(node.runtime, "link")) is not None and facts.replaceable)

            audit = tmp_path / "audit.jsonl"
            assert check_chain(audit.read_bytes(), audit_key_file(node.runtime.parent).read_bytes()) is None
            entries = [json.loads(line) for line in audit.read_bytes().splitlines()]
            assert {"done"} <= {entry.get("result") for entry in entries}
            words = [entry["words"] for entry in entries if "result" not in entry]
            assert words[0] == "upload 8 items"
            assert words[-4:] == [
                "avoidance on by sidestep",
                "avoidance on again",
                f"start mission {report.onboard.digest[:12]} at item 1",
                "avoidance on again",
            ]

    run(whole)


def test_a_mission_that_was_paused_when_the_node_was_killed_is_gone_on_with_and_no_other(tmp_path: Path) -> None:
    async def whole() -> None:
        where: dict[str, Any] = {"link": "tcpin:127.0.0.1:0", "speedup": 8.0, "boot_s": 0.5}
        options = SimOptions(LAT_DEG, LON_DEG, ALT_M, **where, parameters=QUICKLY_DOWN)
        async with flying(options) as simulator, station(tmp_path) as (node, client):
            node.start("--link", simulator.address.replace("tcpin", "tcp"))
            await until(lambda: node.status.state == "live" and node.state.ready_to_arm and node.state.estimator_ok)
            report = await client.call(Upload(ME, items(6), LAT_DEG, LON_DEG, ALT_M))
            await client.call(StartAuto(ME, report.onboard.digest))
            await until(lambda: node.flight.phase == "flying")
            await client.call(Pause(ME))
            await until(lambda: node.flight.phase == "paused" and (node.state.ground_speed_m_s or 0.0) < 0.2)
            node.kill_and_start_again()
            await until(lambda: node.status.state == "live" and node.flight.phase == "paused")
            await client.call(Resume(ME))
            await until(lambda: node.flight.phase == "flying")

            await client.call(Pause(ME))
            await until(lambda: node.flight.phase == "paused" and (node.state.ground_speed_m_s or 0.0) < 0.2)
            other = items(3)
            await client.call(Upload(ME, other, LAT_DEG, LON_DEG, ALT_M, while_holding=True))
            node.kill_and_start_again()
            await until(lambda: node.status.state == "live" and node.flight.phase == "paused")
            with pytest.raises(MissionUnknownError, match="Another mission is on board"):
                await client.call(Resume(ME))

    run(whole)


def test_a_command_to_a_link_that_hangs_or_is_gone_fails_soon_and_says_so(tmp_path: Path) -> None:
    async def whole() -> None:
        async with station(tmp_path) as (node, client):
            began_s = time.monotonic()
            with pytest.raises(BusError, match="link is not running"):
                await client.call(Pause(ME))
            gone_s = time.monotonic() - began_s
            process = node.start()
            await client.call(Connect(ME, f"udpin:127.0.0.1:{free_port()}"))
            os.kill(process.pid, signal.SIGSTOP)
            began_s = time.monotonic()
            with pytest.raises(BusError, match="does not answer") as told:
                await client.call(Pause(ME))
            assert "transmitter" in (told.value.advice or "")
            assert gone_s < COMMAND_S / 3
            assert time.monotonic() - began_s < COMMAND_S / 3

    run(whole)
