"""The sensor link through the door: a real agent, a real server, real sockets."""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from mapping.sensor_frames import CloudFrame, RadarFrame, SlamPose, UwbScan, rows
from server.api import sensor_routes as sensors_door
from server.door.sensor_token import FILE, sensor_token
from telemetry.agent.client import Agent, CloudReading, RadarReading
from telemetry.agent.link_messages import (
    SUBPROTOCOL,
    ArrivalReport,
    Hello,
    Ping,
    Pong,
    RadarMessage,
    Slam,
    Uwb,
    Welcome,
    decode_from_server,
    encode,
)
from telemetry.errors import SensorLinkError
from telemetry.topics.messages import Topic, VehicleText
from tests.server.cli_runs import Run, hedgehop
from tests.server.running import Running, running

pytestmark = pytest.mark.xdist_group("sensor-link")
PATIENCE_S = 60.0
Driven = Callable[..., Run]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    with running(tmp_path_factory.mktemp("data")) as made:
        yield made


@pytest.fixture
def token(server: Running) -> str:
    server.flying.published.clear()
    return sensor_token(server.settings.data_dir)


def knock(server: Running, token: str, **options: Any):
    headers = {"Authorization": f"Bearer {token}"}
    address = f"ws://127.0.0.1:{server.settings.port}/api/sensors"
    options = {"origin": server.origin, "additional_headers": headers, "compression": None} | options
    return connect(address, **options)


