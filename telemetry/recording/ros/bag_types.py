"""Which messages of ROS are understood, and how what was decoded of a bag passes from the decoding process to this one.

Type names are written as ROS 2 writes them, of ROS 1 as well. Stamps are nanoseconds since 1970.
"""

from __future__ import annotations

import numpy as np

CLOUD, SCAN, RANGE = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Range"
POINT_TYPES = frozenset({CLOUD, SCAN, RANGE})
LIVOX_TYPES = frozenset(
    f"{name}/msg/CustomMsg" for name in ("livox_ros_driver2", "livox_ros_driver", "livox_interfaces")
)
BAG_POINT_TYPES = POINT_TYPES | LIVOX_TYPES
"""Of bags; live topics are read of ``POINT_TYPES``."""
ODOMETRY, POSE = "nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped"
POSE_COVARIANCE = "geometry_msgs/msg/PoseWithCovarianceStamped"
TF, OLD_TF = "tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"
TF_TYPES = frozenset({TF, OLD_TF})
POSE_TYPES = frozenset({ODOMETRY, POSE, POSE_COVARIANCE})
FIX = "sensor_msgs/msg/NavSatFix"
OTHER_TYPES = frozenset({"sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage", "sensor_msgs/msg/Imu"})
"""Named in the table, and not decoded."""
KNOWN_TYPES = BAG_POINT_TYPES | POSE_TYPES | TF_TYPES | OTHER_TYPES | {FIX}

MOST_TOPICS, MOST_NAMES, LONGEST_NAME = 1000, 1000, 256
MOST_POINTS, MOST_ROWS = 50_000_000, 5_000_000
"""Of one reading: points of all clouds together; clouds, transforms and poses, each."""
FARTHEST_M = 1e7
"""Of any place from the origin of its frame; beyond is no place on Earth."""
MOST_LAT_DEG, MOST_LON_DEG = 90.0, 180.0
MOST_BYTES = 4_000_000_000
"""Of a file that the decoding process writes."""

POINT = np.dtype([("xyz_m", "<f8", 3), ("speed_m_s", "<f4"), ("snr_db", "<f4")])
"""In the sensor's own frame; NaN: it tells no radial speed, or no strength."""
FRAME = np.dtype([("stamp_ns", "<i8"), ("first", "<i8"), ("count", "<i8"), ("frame", "<i4")])
"""``first`` and ``count``: its points; ``frame``: a number of the list of names."""
TRANSFORM = np.dtype(
    [
        ("stamp_ns", "<i8"),
        ("parent", "<i4"),
        ("child", "<i4"),
        ("xyz_m", "<f8", 3),
        ("q_wxyz", "<f8", 4),
        ("is_static", "<i4"),
    ]
)
"""p_parent = R(q) p_child + xyz. Poses are such rows as well; a child of -1: of a frame that it does not name."""
PLACE = np.dtype([("stamp_ns", "<i8"), ("lat_deg", "<f8"), ("lon_deg", "<f8"), ("alt_ellipsoid_m", "<f8")])
TABLES = {"frames": FRAME, "points": POINT, "transforms": TRANSFORM, "poses": TRANSFORM, "places": PLACE}
"""By name; each is a file of rows."""
