"""What an agent makes of messages of ROS 2, by a listener that a script speaks for: no sockets, no clock."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest

from telemetry.agent import ros2_source
from telemetry.agent.client import CloudReading, NoticeReading, RadarReading, Reading
from telemetry.agent.link_messages import Slam
from telemetry.agent.ros2_source import Ros2Asked, Ros2Source
from telemetry.recording.ros.ros2_messages import Ros2Messages
from telemetry.ros2.graph import Graph
from telemetry.ros2.listener import Heard
from telemetry.ros2.zenoh_endpoint import zenoh_address
from tests.telemetry.ros2_robot import cloud, odometry, transforms

KINDS = {"tf": "tf2_msgs/msg/TFMessage", "cloud": "sensor_msgs/msg/PointCloud2", "odom": "nav_msgs/msg/Odometry"}
T0_NS = 10**18
TARGET = [5.0, 1.0, 0.0, -0.5, 20.0]
FIELDS = ["x", "y", "z", "doppler", "snr"]
MESSAGES = Ros2Messages()


class OneSession(Graph):
    def session_of(self, topic: str, gid: bytes) -> str | None:
        return "robot"


class Scripted:
    """In place of a listener. Time goes on by what is heard."""

    def __init__(self, *heard: Heard) -> None:
        self.heard, self.now_s = list(heard), 0.0
        self.graph, self.is_connected, self.is_closed = OneSession(), True, False
        self.refused = Counter[tuple[str, str]]()
        self.since_mono_s, self.domain = 0.0, 0

    def open(self, address: object, *, tell: object) -> None:
        """It is open."""

    def close(self) -> None:
        self.is_closed = True

    def hear(self, timeout_s: float) -> Heard | None:
        if not self.heard:
            self.now_s += 1.0
            self.is_closed = True  # after this once
            return None
        self.now_s = max(self.now_s, self.heard[0].received_mono_s)
        return self.heard.pop(0)


def heard(kind: str, topic: str, payload: bytes, at_s: float, *, late_s: float = 0.0) -> Heard:
    message = MESSAGES.decoded(payload, KINDS[kind], is_humble=False)
    return Heard(topic, KINDS[kind], message, T0_NS + ns(at_s - late_s), topic.encode(), 0, at_s, 1e6 + at_s)


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


def tf(at_s: float, *rows: tuple[str, str, float], static: bool = False) -> Heard:
    """Each row: parent, child, x in metres."""
    listed: list[list[Any]] = [[T0_NS + ns(at_s), parent, child, x, 0.0, 0.0, 0.0] for parent, child, x in rows]
    return heard("tf", "/tf_static" if static else "/tf", transforms(listed), at_s)


def points(at_s: float, *rows: list[float], late_s: float = 0.0) -> Heard:
    stamp_ns = T0_NS + ns(at_s - late_s)
    data = cloud(stamp_ns, "base_link", list(rows) or [TARGET], FIELDS)
    return heard("cloud", "/points", data, at_s, late_s=late_s)


def read(
    monkeypatch: pytest.MonkeyPatch, asked: Ros2Asked, *script: Heard
) -> tuple[list[Reading], list[str], Ros2Source]:
    listener, told = Scripted(*script), list[str]()
    monkeypatch.setattr(ros2_source, "Ros2Listener", lambda *_, **__: listener)
    source = Ros2Source(asked, zenoh_address("127.0.0.1"), tell=told.append, now=lambda: listener.now_s)
    return list(source.readings()), told, source


RADAR, LIDAR = Ros2Asked("/points", "radar"), Ros2Asked("/points", "vision", "/tf")
MOVING = [tf(1.0 + 0.1 * k, ("odom", "base_link", 0.1 * k)) for k in range(4)]


def of(readings: list[Reading], kind: type) -> list[Any]:
    return [each for each in readings if isinstance(each, kind)]


def test_what_was_published_before_anybody_listened_is_not_taken_as_of_now(monkeypatch: pytest.MonkeyPatch) -> None:
    script = (tf(0.5, ("odom", "base_link", 0.0)), points(0.6, late_s=6.0), points(0.7))
    readings, told, source = read(monkeypatch, RADAR, *script)
    (frame,) = of(readings, RadarReading)
    assert frame.t_s == pytest.approx(0.7, abs=1e-6)
    assert any("before this agent listened" in each for each in told)
    assert sum(source.status.left_out.values()) == 1


def test_points_and_transforms_of_one_robot_are_laid_on_one_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """Clouds take 60 ms to come, transforms none: tokens tell that both are of one session."""
    listened = [tf(1.0, ("odom", "base_link", 0.0)), points(1.1, late_s=0.06)]
    readings, _, _ = read(monkeypatch, RADAR, *listened)
    assert of(readings, RadarReading)[0].t_s == pytest.approx(1.04, abs=1e-6)


def test_targets_without_speed_or_strength_are_left_out_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    nan, inf = float("nan"), float("inf")
    rows = [TARGET, [1.0, 0.0, 0.0, nan, 20.0], [2.0, 0.0, 0.0, 1.0, nan], [3.0, 0.0, 0.0, inf, 20.0]]
    readings, told, source = read(monkeypatch, RADAR, points(1.0, *rows), points(2.0, rows[1], rows[2]))
    (frame,) = of(readings, RadarReading)  # the second would have looked like an empty air
    assert frame.targets == pytest.approx(np.array([[-1.0, 5.0, 0.0, -0.5, 20.0]]))
    assert source.status.without_speed == 3
    assert any("without a speed or strength are left out" in each for each in told)
    assert any("--sensor vision" in each for each in told)


def test_transforms_that_never_move_tell_no_pose(monkeypatch: pytest.MonkeyPatch) -> None:
    static = tf(1.0, ("base_footprint", "base_link", 0.0), static=True)
    readings, told, source = read(monkeypatch, LIDAR, static, points(1.1), points(2.0))
    assert not of(readings, Slam) + of(readings, CloudReading)
    assert any("are static" in each for each in told)
    assert sum(source.status.unplaced.values()) >= 1


def test_a_root_that_changes_is_said_and_poses_stay_in_their_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    later = [tf(1.4 + 0.1 * k, ("odom", "base_link", 0.4 + 0.1 * k), ("map", "odom", 100.0)) for k in range(4)]
    script = (*MOVING, points(1.25), *later, points(1.65), points(1.68))
    readings, told, _ = read(monkeypatch, LIDAR, *sorted(script, key=lambda each: each.received_mono_s))
    poses = of(readings, Slam)
    assert [each.tracking for each in poses] == ["good", "lost", "good"]
    assert [each.position_m[0] for each in poses] == pytest.approx([0.25, 0.65, 0.68])
    (said,) = [each for each in told if "root" in each]
    assert "map" in said
    assert "Poses stay in odom" in said
    assert any("root" in each.text for each in of(readings, NoticeReading))


def test_each_reason_of_a_topic_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    lacking = heard("cloud", "/points", cloud(T0_NS, "base_link", [[1.0]], ["x"]), 1.0)
    wrong = heard("odom", "/points", odometry(T0_NS, "odom", "base_link", 0.0, 0.0, 0.0, 0.0), 1.1)
    _, told, source = read(monkeypatch, RADAR, lacking, wrong)
    assert any("no field" in each for each in told)
    assert any("is not what is read there" in each for each in told)
    assert len(source.status.held) >= 2