async def until(wanted: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE_S
    while not wanted():
        assert time.monotonic() < end, "it never came"
        await asyncio.sleep(0.01)


async def send_all(server: Running, token: str, **options: Any) -> Agent:
    agent = Agent(server.origin, token=token, name="drone", **options)
    async with asyncio.TaskGroup() as group:
        task = group.create_task(agent.run())
        await until(lambda: agent.is_ready)
        for number in range(3):
            now_s = time.monotonic()
            agent.put(RadarReading(now_s, np.array([[1, 50, 0, -3, 20 + number]], np.float32)))
            agent.put(CloudReading(now_s, np.array([[0, 5, 1], [0.01, 5.01, 1.01], [3, 9, 1]], np.float32)))
            agent.put(Slam(now_s, (1.0, 2.0, float(number)), (1.0, 0.0, 0.0, 0.0), "good"))
            agent.put(Uwb(0, now_s, np.full(16, number, "<f4").tobytes(), bearing_deg=90.0))
        await until(lambda: agent.counts.report is not None and agent.counts.report.received >= 12)
        task.cancel()
    return agent


def test_frames_reach_the_bus_with_their_times(server: Running, token: str) -> None:
    agent = asyncio.run(send_all(server, token))
    published = server.flying.published
    radar = [m for topic, m in published if topic == Topic.RADAR_FRAME and isinstance(m, RadarFrame)]
    clouds = [m for topic, m in published if topic == Topic.CLOUD_FRAME and isinstance(m, CloudFrame)]
    poses = [m for topic, m in published if topic == Topic.SLAM_POSE and isinstance(m, SlamPose)]
    scans = [m for topic, m in published if topic == Topic.UWB_SCAN and isinstance(m, UwbScan)]
    assert [rows(scan.intensity, 1)[0, 0] for scan in scans] == [scan.number for scan in scans] == [0, 1, 2]
    assert all(abs(time.monotonic() - scan.t_mono_s) < PATIENCE_S and scan.source == "drone" for scan in scans)
    assert [frame.number for frame in radar] == [frame.number for frame in clouds] == [0, 1, 2]
    assert [pose.position_m[2] for pose in poses] == [0.0, 1.0, 2.0]
    # Agent and server share a clock here: what the link makes of it is off by half a round trip at most.
    assert all(abs(time.monotonic() - frame.t_mono_s) < PATIENCE_S for frame in radar)
    assert len(rows(clouds[0].xyz_m, 3)) == 2
    assert {frame.source for frame in radar} == {"drone"}
    assert agent.counts.report is not None
    assert (agent.counts.report.lost, agent.counts.report.refused) == (0, 0)


def test_a_wrong_token_or_a_foreign_page_is_refused(server: Running, token: str) -> None:
    for options in ({"additional_headers": {"Authorization": "Bearer wrong"}}, {"additional_headers": {}},
                    {"origin": "http://evil.example"}, {"origin": None}):  # fmt: skip
        with pytest.raises(InvalidStatus) as caught:
            knock(server, token, **options)
        assert caught.value.response.status_code == 403
    with pytest.raises(SensorLinkError, match="refused"):
        asyncio.run(Agent(server.origin, token="wrong", name="drone").run())
    assert server.flying.published == []


def test_a_session_alone_opens_nothing(server: Running) -> None:
    with pytest.raises(InvalidStatus):
        server.socket("/api/sensors")


def test_another_protocol_is_sent_away(server: Running, token: str) -> None:
    for first in (b"noise", encode(Hello(99, "drone")), encode(Ping(1.0))):
        with knock(server, token, subprotocols=[SUBPROTOCOL]) as socket:
            socket.send(first)
            with pytest.raises(ConnectionClosed) as caught:
                socket.recv(timeout=PATIENCE_S)
            assert caught.value.rcvd is not None
            assert caught.value.rcvd.code == 1002
    assert server.flying.published == []


def test_a_bad_frame_is_counted_and_the_next_one_passes(server: Running, token: str) -> None:
    with knock(server, token, subprotocols=[SUBPROTOCOL]) as socket:
        socket.send(encode(Hello(1, "drone")))
        assert isinstance(decode_from_server(_received(socket)), Welcome)
        socket.send(encode(Ping(5.0)))
        pong = decode_from_server(_received(socket))
        assert isinstance(pong, Pong)
        socket.send(encode(RadarMessage(0, pong.server_s + 99.0, b"")))
        socket.send(encode(RadarMessage(1, pong.server_s, b"")))
        while (report := decode_from_server(_received(socket))) and not getattr(report, "received", 0):
            pass
    assert (getattr(report, "received", 0), getattr(report, "refused", 0)) == (1, 1)
    assert [m.number for _, m in server.flying.published] == [1]


@pytest.mark.parametrize("wrong", [b"noise", msgspec.msgpack.encode({"type": "sonar", "range_m": 3.0}),
                                   msgspec.msgpack.encode({"type": "ping", "t_s": 1.0, "more": 1}), "text"],
                         ids=["noise", "unknown type", "unknown field", "text"])  # fmt: skip
def test_what_is_not_understood_is_counted_with_its_reason_and_the_connection_stays(
    server: Running, token: str, wrong: bytes | str
) -> None:
    with knock(server, token, subprotocols=[SUBPROTOCOL]) as socket:
        socket.send(encode(Hello(1, "drone")))
        assert isinstance(decode_from_server(_received(socket)), Welcome)
        socket.send(wrong)
        socket.send(encode(Ping(5.0)))
        seen = [decode_from_server(_received(socket))]
        while not (isinstance(report := seen[-1], ArrivalReport) and report.refused):
            seen.append(decode_from_server(_received(socket)))
        assert any(isinstance(message, Pong) for message in seen)
    assert (report.received, report.refused) == (0, 1)
    assert "cannot be understood" in report.text


def test_an_agent_goes_on_without_what_it_does_not_understand(server: Running, token: str) -> None:
    """A newer ground station may say more than an older agent knows."""
    encode_before = sensors_door.encode

    def with_more(message: Any) -> bytes:
        data = encode_before(message)
        return (
            msgspec.msgpack.encode(msgspec.msgpack.decode(data) | {"more": 1})
            if isinstance(message, ArrivalReport)
            else data
        )

    async def run() -> Agent:
        agent = Agent(server.origin, token=token, name="drone")
        async with asyncio.TaskGroup() as group:
            task = group.create_task(agent.run())
            await until(lambda: agent.counts.not_understood >= 2)
            task.cancel()
        return agent

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sensors_door, "encode", with_more)
        agent = asyncio.run(run())
    assert (agent.counts.connections, agent.counts.report) == (1, None)


