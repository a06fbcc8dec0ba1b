"""Messages of ROS 2 as bytes (CDR) and back, their definitions and the hashes of these, by rosbags.

Definitions are those that the distributions ship, never such as come with the data. Stamps are ns since 1970.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from mapping.geometry.arrays import F32, F64
from telemetry.recording.ros.bag_types import CLOUD, FIX, ODOMETRY, POSE, TF

DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
OCTOMAP = "octomap_msgs/msg/Octomap"
_OCTOMAP_FIELDS = "std_msgs/Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data\n"
"""As octomap_msgs has it; ROS's own packages do not bring it."""
_NS = 1_000_000_000
_UNKNOWN = 0
_NO_FIX, _FIX, _GPS = -1, 0, 1
"""Of sensor_msgs/NavSatStatus."""
_FLOAT32 = 7
"""Of sensor_msgs/PointField."""


class UnreadableMessageError(ValueError):
    """Bytes that are no message of the type that they are said to be."""


class Ros2Messages:
    """All that is written is little-endian and as jazzy defines it; both orders are read."""

    def __init__(self) -> None:
        self._store: Any = get_typestore(Stores.ROS2_JAZZY)
        self._store.register(get_types_from_msg(_OCTOMAP_FIELDS, OCTOMAP))
        self._humble: Any = get_typestore(Stores.ROS2_HUMBLE)

    def decoded(self, data: bytes, kind: str, *, is_humble: bool = False) -> Any:
        """Humble defines Range without its variance. Raises UnreadableMessageError; MemoryError goes through."""
        try:
            return (self._humble if is_humble else self._store).deserialize_cdr(data, kind)
        except MemoryError:
            raise
        except Exception as error:  # rosbags decodes by generated code, which fails in any way
            cause = " ".join(str(error).split())[:120] or type(error).__name__
            raise UnreadableMessageError(f"its bytes are no {kind} ({cause})") from error

    def hash_of(self, kind: str) -> str:
        """RIHS01 (REP 2011), as jazzy and later tell it."""
        return self._store.hash_rihs01(kind)

    def definition_of(self, kind: str) -> str:
        return self._store.generate_msgdef(kind, ros_version=2)[0]

    def odometry(self, stamp_ns: int, parent: str, child: str, xyz_m: F64, q_wxyz: F64) -> bytes:
        """Where ``child`` is in ``parent``; its velocities are left at 0, with a variance of -1: unknown."""
        still = self._make("geometry_msgs/msg/Twist", self._vector(np.zeros(3)), self._vector(np.zeros(3)))
        unknown = np.zeros(36)
        unknown[0] = -1.0
        return self._encoded(
            ODOMETRY, self._header(stamp_ns, parent), child,
            self._make("geometry_msgs/msg/PoseWithCovariance", self._pose(xyz_m, q_wxyz), np.zeros(36)),
            self._make("geometry_msgs/msg/TwistWithCovariance", still, unknown),
        )  # fmt: skip

    def pose(self, stamp_ns: int, parent: str, xyz_m: F64, q_wxyz: F64) -> bytes:
        return self._encoded(POSE, self._header(stamp_ns, parent), self._pose(xyz_m, q_wxyz))

    def transform(self, stamp_ns: int, parent: str, child: str, xyz_m: F64, q_wxyz: F64) -> bytes:
        moved = self._make("geometry_msgs/msg/Transform", self._vector(xyz_m), self._quaternion(q_wxyz))
        header = self._header(stamp_ns, parent)
        return self._encoded(TF, [self._make("geometry_msgs/msg/TransformStamped", header, child, moved)])

    def fix(self, stamp_ns: int, frame: str, place: tuple[float, float, float], *, has_fix: bool) -> bytes:
        """Degrees, and metres above the ellipsoid: NaN where that is not known."""
        status = self._make("sensor_msgs/msg/NavSatStatus", _FIX if has_fix else _NO_FIX, _GPS)
        return self._encoded(FIX, self._header(stamp_ns, frame), status, *place, np.zeros(9), _UNKNOWN)

    def cloud(self, stamp_ns: int, frame: str, columns: dict[str, F32]) -> bytes:
        """float32 columns, one after the other."""
        fields = [self._make("sensor_msgs/msg/PointField", name, 4 * k, _FLOAT32, 1) for k, name in enumerate(columns)]
        rows = np.column_stack(list(columns.values())).astype("<f4")
        data, step = np.frombuffer(rows.tobytes(), np.uint8), 4 * len(columns)
        is_dense = bool(np.isfinite(rows).all())
        header = self._header(stamp_ns, frame)
        return self._encoded(CLOUD, header, 1, len(rows), fields, False, step, len(data), data, is_dense)

    def octomap(self, stamp_ns: int, frame: str, resolution_m: float, data: bytes) -> bytes:
        """A binary tree: ``data`` as ``tree_data`` makes it."""
        tree = np.frombuffer(data, np.int8)
        return self._encoded(OCTOMAP, self._header(stamp_ns, frame), True, "OcTree", resolution_m, tree)

    def diagnostics(self, stamp_ns: int, statuses: list[tuple[int, str, str, str, dict[str, str]]]) -> bytes:
        """Each: level (0 OK, 1 WARN, 2 ERROR, 3 STALE), name, message, hardware, values."""
        made = [
            self._make(
                "diagnostic_msgs/msg/DiagnosticStatus", level, name, words, hardware,
                [self._make("diagnostic_msgs/msg/KeyValue", key, value) for key, value in values.items()],
            )
            for level, name, words, hardware, values in statuses
        ]  # fmt: skip
        return self._encoded(DIAGNOSTICS, self._header(stamp_ns, ""), made)

    def _encoded(self, kind: str, *values: Any) -> bytes:
        return bytes(self._store.serialize_cdr(self._make(kind, *values), kind, little_endian=True))

    def _make(self, name: str, *values: Any) -> Any:
        return self._store.types[name](*values)

    def _header(self, stamp_ns: int, frame: str) -> Any:
        time = self._make("builtin_interfaces/msg/Time", *divmod(stamp_ns, _NS))
        return self._make("std_msgs/msg/Header", time, frame)

    def _pose(self, xyz_m: F64, q_wxyz: F64) -> Any:
        point = self._make("geometry_msgs/msg/Point", *xyz_m.tolist())
        return self._make("geometry_msgs/msg/Pose", point, self._quaternion(q_wxyz))

    def _vector(self, xyz: F64) -> Any:
        return self._make("geometry_msgs/msg/Vector3", *xyz.tolist())

    def _quaternion(self, q_wxyz: F64) -> Any:
        w, x, y, z = q_wxyz.tolist()
        return self._make("geometry_msgs/msg/Quaternion", x, y, z, w)
