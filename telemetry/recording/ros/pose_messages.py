"""Poses and transforms of ROS as shift and rotation. Runs in the decoding process, and where topics are heard live."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from mapping.geometry.arrays import F64
from telemetry.recording.ros.bag_types import FARTHEST_M, ODOMETRY, POSE
from telemetry.recording.ros.point_messages import MalformedMessageError


@dataclass(frozen=True, slots=True)
class PoseFound:
    """p_parent = R(q) p_child + xyz"""

    parent: str
    child: str
    """Empty: the message does not name it."""
    xyz_m: F64
    q_wxyz: F64
    """Of length 1."""


def frame_name(text: object) -> str:
    """Without the slash that ROS 1 wrote before it."""
    return str(text).lstrip("/")


def stamp_ns_of(header: Any) -> int:
    """0 for a header that tells no time."""
    return int(header.stamp.sec) * 1_000_000_000 + int(header.stamp.nanosec)


def pose_of(message: Any, kind: str) -> PoseFound:
    """Of any of ``bag_types.POSE_TYPES``. Raises MalformedMessageError."""
    pose = message.pose if kind == POSE else message.pose.pose
    child = frame_name(message.child_frame_id) if kind == ODOMETRY else ""
    return found(message.header, child, pose.position, pose.orientation)


def transform_of(each: Any) -> PoseFound:
    """Of one TransformStamped. Raises MalformedMessageError."""
    child = frame_name(each.child_frame_id)
    return found(each.header, child, each.transform.translation, each.transform.rotation)


def found(header: Any, child: str, shift: Any, turn: Any) -> PoseFound:
    """Raises MalformedMessageError for what is no rotation and shift."""
    xyz_m = np.array((shift.x, shift.y, shift.z), np.float64)
    q_wxyz = np.array((turn.w, turn.x, turn.y, turn.z), np.float64)
    is_near = bool((np.abs(xyz_m) <= FARTHEST_M).all() and (np.abs(q_wxyz) < 2.0).all())  # NaN is not
    length = float(np.linalg.norm(q_wxyz)) if is_near else 0.0
    if abs(length - 1.0) >= 0.1:
        raise MalformedMessageError(f"a transform to {child[:40]!r} is no rotation and shift")
    return PoseFound(frame_name(header.frame_id), child, xyz_m, q_wxyz / length)