def test_no_more_agents_than_may_be(server: Running, token: str) -> None:
    sockets = [knock(server, token) for _ in range(4)]
    try:
        for socket in sockets:
            socket.send(encode(Hello(1, "drone")))
            assert isinstance(decode_from_server(_received(socket)), Welcome)
        with knock(server, token) as fifth, pytest.raises(ConnectionClosed) as caught:
            fifth.recv(timeout=PATIENCE_S)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1013
    finally:
        for socket in sockets:
            socket.close()


def test_the_command_sends_what_a_driver_writes(server: Running, token: str, tmp_path: Path) -> None:
    file = tmp_path / "token.txt"
    file.write_text(f"{token}\n")
    lines = [json.dumps({"type": "radar", "targets": [[1, 40, 0, 0, 30]]}) for _ in range(5)]
    command = [sys.executable, "-m", "server", "agent", server.origin, "--token-file", str(file), "--json"]
    done = subprocess.run(
        command, input="\n".join(lines), capture_output=True, text=True, timeout=3 * PATIENCE_S, check=False
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["sent"], answer["received"], answer["refused"]) == (5, 5, 0)
    assert len(server.flying.published) == 5


@pytest.fixture
def driven(server: Running, token: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Driven]:
    """The command, fed with lines of a driver by a pipe."""
    file = tmp_path / "token.txt"
    file.write_text(token)
    reads, writes = os.pipe()

    def run(lines: list[str], *options: str) -> Run:
        with open(writes, "w") as driver:
            driver.write("\n".join(lines))
        return hedgehop("agent", server.origin, "--token-file", file, *options)

    with open(reads) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        yield run


def test_a_bad_line_silences_no_sensor(server: Running, driven: Driven) -> None:
    good = json.dumps({"type": "radar", "targets": [[1, 40, 0, 0, 30]]})
    far = json.dumps({"type": "cloud", "points": [[1, 2, 3], [float("nan"), 0, 0], [500, 0, 0], [0, 0, -900]]})
    done = driven([good, good[:-4], "[" * 10_000, good, far, good[:-4]], "--json")
    assert done.code == 0, done.err
    answer = done.json
    assert (answer["received"], answer["refused"]) == (3, 0)
    assert answer["lines"]["good"] == 3
    assert answer["lines"]["reasons"] == {"no JSON": 3}
    assert (answer["points_not_finite"], answer["points_out_of_reach"]) == (1, 2)
    assert done.err.count("is left out") == 1
    assert "Line 2 is left out, no JSON: " in done.err
    texts = [m.text for topic, m in server.flying.published if topic == Topic.TEXT and isinstance(m, VehicleText)]
    assert len(texts) == 1
    assert "driver: A bad line was left out. The last: line 2, no JSON" in texts[0]


def test_what_was_lost_is_told_to_people(driven: Driven) -> None:
    many = json.dumps({"type": "radar", "targets": [[1, 40, 0, 0, 30]] * 1001})
    far = json.dumps({"type": "cloud", "points": [[1, 2, 3], [float("nan"), 0, 0], [500, 0, 0]]})
    done = driven([many, "{", far])
    assert done.code == 0, done.err
    assert "points left out of clouds: 1 without numbers, 1 beyond 164 m" in done.err
    assert "refused by the ground station: 1; the last: radar: 20020 bytes are not 0 to 1000 rows" in done.err
    assert "driver: good lines 2, bad ones 1 (1 no JSON); the last: line 2, no JSON" in done.err


def test_a_driver_that_writes_nothing_else_than_bad_lines_is_wrong_input(driven: Driven) -> None:
    done = driven(["x y z", "123"], "--json")
    assert done.code == 2
    error = done.json["error"]
    assert error["where"] == "standard input"
    assert "None of the first 2 lines is a reading" in error["what"]
    assert "line 2, no JSON object" in error["what"]


def test_the_token_is_made_once_and_for_this_user_alone(tmp_path: Path) -> None:
    made = sensor_token(tmp_path)
    assert sensor_token(tmp_path) == made
    assert len(made) >= 40
    assert (tmp_path / FILE).stat().st_mode & 0o077 == 0
    (tmp_path / FILE).write_text("short")
    assert len(sensor_token(tmp_path)) >= 40


def _received(socket: Any) -> bytes:
    data = socket.recv(timeout=PATIENCE_S)
    assert isinstance(data, bytes)
    return data
