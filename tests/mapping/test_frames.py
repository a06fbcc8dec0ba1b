"""Frames: the ellipsoid's tangent plane, the paper's sphere, rotations."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Transformer

from mapping.geometry.frames import (
    LocalFrame,
    SphereFrame,
    apart_m,
    attitude_rotation,
    heading_rotation,
    moved_deg,
    offset_m,
)

latitudes = st.floats(-80, 80)
longitudes = st.floats(-180, 180)
angles = st.floats(-math.pi, math.pi)
near = st.floats(-1000, 1000)


@given(latitudes, longitudes, st.floats(-100, 4000), near, near, st.floats(-200, 500))
def test_there_and_back(lat: float, lon: float, alt: float, east: float, north: float, up: float) -> None:
    p_enu = np.array([[east, north, up]])
    for frame in (LocalFrame(lat, lon, alt), SphereFrame(lat, lon, alt)):
        back = frame.to_enu(*frame.to_geodetic(p_enu).T)
        np.testing.assert_allclose(back, p_enu, atol=1e-5)
    frame = LocalFrame(lat, lon, alt)
    np.testing.assert_allclose(frame.to_tangent(*frame.from_tangent(p_enu).T), p_enu, atol=1e-5)


@pytest.mark.parametrize(("lat", "lon"), [(37.7, 15.0), (-36.8, 175.5), (0.0, 179.9999), (69.0, -20.0)])
def test_the_tangent_plane_is_projs_topocentric_frame(lat: float, lon: float) -> None:
    proj = Transformer.from_pipeline(
        "+proj=pipeline +step +proj=unitconvert +xy_in=deg +xy_out=rad +step +proj=cart +ellps=WGS84 "
        f"+step +proj=topocentric +ellps=WGS84 +lon_0={lon} +lat_0={lat} +h_0=1700"
    )
    there = LocalFrame(lat, lon, 1700.0).from_tangent([[900.0, -700.0, 120.0], [-3.0, 4.0, -5.0]])
    expected = np.column_stack(proj.transform(there[:, 1], there[:, 0], there[:, 2]))
    np.testing.assert_allclose(LocalFrame(lat, lon, 1700.0).to_tangent(*there.T), expected, atol=1e-5)


@given(latitudes, longitudes, near, near)
def test_sphere_and_ellipsoid_differ_by_less_than_a_hundredth_within_1_km(
    lat: float, lon: float, east: float, north: float
) -> None:
    """The sphere's one radius stands for two, which differ from it by 0.7 % at most."""
    ellipsoid, sphere = LocalFrame(lat, lon, 0.0), SphereFrame(lat, lon, 0.0)
    there = ellipsoid.to_geodetic([[east, north, 30.0]])
    apart_m = np.linalg.norm(sphere.to_enu(*there.T) - [[east, north, 30.0]])
    assert apart_m <= 0.0075 * math.hypot(east, north) + 0.03


def test_the_difference_at_1_km_north_of_etna() -> None:
    """At 37.7 degrees the ellipsoid's meridian is 0.2 % more curved than the mean sphere: 2.2 m within 1 km."""
    there = LocalFrame(37.72902, 14.99262, 1712.0).to_geodetic([[0.0, 1000.0, 0.0]])
    east_m, north_m, up_m = SphereFrame(37.72902, 14.99262, 1712.0).to_enu(*there.T)[0]
    assert 1.5 < north_m - 1000.0 < 3.0
    assert abs(east_m) < 0.01
    assert up_m == pytest.approx(0.0, abs=1e-6)


def test_up_is_the_height_above_home_far_away_too() -> None:
    frame = LocalFrame(37.7, 15.0, 1700.0)
    there = frame.to_geodetic([[5000.0, 0.0, 40.0]])
    assert there[0, 2] == pytest.approx(1740.0, abs=1e-4)
    assert frame.to_tangent(*there.T)[0, 2] == pytest.approx(40.0 - 5000.0**2 / (2 * 6.38e6), abs=0.02)


@given(angles, angles, angles)
def test_rotations_keep_lengths_and_handedness(heading: float, pitch: float, roll: float) -> None:
    for R in (heading_rotation(heading), attitude_rotation(heading, pitch, roll)):
        assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


def test_which_way_attitudes_turn() -> None:
    ahead, right, above = np.eye(3)[1], np.eye(3)[0], np.eye(3)[2]
    np.testing.assert_allclose(heading_rotation(math.pi / 2) @ ahead, [1, 0, 0], atol=1e-12)
    assert (attitude_rotation(1.0, 0.2, 0.0) @ ahead)[2] > 0, "nose up"
    assert (attitude_rotation(1.0, 0.0, 0.2) @ right)[2] < 0, "right wing down"
    np.testing.assert_allclose(attitude_rotation(0.7, 0, 0), heading_rotation(0.7), atol=1e-12)
    assert (attitude_rotation(0.0, 0.1, 0.0) @ above)[1] < 0


def test_the_printed_matrix_of_eq_3_is_no_rotation() -> None:
    """Why ours is not taken from print: as printed its determinant is not 1."""
    t, p, h = np.radians([2.0, 10.0, 30.0])
    ct, s_t, cp, sp, ch, sh = math.cos(t), math.sin(t), math.cos(p), math.sin(p), math.cos(h), math.sin(h)
    printed = np.array(
        [
            [ct * ch, -ct * sh, s_t],
            [cp * sh + s_t * ch * sp, cp * ch - s_t * sh * sp, -sp * ct],
            [sp * sh - ct * s_t * ch, sp * ch + ct * s_t * sh, cp * ct],
        ]
    ).T
    assert abs(np.linalg.det(printed) - 1.0) > 1e-5


@given(latitudes, st.floats(-179.9, 179.9), near, near)
def test_metres_between_two_places_are_those_of_the_ellipsoid_within_its_flattening(
    lat: float, lon: float, east: float, north: float
) -> None:
    there = moved_deg((lat, lon), east, north)
    assert offset_m((lat, lon), *there) == pytest.approx((east, north), abs=1e-6)
    exact = LocalFrame(lat, lon, 0.0).to_enu(*there, 0.0)[0, :2]
    assert math.hypot(*(exact - [east, north])) <= 0.0075 * math.hypot(east, north) + 0.03
    assert apart_m((lat, lon), there) == pytest.approx(math.hypot(east, north), abs=1e-6)


def test_metres_across_the_date_line_and_of_many_places_at_once() -> None:
    assert apart_m((0.0, 179.9995), (0.0, -179.9995)) == pytest.approx(math.radians(0.001) * 6_371_008.8)
    east_m, north_m = offset_m((45.0, 9.0), np.array([45.0, 45.001]), np.array([9.001, 9.0]))
    np.testing.assert_allclose(east_m, [78.626, 0.0], atol=1e-3)
    np.testing.assert_allclose(north_m, [0.0, 111.195], atol=1e-3)
