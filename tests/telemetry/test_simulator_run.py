"""The simulated vehicle on sockets: reached in every way, started and stopped cleanly."""

import asyncio
import signal
import socket
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any, cast

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from planning.errors import ParameterError
from telemetry.bus.bus import Bus
from telemetry.bus.node import NodeContext
from telemetry.bus.node_lock import NodeLock
from telemetry.errors import AddressError, ConnectionFailedError
from telemetry.nodes.simulator import fly_supervised, main, read_home, read_options, read_parameter
from telemetry.simulation.simulator.airframe.gnss_script import GnssEvent
from telemetry.simulation.simulator.protocol.transports import parse_where
from telemetry.simulation.simulator.run import SimOptions, flying
from telemetry.topics.messages import Topic
from tests.telemetry.simulator_process import HOME, PATIENCE_S, child, end, simulated_vehicle
from tests.telemetry.small_bus import SmallBus

PLACE: dict[str, Any] = {
    "home_lat_deg": -37.1244507, "home_lon_deg": 175.6892878, "home_alt_amsl_m": 803.24, "boot_s": 0.5, "speedup": 5.0,
}  # fmt: skip
HEARTBEAT = wire.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
ASK_VERSION = wire.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0)


class Station:
    """A ground station on a stream or datagrams; ``old`` speaks MAVLink 1."""

    def __init__(
        self, send: Callable[[bytes], object], receive: Callable[[], Awaitable[bytes]], *, old: bool = False
    ) -> None:
        self._send, self._receive, self._old = send, receive, old
        self._out, self._in = wire.MAVLink(None, 255, 190), wire.MAVLink(None)
        self._in.robust_parsing = True

    def send(self, message: wire.MAVLink_message) -> None:
        self._send(bytes(message.pack(self._out, force_mavlink1=self._old)))

    async def wait_for(self, kind: str) -> Any:
        async with asyncio.timeout(PATIENCE_S):
            while True:
                for message in self._in.parse_buffer(await self._receive()) or []:
                    if message.get_type() == kind:
                        return message


async def by_tcp(address: str, *, old: bool = False) -> tuple[Station, asyncio.StreamWriter]:
    reader, writer = await asyncio.open_connection("127.0.0.1", int(address.rpartition(":")[2]))
    return Station(writer.write, lambda: reader.read(4096), old=old), writer


def test_several_ground_stations_by_tcp() -> None:
    async def talk() -> None:
        async with flying(SimOptions(**PLACE, link="tcpin:127.0.0.1:0")) as simulator:
            stations = [await by_tcp(simulator.address) for _ in range(3)]
            for station, _ in stations:
                assert (await station.wait_for("HEARTBEAT")).autopilot == 3
                station.send(ASK_VERSION)
                assert (await station.wait_for("AUTOPILOT_VERSION")).flight_sw_version >> 24 == 4
            for _, writer in stations:
                writer.close()
                await writer.wait_closed()

    asyncio.run(talk())


@pytest.mark.parametrize("scheme", ["udpin", "udpout"])
def test_by_udp_both_ways(scheme: str) -> None:
    async def talk() -> None:
        loop = asyncio.get_running_loop()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours:
            ours.bind(("127.0.0.1", 0))
            ours.setblocking(False)
            port = 0 if scheme == "udpin" else ours.getsockname()[1]
            async with flying(SimOptions(**PLACE, link=f"{scheme}:127.0.0.1:{port}")) as simulator:
                theirs = ("127.0.0.1", int(simulator.address.rpartition(":")[2]))

                async def receive() -> bytes:
                    nonlocal theirs
                    data, theirs = await loop.sock_recvfrom(ours, 4096)
                    return data

                station = Station(lambda data: ours.sendto(data, theirs), receive)
                if scheme == "udpin":
                    station.send(HEARTBEAT)
                await station.wait_for("HEARTBEAT")
                station.send(ASK_VERSION)
                await station.wait_for("AUTOPILOT_VERSION")

    asyncio.run(talk())


def test_a_station_that_speaks_mavlink_1_is_answered_in_it() -> None:
    async def talk() -> None:
        async with flying(SimOptions(**PLACE, link="tcpin:127.0.0.1:0")) as simulator:
            station, writer = await by_tcp(simulator.address, old=True)
            station.send(wire.MAVLink_param_request_read_message(1, 1, b"RTL_ALT", -1))
            value = await station.wait_for("PARAM_VALUE")
            assert value.get_msgbuf()[0] == wire.PROTOCOL_MARKER_V1
            writer.close()
            await writer.wait_closed()

    asyncio.run(talk())


@settings(deadline=None, max_examples=30)
@given(st.lists(st.binary(max_size=200), max_size=4))
def test_rubbish_on_the_line_does_no_harm(rubbish: list[bytes]) -> None:
    async def talk() -> None:
        async with flying(SimOptions(**PLACE, link="tcpin:127.0.0.1:0")) as simulator:
            station, writer = await by_tcp(simulator.address)
            for data in rubbish:
                writer.write(data)
            # A frame may have been begun; this many bytes end it.
            writer.write(b"\n" * 300)
            station.send(ASK_VERSION)
            station.send(ASK_VERSION)
            await station.wait_for("AUTOPILOT_VERSION")
            writer.close()
            await writer.wait_closed()

    asyncio.run(talk())


def test_simulated_time_runs_as_many_times_faster() -> None:
    async def measure() -> tuple[float, float]:
        loop = asyncio.get_running_loop()
        async with flying(SimOptions(**{**PLACE, "speedup": 10.0}, link="tcpin:127.0.0.1:0")) as simulator:
            start_s = loop.time()
            while simulator.vehicle.now_s < 5.0:
                await asyncio.sleep(0.02)
            return simulator.vehicle.now_s, loop.time() - start_s

    simulated_s, wall_s = asyncio.run(measure())
    # A busy machine makes it slower, nothing makes it faster.
    assert simulated_s <= 10.0 * wall_s + 1.0


