"""Poses of cameras and what lies under a pointer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from viser import transforms

from server.scene.cameras.projection import FOV_RAD, OBLIQUE, TOP, Lens, fitted, nearest_on_path


def lens_at(pose, aspect: float) -> Lens:
    z = pose.look_at - pose.position
    z /= np.linalg.norm(z)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    R = np.column_stack([x, np.cross(z, x), z])
    return Lens.of(transforms.SO3.from_matrix(R).wxyz.astype(np.float64), pose.position, FOV_RAD, aspect)


@pytest.mark.parametrize("forward", [OBLIQUE, TOP], ids=["oblique", "top"])
@given(seed=st.integers(0, 2**32 - 1), aspect=st.floats(0.5, 3))
def test_everything_fits_and_nothing_is_wasted(forward: np.ndarray, seed: int, aspect: float) -> None:
    points = np.random.default_rng(seed).uniform([-300, -100, 0], [300, 200, 90], (20, 3))
    shares, depth = lens_at(fitted(points, forward, aspect=aspect), aspect).project(points)
    assert (depth > 0).all()
    assert (np.abs(shares - 0.5) <= 0.5).all()
    assert np.abs(shares - 0.5).max() > 0.35


def test_north_is_up_and_east_is_right() -> None:
    square = np.array([[-50.0, -50, 0], [50, -50, 0], [-50, 50, 0], [50, 50, 0]])
    lens = lens_at(fitted(square, TOP), 1.6)
    shares, _ = lens.project(np.array([[0.0, 40, 0], [40, 0, 0]]))
    assert shares[0, 1] < 0.5
    assert shares[1, 0] > 0.5


@given(share=st.floats(0.01, 0.99))
def test_the_distance_flown_under_the_pointer(share: float) -> None:
    path = np.array([[-50.0, -60, 0], [30, 80, 10]])
    lens = lens_at(fitted(path, OBLIQUE), 1.6)
    pointer = lens.project((path[0] + share * (path[1] - path[0]))[None])[0][0]
    s_m = nearest_on_path(lens, path, np.array([0.0, 100.0]), pointer, within_px=24)
    assert s_m == pytest.approx(100 * share, abs=1e-6)


def test_a_pointer_far_from_the_path_is_over_nothing() -> None:
    path = np.array([[-50.0, -60, 0], [30, 80, 10]])
    lens = lens_at(fitted(path, OBLIQUE), 1.6)
    assert nearest_on_path(lens, path, np.array([0.0, 100.0]), np.array([0.95, 0.9]), within_px=24) is None


def test_a_path_behind_the_camera_is_under_no_pointer() -> None:
    pose = fitted(np.array([[-50.0, -60, 0], [30, 80, 10]]), OBLIQUE)
    behind = pose.position - 10 * OBLIQUE + np.array([[-1.0, 0, 0], [1.0, 0, 0]])
    assert nearest_on_path(lens_at(pose, 1.6), behind, np.array([0.0, 2.0]), np.array([0.5, 0.5]), within_px=24) is None
