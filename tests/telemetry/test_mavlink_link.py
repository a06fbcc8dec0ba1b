"""The link on real sockets with radios that a test speaks for: strangers, twins, noise, silence, the operator."""

from __future__ import annotations

import asyncio
import contextlib
import os
import pty
import socket
import time
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.errors import AddressError, NotAllowedError, NoVehicleError
from telemetry.link.onboard import Started
from telemetry.link.peers import Expected
from telemetry.topics.messages import Candidate, LinkStatus
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.requests import Adopt, Arm, Connect, Disconnect, Download, Operator, Release, ReturnHome, Upload
from tests.free_ports import free_port
from tests.telemetry.fake_vehicle import UdpVehicle, radio
from tests.telemetry.frames import ARMED, attitude, ground_station_heartbeat, heartbeat, packed
from tests.telemetry.link_bench import ME, console, listening, until
from tests.telemetry.own_time import run


def test_nothing_is_sent_to_a_stranger_until_it_is_adopted() -> None:
    async def whole() -> None:
        async with listening(adopt=False) as (bench, port), radio(port) as vehicle:
            await until(lambda: bench.status.candidates)
            before = len(bench.of(LinkStatus))
            await until(lambda: len(bench.of(LinkStatus)) > before + 2)
            assert vehicle.heard == []
            assert bench.frames(sent=True) == []
            (candidate,) = bench.status.candidates
            await bench.handle(Adopt(ME, candidate.id))
            await until(lambda: {"HEARTBEAT", "COMMAND_LONG", "TIMESYNC"} <= vehicle.kinds())
            (own,) = {(m.get_srcSystem(), m.get_srcComponent()) for m in vehicle.heard}
            assert own == (255, 190)
            assert bench.status.adopted == candidate
            assert bench.commands == [f"adopt {candidate.id}"]

    run(whole)


def test_after_a_release_nothing_is_sent_any_more() -> None:
    async def whole() -> None:
        async with listening(adopt=True) as (bench, port), radio(port) as vehicle:
            await bench.live()
            await until(lambda: "HEARTBEAT" in vehicle.kinds())
            await bench.handle(Release(ME))
            # What was sent before may still lie in the vehicle's socket.
            released = len(bench.of(LinkStatus))
            await until(lambda: len(bench.of(LinkStatus)) > released + 1)
            vehicle.heard.clear()
            await until(lambda: len(bench.of(LinkStatus)) > released + 3)
            assert vehicle.heard == []
            assert (bench.status.state, bench.status.adopted) == ("none", None)

    run(whole)


def test_the_vehicle_of_the_node_before_gets_its_heartbeat_before_it_says_anything() -> None:
    async def whole() -> None:
        port = free_port()
        vehicle, other = UdpVehicle(port), UdpVehicle(port)
        before = Candidate("old", f"udpin:127.0.0.1:{port}", f"127.0.0.1:{vehicle.port}", 1, 1, "ardupilot", 2)
        async with console() as bench:
            bench.link.expect(Expected(before, time.monotonic(), False, None))
            await bench.handle(Connect(ME, before.address, True))
            await until(lambda: len(vehicle.of("HEARTBEAT")) >= 2)
            assert (vehicle.kinds(), other.heard, bench.status.adopted) == ({"HEARTBEAT"}, [], None)
            bench.link.give_up_expected()
            silent_since = len(bench.of(LinkStatus))
            vehicle.heard.clear()
            await until(lambda: len(bench.of(LinkStatus)) > silent_since + 3)
            assert vehicle.heard == []
        vehicle.close()
        other.close()

    run(whole)


