"""Triangles of terrain and of the holes in it, and the file they travel in."""

from __future__ import annotations

import json
import struct
from io import BytesIO

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from server.scene.geometry.glb import textured_glb
from server.scene.geometry.mesh import drawn_alt_dsm_m, filled, gap_mesh, grid_mesh
from server.scene.geometry.payload import HeightGrid
from server.scene.geometry.scene_frame import LocalFrame
from server.scene.geometry.stage import plates

FRAME = LocalFrame(4.0, -3.0, 0.0, 1.0, 5.0)


def grid_of(alt: np.ndarray) -> HeightGrid:
    return HeightGrid(alt.astype(np.float32), 0.0, 0.0, 1.0)


@given(seed=st.integers(0, 2**32 - 1), unknown=st.floats(0, 0.9))
def test_terrain_and_gaps_cover_the_extent_once(seed: int, unknown: float) -> None:
    random = np.random.default_rng(seed)
    alt = random.uniform(0, 5, (6, 8))
    alt[random.random(alt.shape) < unknown] = np.nan
    grid = grid_of(alt)
    known = grid_mesh(grid, FRAME)
    gaps = gap_mesh(grid, plates(grid), FRAME) if np.isfinite(alt).any() else None
    covered = _plan_area(known) + (0.0 if gaps is None else _plan_area(gaps))
    if np.isfinite(alt).any():
        assert covered == pytest.approx(48.0, rel=1e-5)
    assert len(known.vertices) == np.isfinite(alt).sum()


def _plan_area(mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i], :2].astype(np.float64) for i in range(3))
    twice = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (twice > 0).all()  # all look up
    return float(twice.sum() / 2)


def test_a_mast_of_one_cell_keeps_its_height() -> None:
    alt = np.zeros((9, 9))
    alt[4, 4] = 30
    assert grid_mesh(grid_of(alt), FRAME).vertices[:, 2].max() == 30


def test_each_hole_lies_at_its_own_lowest_rim() -> None:
    alt = np.tile(np.arange(12.0), (5, 1))
    alt[2, 2] = alt[2, 8:10] = np.nan
    level = plates(grid_of(alt)).alt_dsm_m
    assert level[2, 2] == 1
    assert level[2, 8] == level[2, 9] == 7
    assert np.isnan(level[0]).all()


def test_marks_stand_on_the_drawn_terrain() -> None:
    alt = np.array([[0.0, 2.0, 5.0]])
    heights = drawn_alt_dsm_m(grid_of(alt), np.array([[0.5, -0.5], [1.0, -0.5], [1.5, -0.5], [9.0, -0.5]]))
    assert heights.tolist() == [0.0, 1.0, 2.0, 5.0]


def test_the_glb_is_read_back_by_another_library() -> None:
    mesh = grid_mesh(grid_of(np.arange(48.0).reshape(6, 8)), FRAME)
    data = textured_glb(mesh, np.full((12, 16, 3), 90, dtype=np.uint8))
    scene = trimesh.load(BytesIO(data), file_type="glb", process=False)
    assert isinstance(scene, trimesh.Scene)
    (read,) = scene.geometry.values()
    assert isinstance(read, trimesh.Trimesh)
    assert np.allclose(read.vertices, mesh.vertices)
    assert np.array_equal(read.faces, mesh.faces)
    _, version, length = struct.unpack_from("<III", data)
    assert (version, length) == (2, len(data))
    (head_length,) = struct.unpack_from("<I", data, 12)
    assert "KHR_materials_unlit" in json.loads(data[20 : 20 + head_length])["extensionsUsed"]


def test_holes_are_filled_with_their_plates() -> None:
    alt = np.full((3, 3), 4.0)
    alt[1, 1] = np.nan
    grid = grid_of(alt)
    assert (filled(grid, plates(grid)).alt_dsm_m == 4).all()
