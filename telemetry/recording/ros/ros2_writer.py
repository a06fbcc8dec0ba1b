"""Writes messages of ROS 2 into one MCAP file, as its own recorder does: CDR, with the messages' definitions."""

from __future__ import annotations

from pathlib import Path
from secrets import token_hex
from types import TracebackType
from typing import Any

import numpy as np
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mapping.geometry.arrays import F32, F64
from telemetry.recording.ros.bag_types import CLOUD, FIX, ODOMETRY, TF

_NS = 1_000_000_000
_UNKNOWN = 0
_NO_FIX, _FIX, _GPS = -1, 0, 1
"""Of sensor_msgs/NavSatStatus."""
_FLOAT32 = 7
"""Of sensor_msgs/PointField."""
_OCTOMAP = "octomap_msgs/msg/Octomap"
_OCTOMAP_FIELDS = "std_msgs/Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data\n"
"""As octomap_msgs has it; ROS's own packages do not bring it."""


class Ros2Writer:
    """One file; messages in any order. It is written aside, and only there when it is whole."""

    def __init__(self, path: Path, *, library: str) -> None:
        self._store: Any = get_typestore(Stores.ROS2_HUMBLE)
        self._store.register(get_types_from_msg(_OCTOMAP_FIELDS, _OCTOMAP))
        self._path, self._aside = path, path.with_name(f".tmp-{path.name}-{token_hex(8)}")
        self._file = self._aside.open("wb")
        self._writer = Writer(self._file)
        self._writer.start(profile="ros2", library=library)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self.counts: dict[str, int] = {}
        """Messages by topic."""

    def __enter__(self) -> Ros2Writer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        try:
            with self._file:
                if kind is None:
                    self._writer.finish()
            if kind is None:
                self._aside.replace(self._path)
        finally:
            self._aside.unlink(missing_ok=True)

    def odometry(self, topic: str, stamp_ns: int, parent: str, child: str, xyz_m: F64, q_wxyz: F64) -> None:
        """Where ``child`` is in ``parent``; its velocities are left at 0, with a variance of -1: unknown."""
        point = self._make("geometry_msgs/msg/Point", *xyz_m.tolist())
        there = self._make("geometry_msgs/msg/Pose", point, self._quaternion(q_wxyz))
        still = self._make("geometry_msgs/msg/Twist", self._vector(np.zeros(3)), self._vector(np.zeros(3)))
        unknown = np.zeros(36)
        unknown[0] = -1.0
        self._write(
            topic, stamp_ns, ODOMETRY, self._header(stamp_ns, parent), child,
            self._make("geometry_msgs/msg/PoseWithCovariance", there, np.zeros(36)),
            self._make("geometry_msgs/msg/TwistWithCovariance", still, unknown),
        )  # fmt: skip

    def transform(self, stamp_ns: int, parent: str, child: str, xyz_m: F64, q_wxyz: F64) -> None:
        moved = self._make("geometry_msgs/msg/Transform", self._vector(xyz_m), self._quaternion(q_wxyz))
        header = self._header(stamp_ns, parent)
        self._write("/tf", stamp_ns, TF, [self._make("geometry_msgs/msg/TransformStamped", header, child, moved)])

    def fix(self, topic: str, stamp_ns: int, frame: str, place: tuple[float, float, float], *, has_fix: bool) -> None:
        """Degrees, and metres above the ellipsoid: NaN where that is not known."""
        status = self._make("sensor_msgs/msg/NavSatStatus", _FIX if has_fix else _NO_FIX, _GPS)
        self._write(topic, stamp_ns, FIX, self._header(stamp_ns, frame), status, *place, np.zeros(9), _UNKNOWN)

    def cloud(self, topic: str, stamp_ns: int, frame: str, columns: dict[str, F32]) -> None:
        """float32 columns, one after the other."""
        fields = [self._make("sensor_msgs/msg/PointField", name, 4 * k, _FLOAT32, 1) for k, name in enumerate(columns)]
        rows = np.column_stack(list(columns.values())).astype("<f4")
        data, step = np.frombuffer(rows.tobytes(), np.uint8), 4 * len(columns)
        header = self._header(stamp_ns, frame)
        is_dense = bool(np.isfinite(rows).all())
        self._write(topic, stamp_ns, CLOUD, header, 1, len(rows), fields, False, step, len(data), data, is_dense)

    def octomap(self, topic: str, stamp_ns: int, frame: str, resolution_m: float, data: bytes) -> None:
        """A binary tree: ``data`` as ``tree_data`` makes it."""
        tree = np.frombuffer(data, np.int8)
        self._write(topic, stamp_ns, _OCTOMAP, self._header(stamp_ns, frame), True, "OcTree", resolution_m, tree)

    def _make(self, name: str, *values: Any) -> Any:
        return self._store.types[name](*values)

    def _header(self, stamp_ns: int, frame: str) -> Any:
        time = self._make("builtin_interfaces/msg/Time", *divmod(stamp_ns, _NS))
        return self._make("std_msgs/msg/Header", time, frame)

    def _vector(self, xyz: F64) -> Any:
        return self._make("geometry_msgs/msg/Vector3", *xyz.tolist())

    def _quaternion(self, q_wxyz: F64) -> Any:
        w, x, y, z = q_wxyz.tolist()
        return self._make("geometry_msgs/msg/Quaternion", x, y, z, w)

    def _write(self, topic: str, stamp_ns: int, kind: str, *values: Any) -> None:
        data = bytes(self._store.serialize_cdr(self._make(kind, *values), kind))
        self._writer.add_message(self._channel(topic, kind), log_time=stamp_ns, publish_time=stamp_ns, data=data)
        self.counts[topic] = self.counts.get(topic, 0) + 1

    def _channel(self, topic: str, kind: str) -> int:
        if kind not in self._schemas:
            definition = self._store.generate_msgdef(kind, ros_version=2)[0].encode()
            self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", definition)
        if topic not in self._channels:
            self._channels[topic] = self._writer.register_channel(topic, "cdr", self._schemas[kind])
        return self._channels[topic]
