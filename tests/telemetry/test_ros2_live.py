"""Live ROS 2 against a robot that is a process of its own and writes rmw_zenoh's wire by itself: router and peer."""

from __future__ import annotations

import itertools
import random
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from telemetry.agent.client import CloudReading, NoticeReading, RadarReading
from telemetry.agent.link_messages import Slam
from telemetry.agent.ros2_source import ROWS, Ros2Asked
from telemetry.ros2.listener import Ros2Listener
from telemetry.ros2.wire import MOST_BYTES
from telemetry.ros2.zenoh_endpoint import zenoh_address
from tests.free_ports import free_port
from tests.telemetry.ros2_bench import Process, process, reading, wait_for
from tests.telemetry.ros2_robot import CLOUD, GID, ODOM, TF, cloud, transforms

pytestmark = pytest.mark.xdist_group("ros2")
RADAR = Ros2Asked("/radar/points", "radar")
LEFT = ("left_out", "refused", "unplaced")
TARGET = {"frame": "radar", "points": [[5.0, 1.0, 0.0, -0.5, 20.0]], "names": ["x", "y", "z", "doppler", "snr"]}


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def robot(port: int) -> Iterator[Process]:
    with process(port, "peer") as made:
        yield made


def mount(robot: Process) -> None:
    """Before anybody listens: what /tf_static said once is handed to who comes late."""
    robot.do("publisher", topic="/tf_static", kind=TF, keeps=5)
    robot.do("transforms", topic="/tf_static", rows=[[time.time_ns(), "base_link", "radar", 0.5, 0.0, 0.2, np.pi / 2]])
    robot.do("publisher", topic="/radar/points", kind=CLOUD)


def send(robot: Process, **fields: Any) -> None:
    robot.do("cloud", **{"topic": "/radar/points", "stamp_ns": time.time_ns(), **TARGET, **fields})


def send_until(robot: Process, found: Any, **fields: Any) -> Any:
    """Messages are lost until both sides have met."""

    def once() -> Any:
        send(robot, **fields)
        return found()

    return wait_for(once, "what was sent")


def test_a_radars_targets_come_through_the_frames_of_the_robot(robot: Process, port: int) -> None:
    mount(robot)
    with reading(RADAR, port) as reader:
        began_s = time.monotonic()
        first: RadarReading = send_until(robot, lambda: reader.of(RadarReading))[0]
        assert first.targets == pytest.approx(np.array([[-5.0, -0.5, 0.2, -0.5, 20.0]]), abs=1e-5)  # right, forward, up
        assert began_s - 0.1 < first.t_s <= time.monotonic()
        met = reader.source.status.as_dict()  # until both have met a cloud may come before the robot's frames
        send_until(robot, lambda: any(not len(each.targets) for each in reader.of(RadarReading)), points=[])
        status = reader.source.status.as_dict()
        assert [status[left] for left in LEFT] == [met[left] for left in LEFT]
        assert not met["refused"]
        reader.wait_told("/radar/points: no message for 2 s")
        send_until(robot, lambda: any("messages come again" in each for each in reader.told))


def test_a_cloud_that_was_kept_is_not_taken_as_measured_now(robot: Process, port: int) -> None:
    """A latched cloud of before: nothing on the wire tells how old it is."""
    robot.do("publisher", topic="/tf_static", kind=TF, keeps=5)
    robot.do("transforms", topic="/tf_static", rows=[[1, "base_link", "radar", 0.0, 0.0, 0.0, 0.0]])
    robot.do("publisher", topic="/radar/points", kind=CLOUD, keeps=5)
    send(robot, points=[[77.0, 0.0, 0.0, 0.0, 20.0]])
    with reading(RADAR, port) as reader:
        assert "not read" in reader.wait_told("/radar/points: no message has come yet")
        send_until(robot, lambda: reader.of(RadarReading))
        assert {float(each.targets[0, 1]) for each in reader.of(RadarReading)} == {5.0}
        reader.wait_told("messages come again")


def test_a_peer_that_went_is_met_again(port: int) -> None:
    with process(port, "peer") as first, reading(RADAR, port) as reader:
        mount(first)
        send_until(first, lambda: reader.of(RadarReading))
        first.kill()
        reader.wait_told("is gone")
        with process(port, "peer") as second:
            mount(second)
            before = len(reader.of(RadarReading))
            send_until(second, lambda: len(reader.of(RadarReading)) > before)


def test_a_lidar_and_its_pose_by_a_router(port: int) -> None:
    asked = Ros2Asked("/lidar", "vision", "/odom")
    with process(port, "router"), process(port, "client") as robot, reading(asked, port, is_peer=False) as reader:
        robot.do("publisher", topic="/odom", kind=ODOM)
        robot.do("publisher", topic="/lidar", kind=CLOUD)
        pose = {"topic": "/odom", "parent": "odom", "child": "base_link", "x": 1.0, "y": 2.0, "z": 3.0}

        def both() -> Any:
            robot.do("odometry", stamp_ns=time.time_ns(), yaw=np.pi / 2, **pose)
            send(robot, topic="/lidar", frame="base_link", points=[[1.0, 2.0, 3.0]], names=["x", "y", "z"])
            return reader.of(Slam) and reader.of(CloudReading)

        clouds = wait_for(both, "pose and cloud")
        assert clouds[0].xyz_m == pytest.approx(np.array([[-2.0, 1.0, 3.0]]))
        slam = reader.of(Slam)[0]
        assert slam.position_m == pytest.approx((1.0, 2.0, 3.0))
        assert slam.q_wxyz == pytest.approx((1.0, 0.0, 0.0, 0.0), abs=1e-9)  # the nose to the frame's y