def test_a_port_in_use_is_said() -> None:
    async def start() -> None:
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            async with flying(SimOptions(**PLACE, link=f"tcpin:127.0.0.1:{taken.getsockname()[1]}")):
                pass

    with pytest.raises(ConnectionFailedError, match="cannot be opened"):
        asyncio.run(start())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "5760",
        "tcp:127.0.0.1:5760",
        "udpin:127.0.0.1",
        "tcpin:0.0.0.0:99999",
        "/etc/passwd",
        "serial:/dev/ttyS0:9600",
    ],
)
def test_what_is_no_address_is_refused(text: str) -> None:
    with pytest.raises(AddressError, match="no address"):
        parse_where(text)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("udpout://10.0.0.2:14550", "udpout:10.0.0.2:14550"),
        ("udpin::14551", "udpin:0.0.0.0:14551"),
        (" tcpin:localhost:5760 ", "tcpin:localhost:5760"),
    ],
)
def test_addresses_come_in_both_spellings(text: str, found: str) -> None:
    assert str(parse_where(text)) == found


@pytest.mark.parametrize(
    "wrong",
    [
        {"home_lat_deg": 91.0}, {"home_lon_deg": float("nan")}, {"speedup": 0.0}, {"wind_m_s": -1.0}, {"boot_s": -1.0},
        {"endurance_s": 0.0}, {"parameters": (("NO_SUCH", 1.0),)},
    ],
)  # fmt: skip
def test_options_that_make_no_vehicle_are_refused(wrong: dict[str, Any]) -> None:
    async def start() -> None:
        async with flying(SimOptions(**{**PLACE, **wrong}, link="tcpin:127.0.0.1:0")):
            pass

    with pytest.raises(ParameterError, match="simulated vehicle"):
        asyncio.run(start())


def test_command_line_options() -> None:
    options, runtime = read_options(
        ["--home", HOME, "--speedup", "20", "--gnss", "standalone", "--parameter", "rtl_alt=3000"]
    )
    assert (options.home_lat_deg, options.home_lon_deg, options.home_alt_amsl_m) == (-37.1244507, 175.6892878, 803.24)
    assert (options.speedup, options.gnss, options.parameters) == (20.0, "standalone", (("RTL_ALT", 3000.0),))
    assert runtime is None
    for read, text in ((read_home, "1,2"), (read_home, "a,b,c"), (read_parameter, "RTL_ALT")):
        with pytest.raises(ParameterError):
            read(text)


def test_what_stands_around_and_what_fails_by_script_are_options(tmp_path: Path) -> None:
    options, _ = read_options(
        ["--home", HOME, "--world", str(tmp_path / "w.json"), "--gnss-event", "loss:60:20", "--gnss-event", "loss:1:2"]
    )
    assert options.world == tmp_path / "w.json"
    assert options.gnss_script == (GnssEvent("loss", 60.0, 20.0), GnssEvent("loss", 1.0, 2.0))


def test_a_broken_world_file_ends_it_with_the_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    world = tmp_path / "w.json"
    world.write_text('{"format": "hedgehop-world", "version": 1, "objects": [{"type": "ball"}]}', encoding="utf-8")
    assert main(["--home", HOME, "--link", "tcpin:127.0.0.1:0", "--world", str(world)]) == 2
    assert "w.json: objects[0].type" in capsys.readouterr().err


def test_a_node_tells_the_bus_where_its_vehicle_really_is(tmp_path: Path) -> None:
    bus = SmallBus()

    async def tell() -> None:
        with NodeLock(tmp_path, "simulator", []) as lock:
            options = SimOptions(**PLACE, link="tcpin:127.0.0.1:0")
            node = asyncio.ensure_future(fly_supervised(cast(Bus, bus), NodeContext(lock), options))
            try:
                async with asyncio.timeout(PATIENCE_S):
                    while len(bus.published) < 10 and not node.done():
                        await asyncio.sleep(0.01)
            finally:
                node.cancel()
                await asyncio.gather(node, return_exceptions=True)

    asyncio.run(tell())
    assert {topic for topic, _ in bus.published} == {Topic.TRUTH}
    truths = [message for _, message in bus.published]
    assert all(truth.position_enu_m == (0.0, 0.0, 0.0) and not truth.armed for truth in truths)
    assert [truth.t_mono_s for truth in truths] == sorted({truth.t_mono_s for truth in truths})


def test_a_wrong_option_ends_with_its_reason(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--home", "1,2"]) == 2
    assert "LAT,LON,ALT" in capsys.readouterr().err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_the_process_says_how_to_connect_and_stops_when_told(tmp_path: Path, number: signal.Signals) -> None:
    with simulated_vehicle(tmp_path, "--boot-s", "0.5") as (vehicle, port):
        assert f"connect with tcp:127.0.0.1:{port}" in vehicle.output()
        vehicle.process.send_signal(number)
        assert vehicle.process.wait(PATIENCE_S) == 0
        assert vehicle.output().count("\n") == 1


def test_as_a_supervised_node_it_is_there_once(tmp_path: Path) -> None:
    run = tmp_path / "run"
    run.mkdir(mode=0o700)
    arguments = [
        "-m",
        "telemetry.nodes.simulator",
        "--runtime",
        str(run),
        "--home",
        HOME,
        "--link",
        "tcpin:127.0.0.1:0",
    ]
    with child(arguments, tmp_path / "first.log") as first:
        first.wait_for("Simulated vehicle at")
        with child(arguments, tmp_path / "second.log") as second:
            assert second.process.wait(PATIENCE_S) == 3
        assert end(first.process) == 0