def test_a_vehicle_that_may_fly_is_lost_from_sight_until_the_restarted_link_hears_it_or_gives_it_up() -> None:
    async def whole() -> None:
        address = f"udpin:127.0.0.1:{free_port()}"
        before = Candidate("old", address, "127.0.0.1:9", 1, 1, "ardupilot", 2)
        async with console() as bench:
            started = Started("digest")
            bench.link.expect(Expected(before, time.monotonic(), True, "sidestep", started=started))
            assert bench.link.started == started
            await bench.handle(Connect(ME, address, True))
            await until(lambda: bench.status.state == "lost")
            # Whoever reads that it is off believes that somebody switched it off.
            await until(lambda: bench.of(AvoidanceStatus)[-1:] != [])
            told = bench.of(AvoidanceStatus)[-1]
            assert (told.enabled, told.state, told.by) == (True, "lost", "sidestep")
            assert "nothing brakes by itself" in told.text
            assert bench.status.adopted == before
            with pytest.raises(NoVehicleError, match="not heard the vehicle again"):
                await bench.handle(Arm(ME))
            bench.link.give_up_expected()
            await until(lambda: (bench.status.state, bench.status.adopted) == ("none", None))
            await until(lambda: not bench.of(AvoidanceStatus)[-1].enabled)
            with pytest.raises(NoVehicleError, match="No vehicle"):
                await bench.handle(Arm(ME))

    run(whole)


def test_heartbeats_go_to_a_far_end_that_the_operator_named() -> None:
    async def whole() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            sock.bind(("127.0.0.1", 0))
            sock.setblocking(False)
            async with console() as bench:
                await bench.handle(Connect(ME, f"udpout:127.0.0.1:{sock.getsockname()[1]}"))
                frame = await asyncio.get_running_loop().sock_recv(sock, 100)
                message: Any = mavlink.MAVLink(None).decode(bytearray(frame))
                assert (message.get_type(), message.type, message.autopilot) == ("HEARTBEAT", 6, 8)

    run(whole)


def test_another_ground_station_is_never_the_vehicle() -> None:
    async def whole() -> None:
        message = ground_station_heartbeat()
        async with (
            listening(adopt=True) as (bench, port),
            radio(port, message=message, system=254) as station,
        ):
            await until(lambda: bench.status.connections[0].received_messages > 3)
            assert (bench.status.adopted, bench.status.candidates) == (None, ())
            async with radio(port) as vehicle:
                await bench.live()
                assert bench.status.adopted is not None
                assert bench.status.adopted.peer == f"127.0.0.1:{vehicle.port}"
                await until(lambda: "HEARTBEAT" in vehicle.kinds())
                assert station.heard == []

    run(whole)


def test_a_twin_with_the_same_id_does_not_mix_in() -> None:
    async def whole() -> None:
        async with listening(adopt=True) as (bench, port), radio(port) as vehicle:
            await bench.live()
            async with radio(port, message=heartbeat(base_mode=ARMED, custom_mode=6)) as twin:
                await until(lambda: bench.status.warnings)
                twin.send(*[attitude(k) for k in range(20)])
                vehicle.send(attitude(5))
                await until(lambda: bench.state.attitude_t_mono_s is not None)
                assert not bench.state.armed
                assert "system id 1" in bench.status.warnings[0]
                assert twin.heard == []

    run(whole)


def test_stray_packets_between_the_vehicles_cost_no_message() -> None:
    async def whole() -> None:
        async with listening(adopt=True) as (bench, port), radio(port) as vehicle:
            await bench.live()
            before = len(bench.frames(sent=False))
            for k in range(500):
                vehicle.send(attitude(k))
                if k % 5 == 0:
                    vehicle.send_bytes(b"\xfd\xff\x00")
                await asyncio.sleep(0)
            frames = {packed(attitude(k))[10:-2] for k in range(500)}
            await until(lambda: frames <= {frame[10:-2] for frame in bench.frames(sent=False)[before:]})
            assert bench.status.connections[0].bad_bytes >= 300

    run(whole)


def test_a_vehicle_without_figures_has_none() -> None:
    async def whole() -> None:
        nan = float("nan")
        async with listening(adopt=True) as (bench, port), radio(port) as vehicle:
            await bench.live()
            vehicle.send(mavlink.MAVLink_attitude_message(1, nan, nan, nan, nan, nan, nan))
            await until(lambda: bench.state.attitude_t_mono_s is not None)
            assert (bench.state.roll_rad, bench.state.heading_rad) == (None, None)

    run(whole)


