"""A robot of ROS 2 for tests: rmw_zenoh's wire written anew from its design text, with nothing of the product's.

``python -m tests.telemetry.ros2_robot ENDPOINT MODE`` runs one as a process of its own: it obeys lines of JSON on
standard input and answers each. CDR is packed by hand. MODE: client of a router, listening peer, or the router itself.
"""

from __future__ import annotations

import json
import math
import struct
import sys
import time
from typing import Any

import zenoh
import zenoh.ext

HASHES = {  # as ROS 2 jazzy's own message packages tell them in their generated type descriptions
    "sensor_msgs::msg::dds_::PointCloud2_": "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    "tf2_msgs::msg::dds_::TFMessage_": "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
}
CLOUD, TF = HASHES
ODOM = "nav_msgs::msg::dds_::Odometry_"
UNKNOWN = "TypeHashNotSupported"
"""Humble's."""
GID = bytes(range(16))


class Cdr:
    """Plain CDR, little-endian: each number on a multiple of its own size, counted from behind the header."""

    def __init__(self) -> None:
        self.data = bytearray()

    def put(self, kind: str, *values: float) -> Cdr:
        size = struct.calcsize("<" + kind)
        for value in values:
            self.data += bytes(-len(self.data) % size) + struct.pack("<" + kind, value)
        return self

    def text(self, words: str) -> Cdr:
        raw = words.encode() + b"\0"
        self.put("I", len(raw))
        self.data += raw
        return self

    def raw(self, data: bytes) -> Cdr:
        self.put("I", len(data))
        self.data += data
        return self

    def header(self, stamp_ns: int, frame: str) -> Cdr:
        return self.put("i", stamp_ns // 10**9).put("I", stamp_ns % 10**9).text(frame)

    def whole(self) -> bytes:
        return b"\x00\x01\x00\x00" + bytes(self.data)


def cloud(stamp_ns: int, frame: str, points: list[list[float]], names: list[str]) -> bytes:
    """PointCloud2 with float32 fields."""
    cdr = Cdr().header(stamp_ns, frame).put("I", 1, len(points)).put("I", len(names))
    for place, name in enumerate(names):
        cdr.text(name).put("I", 4 * place).put("B", 7).put("I", 1)
    step = 4 * len(names)
    cdr.put("B", 0).put("I", step, step * len(points))
    return cdr.raw(b"".join(struct.pack(f"<{len(names)}f", *row) for row in points)).put("B", 1).whole()


def transforms(rows: list[list[Any]]) -> bytes:
    """TFMessage; each row: stamp in ns, parent, child, x, y, z, yaw."""
    cdr = Cdr().put("I", len(rows))
    for stamp_ns, parent, child, x, y, z, yaw in rows:
        cdr.header(stamp_ns, parent).text(child)
        cdr.put("d", x, y, z, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))
    return cdr.whole()


def odometry(stamp_ns: int, parent: str, child: str, x: float, y: float, z: float, yaw: float) -> bytes:
    cdr = Cdr().header(stamp_ns, parent).text(child)
    cdr.put("d", x, y, z, 0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2), *[0.0] * 36)
    return cdr.put("d", *[0.0] * 6, *[0.0] * 36).whole()


def attachment(sequence: int, source_ns: int) -> bytes:
    return struct.pack("<qq", sequence, source_ns) + bytes([16]) + GID


class Robot:
    def __init__(self, endpoint: str, mode: str, domain: int = 0) -> None:
        config = zenoh.Config()
        config.insert_json5("mode", json.dumps(mode))
        way = "connect" if mode == "client" else "listen"
        config.insert_json5(f"{way}/endpoints", json.dumps([endpoint]))
        for setting in ("scouting/multicast/enabled", "scouting/gossip/enabled"):
            config.insert_json5(setting, "false")
        config.insert_json5("timestamping/enabled", "true")
        self.session, self.domain = zenoh.open(config), domain
        self.zid = str(self.session.zid())
        self.kept: list[Any] = []
        self.publishers: dict[str, tuple[Any, int]] = {}
        self.token(f"@ros2_lv/{domain}/{self.zid}/0/0/NN/%/%/robot")
        self.heard: list[dict[str, Any]] = []

    def token(self, text: str) -> None:
        self.kept.append(self.session.liveliness().declare_token(text))

    def publisher(self, topic: str, kind: str, digest: str = "", *, keeps: int = 0, node: str = "robot") -> None:
        digest = digest or HASHES.get(kind, UNKNOWN)
        key = f"{self.domain}/{topic.strip('/')}/{kind}/{digest}"
        self.publishers[topic] = (
            zenoh.ext.declare_advanced_publisher(
                self.session,
                key,
                congestion_control=zenoh.CongestionControl.BLOCK,
                cache=zenoh.ext.CacheConfig(max_samples=keeps) if keeps else None,
                publisher_detection=True if keeps else None,
            ),
            0,
        )
        number, qos = len(self.publishers) + 1, f":{1 if keeps else ''}:,{keeps or 5}:,:,:,,"
        head = f"@ros2_lv/{self.domain}/{self.zid}/0/{number}/MP/%/%/{node}"
        self.token(f"{head}/{topic.replace('/', '%')}/{kind}/{digest}/{qos}")

    def put(
        self, topic: str, payload: bytes, *, source_ns: int = 0, sequence: int = 0, beside: bytes | None = None
    ) -> None:
        publisher, last = self.publishers[topic]
        number = sequence or last + 1
        self.publishers[topic] = (publisher, number)
        publisher.put(payload, attachment=attachment(number, source_ns or time.time_ns()) if beside is None else beside)

    def listen(self, pattern: str) -> None:
        def hear(sample: Any) -> None:
            beside = sample.attachment.to_bytes().hex() if sample.attachment else ""
            self.heard.append(
                {"key": str(sample.key_expr), "payload": sample.payload.to_bytes().hex(), "beside": beside}
            )

        history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=10)
        self.kept.append(zenoh.ext.declare_advanced_subscriber(self.session, pattern, hear, history=history))

    def tokens(self) -> list[str]:
        return [str(r.ok.key_expr) for r in self.session.liveliness().get(f"@ros2_lv/{self.domain}/**") if r.ok]


def obey(robot: Robot, order: dict[str, Any]) -> Any:
    match order.pop("do"):
        case "publisher":
            robot.publisher(**order)
        case "cloud":
            topic = order.pop("topic")
            robot.put(topic, cloud(**order))
        case "transforms":
            topic = order.pop("topic")
            robot.put(topic, transforms(**order))
        case "odometry":
            topic = order.pop("topic")
            robot.put(topic, odometry(**order))
        case "raw":
            robot.put(order["topic"], bytes.fromhex(order["payload"]))
        case "zeros":
            robot.put(order["topic"], bytes(order["count"]))
        case "listen":
            robot.listen(order["pattern"])
        case "heard":
            return robot.heard
        case "tokens":
            return robot.tokens()
    return None


def main() -> None:
    robot = Robot(sys.argv[1], sys.argv[2])
    print(json.dumps("ready"), flush=True)
    for line in sys.stdin:
        print(json.dumps(obey(robot, json.loads(line))), flush=True)
    robot.session.close()


if __name__ == "__main__":
    main()
