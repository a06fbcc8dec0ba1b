"""Bags as robots record them, written by rosbags' own writers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KINDS = ("ros1", "db3", "mcap")
T0_NS = 1_700_000_000_000_000_000
ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
for _store in (ROS1, ROS2):
    _point = "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line"
    _sweep = (
        "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\nCustomPoint[] points"
    )
    _store.register(get_types_from_msg(_point, "livox_ros_driver2/msg/CustomPoint"))
    _store.register(get_types_from_msg(_sweep, "livox_ros_driver2/msg/CustomMsg"))
Entry = tuple[str, int, Any]
"""Topic, time of recording in ns, message (made by ``Messages``)."""


class Messages:
    """Makes messages of one of the two worlds."""

    def __init__(self, kind: str) -> None:
        self.is_ros1 = kind == "ros1"
        self.store = ROS1 if self.is_ros1 else ROS2
        self._number = 0

    def make(self, name: str, *args: Any) -> Any:
        return self.store.types[name](*args)

    def header(self, t_ns: int, frame: str) -> Any:
        stamp = self.make("builtin_interfaces/msg/Time", t_ns // 10**9, t_ns % 10**9)
        self._number += 1
        return self.make("std_msgs/msg/Header", *([self._number] if self.is_ros1 else []), stamp, frame)

    def vector(self, xyz: ArrayLike) -> Any:
        return self.make("geometry_msgs/msg/Vector3", *map(float, np.asarray(xyz)))

    def quaternion(self, q_wxyz: ArrayLike) -> Any:
        w, x, y, z = map(float, np.asarray(q_wxyz))
        return self.make("geometry_msgs/msg/Quaternion", x, y, z, w)

    def pose(self, xyz: ArrayLike, q_wxyz: ArrayLike) -> Any:
        point = self.make("geometry_msgs/msg/Point", *map(float, np.asarray(xyz)))
        return self.make("geometry_msgs/msg/Pose", point, self.quaternion(q_wxyz))

    def odometry(self, t_ns: int, world: str, base: str, xyz: ArrayLike, q_wxyz: ArrayLike) -> Any:
        pose = self.make("geometry_msgs/msg/PoseWithCovariance", self.pose(xyz, q_wxyz), np.zeros(36))
        still = self.make("geometry_msgs/msg/Twist", self.vector([0, 0, 0]), self.vector([0, 0, 0]))
        twist = self.make("geometry_msgs/msg/TwistWithCovariance", still, np.zeros(36))
        return self.make("nav_msgs/msg/Odometry", self.header(t_ns, world), base, pose, twist)

    def pose_stamped(self, t_ns: int, world: str, xyz: ArrayLike, q_wxyz: ArrayLike) -> Any:
        return self.make("geometry_msgs/msg/PoseStamped", self.header(t_ns, world), self.pose(xyz, q_wxyz))

    def tf(self, t_ns: int, parent: str, child: str, xyz: ArrayLike, q_wxyz: ArrayLike) -> Any:
        moved = self.make("geometry_msgs/msg/Transform", self.vector(xyz), self.quaternion(q_wxyz))
        one = self.make("geometry_msgs/msg/TransformStamped", self.header(t_ns, parent), child, moved)
        return self.make("tf2_msgs/msg/TFMessage", [one])

    def fix(self, t_ns: int, lat_deg: float, lon_deg: float, alt_m: float) -> Any:
        status = self.make("sensor_msgs/msg/NavSatStatus", 0, 1)
        return self.make(
            "sensor_msgs/msg/NavSatFix", self.header(t_ns, "gps"), status, lat_deg, lon_deg, alt_m, np.zeros(9), 0
        )

    def cloud(self, t_ns: int, frame: str, columns: dict[str, ArrayLike]) -> Any:
        """float32 columns, one after the other."""
        fields = [self.field(name, 4 * number, 7) for number, name in enumerate(columns)]
        data = np.column_stack([np.asarray(each, "<f4") for each in columns.values()])
        step = 4 * len(columns)
        return self.raw_cloud(t_ns, frame, fields, data.astype("<f4").tobytes(), (1, len(data)), step, step * len(data))

    def field(self, name: str, offset: int, datatype: int) -> Any:
        return self.make("sensor_msgs/msg/PointField", name, offset, datatype, 1)

    def raw_cloud(
        self, t_ns: int, frame: str, fields: list[Any], data: bytes, shape: tuple[int, int], step: int, row: int,
        *, big: bool = False,
    ) -> Any:  # fmt: skip
        return self.make(
            "sensor_msgs/msg/PointCloud2", self.header(t_ns, frame), *shape, fields, big, step, row,
            np.frombuffer(data, np.uint8), True,
        )  # fmt: skip

    def scan(self, t_ns: int, frame: str, ranges: ArrayLike, *, begin_rad: float, step_rad: float) -> Any:
        ranges_m = np.asarray(ranges, np.float32)
        return self.make(
            "sensor_msgs/msg/LaserScan", self.header(t_ns, frame), begin_rad, 0.0, step_rad, 0.0, 0.1, 0.1, 30.0,
            ranges_m, np.zeros(0, np.float32),
        )  # fmt: skip

    def livox(
        self,
        t_ns: int,
        frame: str,
        xyz: ArrayLike,
        offsets_ns: ArrayLike,
        *,
        timebase: int = 0,
        said: int | None = None,
    ) -> Any:
        rows = zip(np.asarray(offsets_ns, int).tolist(), np.asarray(xyz, float).tolist(), strict=True)
        points = [self.make("livox_ros_driver2/msg/CustomPoint", ns, *place, 10, 0, 0) for ns, place in rows]
        count = len(points) if said is None else said
        told = (self.header(t_ns, frame), timebase, count, 0, np.zeros(3, np.uint8), points)
        return self.make("livox_ros_driver2/msg/CustomMsg", *told)

    def range(self, t_ns: int, frame: str, range_m: float) -> Any:
        return self.make("sensor_msgs/msg/Range", self.header(t_ns, frame), 0, 0.1, 0.2, 40.0, range_m)


def write_bag(folder: Path, kind: str, entries: Iterable[Entry], name: str = "run") -> Path:
    """The bag's path: a file of ROS 1, a folder of ROS 2."""
    store, path = Messages(kind).store, folder / (f"{name}.bag" if kind == "ros1" else name)
    if kind == "ros1":
        writer: Any = Ros1Writer(path)
    else:
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer = Ros2Writer(path, version=9, storage_plugin=plugin)
    serialize = store.serialize_ros1 if kind == "ros1" else store.serialize_cdr
    with writer:
        connections: dict[str, Any] = {}
        for topic, t_ns, message in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=store)
            writer.write(connections[topic], t_ns, serialize(message, message.__msgtype__))
    return path
