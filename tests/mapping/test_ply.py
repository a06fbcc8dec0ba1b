"""PLY files: what the header says is what the body holds."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh

from mapping.errors import ParameterError
from mapping.voxels.point_files import ply

POINTS = np.array([[512_345.678, 4_180_000.123, 91.5], [-1.0, 0.0, 2.25]])


def test_another_library_reads_points_and_colours() -> None:
    colours = np.array([[255, 0, 3], [4, 5, 6]], np.uint8)
    cloud = trimesh.load(io.BytesIO(ply(POINTS, rgb=colours)), file_type="ply")
    assert isinstance(cloud, trimesh.PointCloud)
    np.testing.assert_array_equal(cloud.vertices, POINTS)
    np.testing.assert_array_equal(cloud.colors[:, :3], colours)


def test_the_probability_stands_in_a_column_of_its_own() -> None:
    data = ply(POINTS, probability=[0.97, 0.6], comment="east, north, up in metres")
    header, body = data.split(b"end_header\n")
    assert b"comment east, north, up in metres\n" in header
    assert b"element vertex 2\n" in header
    rows = np.frombuffer(body, [("x", "<f8"), ("y", "<f8"), ("z", "<f8"), ("probability", "<f4")])
    assert rows["x"].tolist() == POINTS[:, 0].tolist()
    assert rows["probability"] == pytest.approx([0.97, 0.6])


def test_no_points_are_a_file_without_vertices() -> None:
    assert ply(np.empty((0, 3))).endswith(
        b"element vertex 0\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
    )


def test_columns_of_another_length_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"rgb: \(1, 3\) where \(2, 3\) belongs"):
        ply(POINTS, rgb=np.zeros((1, 3), np.uint8))
    with pytest.raises(ParameterError, match="probability"):
        ply(POINTS, probability=[0.5])
