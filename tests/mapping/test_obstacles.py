"""Clusters of voxels as a vehicle sees them, and the polar display."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from mapping.perceiving.obstacles import MOST_VOXELS, SECTORS, clusters, obstacles, sweep, time_to_contact_s

ORIGIN, STILL = np.zeros(3), np.zeros(3)
cells = st.lists(st.tuples(*[st.integers(0, 7)] * 3), min_size=1, max_size=60, unique=True)


@given(cells, st.sampled_from([0.5, 1.0]))
def test_clusters_are_scipys(keys: list[tuple[int, int, int]], resolution_m: float) -> None:
    filled = np.zeros((8, 8, 8), bool)
    filled[tuple(np.array(keys).T)] = True
    expected = np.empty(filled.shape, np.int32)
    count = ndimage.label(filled, np.ones((3, 3, 3)), output=expected)
    labels = clusters((np.array(keys) + 0.5) * resolution_m, resolution_m)
    pairs = {(int(a), int(b)) for a, b in zip(labels, expected[tuple(np.array(keys).T)], strict=True)}
    assert len(pairs) == count == labels.max() + 1


def test_what_is_told_of_an_obstacle() -> None:
    centres = np.array([[3.5, 4.5, 0.5], [3.5, 4.5, 1.5], [4.5, 4.5, 1.5], [-20.5, 0.5, 0.5]])
    wall, other = obstacles(
        centres,
        region="roi",
        resolution_m=1.0,
        position_enu_m=np.array([0.5, 0.5, 0.5]),
        velocity_enu_m_s=np.array([0.0, 2.0, 0.0]),
        heading_rad=0.1,
    )
    assert wall.distance_m == pytest.approx(5.0)
    assert wall.bearing_rad == pytest.approx(math.atan2(3, 4))
    assert wall.off_nose_rad == pytest.approx(math.atan2(3, 4) - 0.1)
    assert wall.height_difference_m == pytest.approx(1.5)
    assert wall.time_to_contact_s == pytest.approx(5.0 / (2.0 * 0.8))
    assert (wall.voxels, wall.size_m) == (3, (2.0, 1.0, 2.0))
    assert (other.voxels, other.time_to_contact_s) == (1, None)
    assert other.off_nose_rad == pytest.approx(-math.pi / 2 - 0.1)


def test_nothing_and_very_much() -> None:
    shared = {
        "region": "roi",
        "resolution_m": 1.0,
        "position_enu_m": ORIGIN,
        "velocity_enu_m_s": STILL,
        "heading_rad": 0.0,
    }
    assert obstacles(np.empty((0, 3)), **shared) == []
    wall = np.stack(np.meshgrid(np.arange(80), [30], np.arange(80)), axis=-1).reshape(-1, 3) + 0.5
    (found,) = obstacles(wall, **shared)
    assert found.voxels == MOST_VOXELS
    assert found.distance_m == pytest.approx(math.sqrt(30.5**2 + 0.5))


@given(st.tuples(*[st.floats(-50, 50)] * 3), st.tuples(*[st.floats(-20, 20)] * 3))
def test_time_to_contact_is_the_time_to_the_nearest_plane(towards: tuple, velocity: tuple) -> None:
    away, v = np.array(towards), np.array(velocity)
    seconds = time_to_contact_s(away, v)
    if seconds is None:
        assert v @ away <= 0.1 * np.linalg.norm(away) + 1e-9
    else:
        assert seconds >= 0
        assert seconds * (v @ away) == pytest.approx(float(away @ away), rel=1e-6)


@given(st.lists(st.tuples(st.floats(-60, 60), st.floats(-60, 60), st.floats(-9, 9)), max_size=40), st.floats(0, 6.28))
def test_sweep_against_one_sector_at_a_time(places: list[tuple[float, float, float]], heading: float) -> None:
    points = np.array(places).reshape(-1, 3)
    nearest = sweep(points, position_enu_m=ORIGIN, heading_rad=heading)
    assert len(nearest) == SECTORS
    off = np.degrees(np.arctan2(points[:, 0], points[:, 1]) - heading)
    low = np.abs(points[:, 2]) <= 5
    for k, found in enumerate(nearest):
        beside = np.abs((off - 5 * k + 180) % 360 - 180)
        certain = low & (beside < 2.4999)
        possible = low & (beside < 2.5001)
        away = np.hypot(points[:, 0], points[:, 1])
        if found is None:
            assert not certain.any()
        else:
            assert away[possible].min() - 1e-9 <= found <= (away[certain].min() if certain.any() else found) + 1e-9
