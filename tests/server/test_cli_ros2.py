"""``hedgehop agent --ros2`` and ``hedgehop ros2`` as programs of their own, against a robot that is another one."""

from __future__ import annotations

import asyncio
import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapping.sensor_frames import RadarFrame
from server.door.sensor_token import sensor_token
from server.settings import RUNTIME_FOLDER
from telemetry.bus.bus import Bus
from telemetry.topics.messages import Topic
from tests.free_ports import free_port
from tests.server.cli_runs import hedgehop
from tests.server.running import running
from tests.telemetry.ros2_bench import PATIENCE_S, process, wait_for
from tests.telemetry.ros2_robot import CLOUD, TF
from tests.telemetry.test_ros2_telling import state, told

pytestmark = pytest.mark.xdist_group("ros2")
HEDGEHOP = [sys.executable, "-m", "server"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--points", "/x"], "--points only means something with --ros2"),
        (["--domain", "3", "--peer", "10.0.0.7"], "--domain, --peer only means something with --ros2"),
        (["--ros2"], "Which points are to be read?"),
        (["--ros2", "--points", "/x", "--sensor", "vision"], "stands in the robot's own frame"),
        (["--ros2", "--points", "/x y"], "is no topic of ROS 2"),
        (["--ros2", "--points", "/x", "--router", "8.8.8.8"], "is on the internet"),
        (["--ros2", "--points", "/x", "--router", "10.0.0.7", "--peer", "10.0.0.8"], "two ways"),
        (["--ros2", "--points", "/x", "--domain", "233"], "The domain is 233"),
        (["--ros2", "--points", "/x", "--position2go", "/dev/null"], "are two sources"),
    ],
)
def test_wrong_options_are_refused(tmp_path: Path, options: list[str], words: str) -> None:
    token = tmp_path / "token.txt"
    token.write_text("x")
    run = hedgehop("agent", "http://127.0.0.1:9", "--token-file", token, "--json", *options)
    assert run.code != 0
    assert words in run.json["error"]["what"]
    assert run.json["error"]["advice"]


def test_topics_are_listed_with_what_can_be_read() -> None:
    port = free_port()
    nobody = hedgehop("ros2", "topics", "--router", f"127.0.0.1:{port}", "--json")
    assert nobody.code == 1
    assert "rmw_zenohd" in nobody.json["error"]["advice"]
    with process(port, "peer") as robot:
        robot.do("publisher", topic="/points", kind=CLOUD)
        robot.do("publisher", topic="/tf_static", kind=TF, keeps=5)
        robot.do("publisher", topic="/old", kind="sensor_msgs::msg::dds_::Range_")
        robot.do("publisher", topic="/new", kind=CLOUD, digest="RIHS01_" + "0" * 64)
        robot.do("publisher", topic="/image", kind="sensor_msgs::msg::dds_::Image_")
        run = hedgehop("ros2", "topics", "--peer", f"127.0.0.1:{port}", "--json")
        found = {each["topic"]: each for each in run.json["topics"]}
        read = {name: each["read"] for name, each in found.items()}
        assert read == {"/points": "yes", "/tf_static": "yes", "/old": "unchecked", "/new": "differs", "/image": "no"}
        assert found["/tf_static"]["keeps_last"]
        assert found["/points"]["publishers"] == ["/robot"]
        lines = hedgehop("ros2", "topics", "--peer", f"127.0.0.1:{port}").out
        assert "sensor_msgs/msg/PointCloud2" in lines
        assert "ANOTHER DEFINITION" in lines


def test_a_robots_radar_reaches_the_ground_station(tmp_path: Path) -> None:
    port = free_port()
    with running(tmp_path / "data") as server, process(port, "peer") as robot:
        robot.do("publisher", topic="/tf_static", kind=TF, keeps=5)
        robot.do("transforms", topic="/tf_static", rows=[[1, "base_link", "radar", 0.0, 0.0, 0.0, 0.0]])
        robot.do("publisher", topic="/radar", kind=CLOUD)
        token = tmp_path / "token.txt"
        token.write_text(sensor_token(server.settings.data_dir))
        options = ["--token-file", str(token), "--ros2", "--points", "/radar", "--peer", f"127.0.0.1:{port}", "--json"]
        command = [*HEDGEHOP, "agent", server.origin, *options]
        agent = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

        def arrived() -> list[RadarFrame]:
            names, points = ["x", "y", "z", "doppler", "snr"], [[40.0, 0.0, 1.0, 0.5, 25.0]]
            robot.do("cloud", topic="/radar", stamp_ns=time.time_ns(), frame="radar", names=names, points=points)
            return [m for topic, m in server.flying.published if topic == Topic.RADAR_FRAME]

        try:
            frame = wait_for(arrived, "a frame at the station")[0]
        finally:
            agent.send_signal(signal.SIGINT)
            out, err = agent.communicate(timeout=PATIENCE_S)
        assert agent.returncode == 0, err
        xyz_m, speed_m_s, snr_db = frame.columns()
        assert xyz_m == pytest.approx(np.array([[0.0, 40.0, 1.0]]))
        assert (speed_m_s[0], snr_db[0]) == (0.5, 25.0)
        assert abs(time.monotonic() - frame.t_mono_s) < PATIENCE_S
        counted = json.loads(out)["ros2"]
        assert counted["frames"] >= 1, err
        assert counted["refused"] == counted["left_out"] == {}


def test_a_running_station_is_told_to_the_robot(tmp_path: Path) -> None:
    port = free_port()
    missing = hedgehop("ros2", "publish", "--data-dir", tmp_path, "--json")
    assert missing.code == 2
    assert "hedgehop serve" in missing.json["error"]["advice"]
    with process(port, "router"), process(port, "client") as robot:
        robot.do("listen", pattern="0/hedgehop/**")
        poses, counts = asyncio.run(_published(robot, port, tmp_path))
        assert poses
        assert counts["pose"] >= 1


async def _published(robot: Any, port: int, folder: Path) -> tuple[list[Any], dict[str, int]]:
    async with await Bus.open(folder / RUNTIME_FOLDER, "server") as bus:
        command = [*HEDGEHOP, "ros2", "publish", "--data-dir", folder, "--router", f"127.0.0.1:{port}", "--json"]
        program = await asyncio.create_subprocess_exec(*command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        try:
            async with asyncio.timeout(PATIENCE_S):
                while not (poses := await asyncio.to_thread(told, robot, "pose")):
                    bus.publish(Topic.VEHICLE, state(time.monotonic()))
                    await asyncio.sleep(0.05)
        finally:
            program.send_signal(signal.SIGINT)
            out, _ = await program.communicate()
        assert program.returncode == 0
    return poses, json.loads(out)["told"]
