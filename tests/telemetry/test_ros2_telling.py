"""What Hedgehop tells a robot of ROS 2, as the robot's own process hears it; and a recording replayed over the wire."""

from __future__ import annotations

import asyncio
import contextlib
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xxhash
from mcap.reader import make_reader

from mapping.geometry.arrays import F32
from telemetry.agent.client import CloudReading
from telemetry.agent.link_messages import Slam
from telemetry.agent.ros2_source import Ros2Asked
from telemetry.bus.bus import Bus
from telemetry.recording.ros.ros2_messages import Ros2Messages
from telemetry.recording.ros.ros2_writer import Ros2Writer
from telemetry.ros2.telling import Ros2Teller
from telemetry.ros2.wire import Ros2Wire
from telemetry.ros2.zenoh_endpoint import zenoh_address
from telemetry.topics.messages import Topic
from telemetry.topics.obstacles import MapDelta, MapOrigin, ObstacleAlert, pack_keys
from telemetry.topics.vehicle import VehicleState
from tests.free_ports import free_port
from tests.telemetry.ros2_bench import PATIENCE_S, Process, process, reading, wait_for
from tests.telemetry.ros2_robot import CLOUD, HASHES, ODOM

pytestmark = pytest.mark.xdist_group("ros2")
HOME = (46.5, 7.5, 1200.0)


def told(robot: Process, name: str) -> list[dict[str, Any]]:
    """That the robot heard under one topic."""
    return [each for each in robot.do("heard") if f"/hedgehop/{name}/" in f"/{each['key']}"]


async def soon(robot: Process, name: str, again: Any) -> dict[str, Any]:
    async with asyncio.timeout(PATIENCE_S):
        while True:
            again()
            if found := await asyncio.to_thread(told, robot, name):
                return found[-1]
            await asyncio.sleep(0.02)


def state(now_s: float) -> VehicleState:
    return VehicleState(
        1, 1, position_t_mono_s=now_s, attitude_t_mono_s=now_s, lat_deg=HOME[0], lon_deg=HOME[1], alt_rel_home_m=12.5,
        gnss_fix="rtk_fixed", gnss_alt_ellipsoid_m=1260.0, roll_rad=0.0, pitch_rad=0.0, heading_rad=0.0,
        home_lat_deg=HOME[0], home_lon_deg=HOME[1], home_alt_amsl_m=HOME[2],
    )  # fmt: skip


def map_delta(keys: list[tuple[int, int, int]], revision: int, since: int, *, whole: bool) -> MapDelta:
    count = len(keys)
    return MapDelta(
        "radar", 1.0, 1.0, revision, whole, 0, 1, MapOrigin(*HOME), 1.0, pack_keys(np.array(keys, np.int32)),
        bytes([255] * count), bytes(count), since,
    )  # fmt: skip


def test_pose_fix_alerts_and_voxels_are_heard_with_tokens_and_hashes(tmp_path: Path) -> None:
    port = free_port()
    with process(port, "router"), process(port, "client") as robot:
        asyncio.run(_told_and_heard(robot, port, tmp_path))