def test_the_router_is_lost_and_found_again(port: int) -> None:
    router = Process(port, "router")
    try:
        with process(port, "client") as robot, reading(RADAR, port, is_peer=False) as reader:
            mount(robot)
            send_until(robot, lambda: reader.of(RadarReading))
            gone_s = time.monotonic()
            router.kill()
            assert "tried again" in reader.wait_told("The router is gone")
            assert time.monotonic() - gone_s < 60.0
            wait_for(lambda: reader.of(NoticeReading), "word for the pilot")
            router = Process(port, "router")
            reader.wait_told("The router is back")
            before = len(reader.of(RadarReading))
            send_until(robot, lambda: len(reader.of(RadarReading)) > before)
            assert reader.source.status.as_dict()["interruptions"] == 1
    finally:
        router.kill()


def test_what_is_missing_is_said_with_what_to_do(robot: Process, port: int) -> None:
    robot.do("publisher", topic="/radar/points", kind=CLOUD)
    robot.do("publisher", topic="/other", kind="sensor_msgs::msg::dds_::Image_")
    robot.do("publisher", topic="/newer", kind=CLOUD, digest="RIHS01_" + "0" * 64)
    with reading(RADAR, port) as reader:
        send_until(robot, lambda: any("no transform from radar to base_link" in each for each in reader.told))
        assert "--frame" in reader.wait_told("Frames cannot be placed")
        assert reader.of(RadarReading) == []
        robot.do("publisher", topic="/tf_static", kind=TF, keeps=5)
        robot.do("transforms", topic="/tf_static", rows=[[1, "base_link", "radar", 0.0, 0.0, 0.0, 0.0]])
        first = send_until(robot, lambda: reader.of(RadarReading))[0]
        assert first.lost > 0  # what could not be placed counts as lost
        reader.wait_told("lead to the robot's frame again")
        send_until(robot, lambda: any("radial speed" in each for each in reader.told), names=["x", "y", "z", "a", "b"])
        assert "--sensor vision" in reader.wait_told("radial speed")
    for topic, words in (("/nothing", "Nobody publishes /nothing"), ("/other", "which is not read there")):
        with reading(Ros2Asked(topic, "radar"), port) as reader:
            assert "/radar/points" in reader.wait_told(words)
    with reading(Ros2Asked("/newer", "radar"), port) as reader:
        wait_for(lambda: send(robot, topic="/newer") or reader.source.status.as_dict()["refused"], "a refusal")
        reader.wait_told("its hash is RIHS01_000000000000")


def test_a_thousand_mutants_are_counted_and_harm_nothing(robot: Process, port: int) -> None:
    """Payloads of clouds and transforms, broken anywhere; what is whole is read before, between and after."""
    draw, sent = random.Random(11), 0
    mount(robot)
    robot.do("publisher", topic="/tf", kind=TF)
    whole = {
        "/radar/points": cloud(1, **TARGET),
        "/tf": transforms(
            [[1, "base_link", "radar", 0.0, 0.0, 0.0, 0.0], [2, "odom", "base_link", 1.0, 0.0, 0.0, 0.1]]
        ),
    }
    with reading(RADAR, port) as reader:
        send_until(robot, lambda: reader.of(RadarReading))
        seen = reader.source.status

        def known() -> int:
            heard = seen.listener
            bad = sum(dict(heard.refused).values()) + sum(dict(seen.left_out).values())
            return bad + seen.frames + sum(dict(seen.unplaced).values()) + sum(heard.inbox.dropped.values())

        for number in range(1000):
            topic = draw.choice(list(whole))
            data = bytearray(whole[topic])
            for _ in range(draw.randint(1, 4)):
                place = draw.randrange(len(data))
                match draw.randrange(3):
                    case 0:
                        data[place] = draw.randrange(256)
                    case 1:
                        del data[place:]
                        data += b"\x00"
                    case _:
                        data[place : place + 4] = draw.randbytes(4)
            robot.do("raw", topic=topic, payload=bytes(data).hex())
            sent += topic == "/radar/points"
            if number % 100 == 0:
                assert reader.error is None
        before = len(reader.of(RadarReading))
        send_until(robot, lambda: len(reader.of(RadarReading)) > before)
        assert known() >= sent
        assert sum(dict(seen.listener.refused).values()) > 100


def test_what_is_too_large_is_counted_and_not_read(robot: Process, port: int) -> None:
    mount(robot)
    with reading(RADAR, port) as reader:
        send_until(robot, lambda: reader.of(RadarReading))
        robot.do("zeros", topic="/radar/points", count=MOST_BYTES + 1)
        reader.wait_told("larger than 32 MB")
        robot.do("zeros", topic="/radar/points", count=4 * MOST_BYTES)
        before = len(reader.of(RadarReading))
        send_until(robot, lambda: len(reader.of(RadarReading)) > before)


def test_a_slow_reader_keeps_the_newest_and_counts_the_rest(robot: Process, port: int) -> None:
    robot.do("publisher", topic="/radar/points", kind=CLOUD)
    listener = Ros2Listener(0, {"/radar/points": ROWS["points"]})
    listener.open(zenoh_address(f"127.0.0.1:{port}", is_peer=True), tell=lambda _: None)
    try:
        stamps = itertools.count(10**18)
        sent: list[int] = []

        def dropped() -> int:
            sent.append(next(stamps))
            send(robot, stamp_ns=sent[-1])
            return listener.inbox.dropped["/radar/points"] >= 40

        wait_for(dropped, "what was dropped")
        heard = [listener.hear(0.0) for _ in range(ROWS["points"])]
        found = [each.message.header.stamp.nanosec for each in heard if each is not None]
        assert found == list(range(found[0], found[0] + ROWS["points"]))
        assert found[0] >= 40
        assert {each.gid for each in heard if each is not None} == {GID}
    finally:
        listener.close()
