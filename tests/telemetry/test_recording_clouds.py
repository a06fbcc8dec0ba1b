"""Clouds and radar targets in the schema of MCAP viewers: at the right place, and ours again when read."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mapping.sensor_frames import CloudFrame, RadarFrame, packed
from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.cloud_codec import CloudCodec
from telemetry.recording.mcap_files.foxglove import Standards, standard_schema

POINTS = np.array([[1.0, 10.0, 0.5], [-2.0, 5.0, -1.0]])
CLOUD = CloudFrame(5.0, 1_700_000_000.25, 7, "camera", packed(POINTS), 0.1)


def shown(data: bytes) -> np.ndarray:
    """Where a viewer draws the points: forward, left, up."""
    document = json.loads(data)
    assert [(f["name"], f["offset"], f["type"]) for f in document["fields"]] == [("x", 0, 7), ("y", 4, 7), ("z", 8, 7)]
    raw = np.frombuffer(base64.b64decode(document["data"]), "<f4").reshape(-1, document["point_stride"] // 4)
    pose = document["pose"]["orientation"]
    return Rotation.from_quat([pose[k] for k in "xyzw"]).apply(raw)


def test_a_cloud_comes_back_and_is_drawn_where_it_was() -> None:
    data = CloudCodec().encode(CLOUD)
    assert CloudCodec().decode(data) == CLOUD
    np.testing.assert_allclose(shown(data), POINTS[:, [1, 0, 2]] * [1, -1, 1], atol=1e-6)
    assert json.loads(data)["timestamp"]["sec"] == 1_700_000_000


def test_radar_targets_are_shown_too() -> None:
    frame = RadarFrame(5.0, 1e18, 7, "radar", packed(POINTS), packed(np.zeros(2)), packed(np.zeros(2)))
    (standard,) = Standards().of(frame)
    assert (standard.topic, standard.schema_name) == ("foxglove/radar", "foxglove.PointCloud")
    np.testing.assert_allclose(shown(standard.data)[:, 0], POINTS[:, 1], atol=1e-6)
    assert b"PointCloud" in standard_schema("foxglove.PointCloud")


@pytest.mark.parametrize("data", [b"", b"[]", b'{"t_mono_s": 1}', b"\xff"])
def test_what_is_no_cloud_is_said(data: bytes) -> None:
    with pytest.raises(RecordingError, match="CloudFrame"):
        CloudCodec().decode(data)