def test_a_silent_vehicle_is_lost_and_a_command_says_so() -> None:
    async def whole() -> None:
        async with listening(adopt=True) as (bench, port):
            async with radio(port):
                await bench.live()
            await until(lambda: bench.status.state == "lost")
            with pytest.raises(NoVehicleError, match="link to the vehicle is lost"):
                await bench.handle(Arm(ME))
            assert [s.state for s in bench.of(LinkStatus) if s.state == "stale"]
            async with radio(port):  # from another port of the same host
                await until(lambda: bench.status.again is not None)
                assert bench.status.state == "lost"
                again = bench.status.again
                assert again is not None
                await bench.handle(Adopt(ME, again.id))
                await bench.live()

    run(whole)


def test_commands_without_a_vehicle_are_refused() -> None:
    async def whole() -> None:
        async with console() as bench:
            for request in (Arm(ME), ReturnHome(ME), Download(ME), Upload(ME, (), 0.0, 0.0, 0.0)):
                with pytest.raises(NoVehicleError, match="No vehicle is adopted"):
                    await bench.handle(request)
            with pytest.raises(NoVehicleError, match="not heard"):
                await bench.handle(Adopt(ME, "somebody"))
            with pytest.raises(AddressError):
                await bench.handle(Connect(ME, "/etc/passwd"))
            with pytest.raises(NotAllowedError, match="no connection"):
                await bench.handle(Disconnect(ME, "tcp:127.0.0.1:5760"))

    run(whole)


def test_connecting_twice_is_connecting_once_and_disconnecting_ends_it() -> None:
    async def whole() -> None:
        async with listening(adopt=True) as (bench, port):
            await bench.handle(Connect(ME, f"udpin://127.0.0.1:{port}", True))
            assert len(bench.status.connections) == 1
            async with radio(port):
                await bench.live()
                await bench.handle(Disconnect(ME, f"udpin:127.0.0.1:{port}"))
                assert (bench.status.connections, bench.status.adopted) == ((), None)

            def is_free() -> bool:
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock, contextlib.suppress(OSError):
                    sock.bind(("127.0.0.1", port))
                    return True
                return False

            await until(is_free)

    run(whole)


def test_whoever_was_relieved_can_send_nothing() -> None:
    async def whole() -> None:
        async with listening(adopt=True) as (bench, port), radio(port) as vehicle:
            await bench.live()
            await bench.handle(Connect(Operator("Bob", 2), "udpin:127.0.0.1:1", False))
            vehicle.heard.clear()
            with pytest.raises(NotAllowedError, match="not in charge"):
                await bench.handle(ReturnHome(ME))
            assert bench.commands == []
            assert not any(m.get_type() == "COMMAND_LONG" and m.command == 176 for m in vehicle.heard)

    run(whole)


def test_without_a_console_the_heartbeat_stops_after_the_grace_and_starts_again() -> None:
    async def whole() -> None:
        age_s = 0.0
        absent = listening(adopt=True, grace_s=5.0, server_age_s=lambda: age_s)
        async with absent as (bench, port), radio(port) as vehicle:
            await bench.live()
            await until(lambda: vehicle.of("HEARTBEAT"))
            age_s = 6.0
            before = len(vehicle.of("HEARTBEAT"))
            told = len(bench.of(LinkStatus))
            await until(lambda: len(bench.of(LinkStatus)) > told + 3)
            assert len(vehicle.of("HEARTBEAT")) <= before + 1
            age_s = 0.1
            await until(lambda: len(vehicle.of("HEARTBEAT")) > before + 1)

    run(whole)


def test_a_wrong_baud_rate_is_said() -> None:
    async def whole() -> None:
        master, slave = pty.openpty()
        name = os.ttyname(slave)
        try:
            async with console() as bench:
                await bench.handle(Connect(ME, f"{name}:115200"))
                await until(lambda: bench.link.lines[f"{name}:115200"].connection.state == "open")
                assert bench.status.connections[0].state == "waiting"
                for k in range(20):
                    os.write(master, bytes((7 * k + 13 * j) % 251 for j in range(50)))
                    await asyncio.sleep(0.01)
                await until(lambda: bench.status.connections[0].error)
                error = bench.status.connections[0].error
                assert error is not None
                assert "115200 baud" in error.what
                assert "57600" in error.advice
        finally:
            os.close(master)
            os.close(slave)

    run(whole)