async def _told_and_heard(robot: Process, port: int, folder: Path) -> None:
    alert = ObstacleAlert("a1", "radar", "obstacle", "begins", 1.0, 1e9, 1.0, "Obstacle 8 m ahead")
    address = zenoh_address(f"127.0.0.1:{port}")
    with Ros2Wire.open(address, changed=lambda _: None) as wire:
        teller = Ros2Teller(wire, domain=0)
        async with await Bus.open(folder / "run", "ros2") as bus, await Bus.open(folder / "run", "server") as server:
            running = asyncio.ensure_future(teller.run(bus))
            try:
                # Alerts are kept for who comes late: nobody listens yet.
                async with asyncio.timeout(PATIENCE_S):
                    while not teller.counts["alerts"]:
                        server.publish(Topic.ALERT, alert)
                        await asyncio.sleep(0.02)
                robot.do("listen", pattern="0/hedgehop/**")
                heard = await soon(robot, "alerts", lambda: None)
                assert b"Obstacle 8 m ahead\0" in bytes.fromhex(heard["payload"])
                _check_beside(robot, heard, "alerts")
                pose = await soon(robot, "pose", lambda: server.publish(Topic.VEHICLE, state(time.monotonic())))
                body = bytes.fromhex(pose["payload"])[-56:]  # three and four doubles end a PoseStamped
                x, y, z, qx, qy, qz, qw = struct.unpack("<7d", body)
                assert (x, y, z) == pytest.approx((0.0, 0.0, 12.5), abs=1e-6)
                assert (qx, qy, abs(qz), abs(qw)) == pytest.approx((0.0, 0.0, 0.5**0.5, 0.5**0.5))  # nose to the north
                fix = await soon(robot, "fix", lambda: None)
                assert struct.pack("<3d", HOME[0], HOME[1], 1260.0) in bytes.fromhex(fix["payload"])
                # A map that is not known from its beginning is not told.
                server.publish(Topic.MAP_RADAR, map_delta([(9, 9, 9)], 7, 6, whole=False))
                server.publish(Topic.MAP_RADAR, map_delta([(1, 2, 3)], 8, 0, whole=True))
                server.publish(Topic.MAP_RADAR, map_delta([(4, 5, 6)], 9, 8, whole=False))
                voxels = await soon(robot, "voxels/radar", lambda: None)
                assert voxels["key"].endswith(f"{CLOUD}/{HASHES[CLOUD]}")
                data = bytes.fromhex(voxels["payload"])
                assert struct.pack("<3f", 1.5, 2.5, 3.5) in data
                assert struct.pack("<3f", 9.5, 9.5, 9.5) not in data
            finally:
                running.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await running


def _check_beside(robot: Process, heard: dict[str, Any], name: str) -> None:
    """The attachment's GID is the hash of the publisher's token, as rmw_zenoh makes it of the token that it sees."""
    beside = bytes.fromhex(heard["beside"])
    assert len(beside) == 33
    tokens = robot.do("tokens")
    assert any("/NN/%/%/hedgehop" in token for token in tokens)
    own = next(token for token in tokens if f"/MP/%/%/hedgehop/%hedgehop%{name}/" in token)
    digest = xxhash.xxh3_128(own.encode()).digest()  # the higher half first, big-endian
    assert beside[17:] == digest[::-1]
    assert abs(struct.unpack("<q", beside[8:16])[0] / 1e9 - time.time()) < 60.0
    assert own.split("/")[10:12] == heard["key"].split("/")[-2:]
    assert own.endswith("/:1:,10:,:,:,,")


def test_a_recorded_bag_replayed_over_the_wire_is_read_as_it_was_written(tmp_path: Path) -> None:
    """Bytes of a bag as the recorder writes them, sent by the robot's own process."""
    bag, port = tmp_path / "walk.mcap", free_port()
    points: F32 = np.array([[3.0, 1.0, 0.5], [8.0, -2.0, 1.5]], np.float32)
    with Ros2Writer(bag, library="test") as writer:
        columns = {"x": points[:, 0], "y": points[:, 1], "z": points[:, 2]}
        for second in range(5):
            stamp_ns, still = second * 10**9 + 10**18, np.array([1.0, 0.0, 0.0, 0.0])
            where = np.array([float(second), 0.0, 2.0])
            writer.odometry("/odom", stamp_ns, "home", "base_link", where, still)
            writer.cloud("/camera/points", stamp_ns + 1, "base_link", columns)
    asked = Ros2Asked("/camera/points", "vision", "/odom")
    hashes = Ros2Messages()
    with process(port, "peer") as robot, reading(asked, port, is_peer=True) as reader:
        robot.do("publisher", topic="/odom", kind=ODOM, digest=hashes.hash_of("nav_msgs/msg/Odometry"))
        robot.do("publisher", topic="/camera/points", kind=CLOUD)

        def played() -> Any:
            with bag.open("rb") as file:
                for _, channel, message in make_reader(file).iter_messages():
                    robot.do("raw", topic=channel.topic, payload=message.data.hex())
            return len(reader.of(CloudReading)) >= 5 and len(reader.of(Slam)) >= 1

        wait_for(played, "the bag")
        for each in reader.of(CloudReading):
            assert each.xyz_m == pytest.approx(np.column_stack([-points[:, 1], points[:, 0], points[:, 2]]))
        assert {each.position_m[2] for each in reader.of(Slam)} == {2.0}
        status = reader.source.status.as_dict()
        assert status["odd_stamps"] > 0  # of 2001: they count as measured when they were sent
        reader.wait_told("stamps are of another clock")
