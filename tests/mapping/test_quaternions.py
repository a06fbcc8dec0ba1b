"""Quaternions against rotation matrices and scipy."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation, Slerp

from mapping.geometry import quaternions
from mapping.geometry.frames import attitude_rotation

angles = st.floats(-3.1, 3.1)
attitudes = st.tuples(angles, st.floats(-1.5, 1.5), angles)


@given(angles, angles, angles)
def test_the_same_rotation_as_the_matrix(heading: float, pitch: float, roll: float) -> None:
    q = quaternions.from_attitude(heading, pitch, roll)
    np.testing.assert_allclose(quaternions.rotation(q), attitude_rotation(heading, pitch, roll), atol=1e-12)
    assert np.linalg.norm(q) == pytest.approx(1.0)


@given(attitudes, attitudes)
def test_products_turn_one_after_the_other(a: tuple[float, ...], b: tuple[float, ...]) -> None:
    q, p = quaternions.from_attitude(*a), quaternions.from_attitude(*b)
    both = quaternions.rotation(quaternions.product(q, p))
    np.testing.assert_allclose(both, quaternions.rotation(q) @ quaternions.rotation(p), atol=1e-12)


@given(attitudes, attitudes, st.floats(0, 1))
def test_slerp_is_scipys(a: tuple[float, ...], b: tuple[float, ...], share: float) -> None:
    q, p = quaternions.from_attitude(*a), quaternions.from_attitude(*b)
    ends = Rotation.from_quat([np.roll(q, -1), np.roll(p, -1)])
    between = ends[0].inv() * ends[1]
    if between.magnitude() > 3.1:  # half a turn: two ways are equally short
        return
    expected = Slerp([0, 1], ends)([share])[0]
    ours = Rotation.from_quat(np.roll(quaternions.slerp(q, p, share), -1))
    assert (ours.inv() * expected).magnitude() < 1e-5


@given(st.floats(-1.4, 1.4), st.floats(-1.4, 1.4), st.floats(0, 6.28))
def test_heading_of_the_nose(pitch: float, roll: float, heading: float) -> None:
    found = quaternions.heading(attitude_rotation(heading, pitch, roll))
    assert math.remainder(found - heading, 2 * math.pi) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)])
def test_what_is_no_rotation_is_refused(q: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="finite quaternion"):
        quaternions.rotation(q)
