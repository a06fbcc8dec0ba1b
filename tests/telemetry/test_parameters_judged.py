"""Parameters over real sockets: through the link to the simulated vehicle, with pymavlink's mavparm as the judge."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavparm, mavutil

from telemetry.errors import NotAllowedError
from telemetry.simulation.simulator.autopilot.autopilot_parameters import SPECS
from telemetry.topics.messages import CommandRecord
from telemetry.topics.parameters import MOST_CHANGES, ParameterChange
from telemetry.topics.requests import Arm, Connect, ListParameters, Operator, WriteParameters
from tests.telemetry.link_bench import ME, console
from tests.telemetry.simulator_process import simulated_vehicle, wait_until

FROM_THE_START = ("--boot-s", "0.5")


@contextlib.contextmanager
def judge(port: int) -> Iterator[Any]:
    """Another ground station."""
    station = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", source_system=254)
    try:
        assert station.wait_heartbeat(timeout=60) is not None
        yield station
    finally:
        station.close()


def judged(station: Any) -> mavparm.MAVParmDict:
    """The whole list as pymavlink reads it."""
    found = mavparm.MAVParmDict()
    station.param_fetch_all()
    end_s = time.monotonic() + 60
    while len(found) < len(SPECS) and time.monotonic() < end_s:
        message = station.recv_match(type="PARAM_VALUE", blocking=True, timeout=1)
        if message is not None:
            found[message.param_id] = message.param_value
    return found


def test_hedgehop_reads_and_writes_what_pymavlink_reads(tmp_path: Path) -> None:
    changes = (ParameterChange("RTL_ALT", 4000.0), ParameterChange("WPNAV_RADIUS", 123.25))

    async def ours(port: int) -> tuple[Any, Any, list[str]]:
        async with console() as bench:
            await bench.handle(Connect(ME, f"tcp:127.0.0.1:{port}", True))
            await bench.live()
            listed = await bench.handle(ListParameters())
            written = await bench.handle(WriteParameters(ME, changes))
            return listed, written, [record.words for record in bench.of(CommandRecord) if not record.result]

    with simulated_vehicle(tmp_path, *FROM_THE_START) as (_, port):
        with judge(port) as station:
            before = judged(station)
        listed, written, words = asyncio.run(ours(port))
        assert {p.name: p.value for p in listed.parameters} == dict(before)
        # Only the file of all parameters says the defaults.
        assert {p.name: p.default for p in listed.parameters} == {name: spec.default for name, spec in SPECS.items()}
        assert len(before) == len(SPECS)
        assert [(w.name, w.before, w.after, w.outcome) for w in written] == [
            ("RTL_ALT", 1500.0, 4000.0, "set"),
            ("WPNAV_RADIUS", 200.0, 123.25, "set"),
        ]
        assert words[-1] == "write RTL_ALT 4000, WPNAV_RADIUS 123.25"
        with judge(port) as station:
            after = judged(station)
            assert {name: value for name, value in after.items() if before[name] != value} == {
                "RTL_ALT": 4000.0,
                "WPNAV_RADIUS": 123.25,
            }
            assert after.mavset(station, "RTL_ALT", 2500.0)

    assert after["RTL_ALT"] == 2500.0


def test_while_armed_nothing_is_written_unless_it_is_said(tmp_path: Path) -> None:
    change = (ParameterChange("RTL_ALT", 4000.0),)

    async def run(port: int) -> None:
        async with console() as bench:
            await bench.handle(Connect(ME, f"tcp:127.0.0.1:{port}", True))
            await bench.live()
            with pytest.raises(NotAllowedError, match="2 changes of 1 parameters"):
                await bench.handle(WriteParameters(ME, change + change))
            many = tuple(ParameterChange(f"P{number}", 1.0) for number in range(MOST_CHANGES + 1))
            with pytest.raises(NotAllowedError, match="at most 20"):
                await bench.handle(WriteParameters(ME, many))
            async with asyncio.timeout(60):
                while bench.vehicle is None or not bench.vehicle.state.armed:
                    with contextlib.suppress(Exception):
                        await bench.handle(Arm(ME))
                    await asyncio.sleep(0.1)
            with pytest.raises(NotAllowedError, match="The vehicle is armed"):
                await bench.handle(WriteParameters(ME, change))
            assert not any("write" in record.words for record in bench.of(CommandRecord))
            (written,) = await bench.handle(WriteParameters(ME, change, even_armed=True))
            assert written.outcome == "set"
            assert any("even armed" in record.words for record in bench.of(CommandRecord))
            with pytest.raises(NotAllowedError, match="not in charge"):
                await bench.handle(WriteParameters(Operator("Bob", 0), change, even_armed=True))

    with simulated_vehicle(tmp_path, *FROM_THE_START, "--parameter", "DISARM_DELAY=0") as (vehicle, port):
        wait_until(lambda: vehicle.process.poll() is None, "the vehicle runs")
        asyncio.run(run(port))
