"""Which radar targets are kept, and the three ways to put them into the map."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.frames import attitude_rotation, heading_rotation
from mapping.perceiving.obstacles import clusters
from mapping.radar.targets import Gate, Variant, in_gate, polar, to_enu

angles = st.floats(-0.6, 0.6)


def from_polar(range_m: np.ndarray, azimuth: np.ndarray, elevation: np.ndarray) -> np.ndarray:
    flat = range_m * np.cos(elevation)
    return np.column_stack([flat * np.sin(azimuth), flat * np.cos(azimuth), range_m * np.sin(elevation)])


@given(st.floats(1, 120), st.floats(-3, 3), st.floats(-1.5, 1.5))
def test_polar_and_back(range_m: float, azimuth: float, elevation: float) -> None:
    found = polar(from_polar(np.array([range_m]), np.array([azimuth]), np.array([elevation])))
    np.testing.assert_allclose(
        [found.range_m[0], found.azimuth_rad[0], found.elevation_rad[0]], [range_m, azimuth, elevation], atol=1e-6
    )


@pytest.mark.parametrize(
    ("azimuth_deg", "elevation_deg", "range_m", "kept"),
    [
        (0, 10, 50, True),
        (44.9, 0.1, 50, True),
        (-45.1, 10, 50, False),
        (0, -0.1, 50, False),
        (0, 20.1, 50, False),
        (0, 10, 0.2, False),
        (0, 10, 400, False),
    ],
)
def test_the_gate(azimuth_deg: float, elevation_deg: float, range_m: float, kept: bool) -> None:
    xyz = from_polar(np.array([range_m]), np.radians([azimuth_deg]), np.radians([elevation_deg]))
    assert in_gate(polar(xyz), Gate())[0] == kept


@given(st.floats(1, 120), angles, st.floats(0, 0.3), st.floats(-3, 3), angles, angles)
def test_variants(range_m: float, azimuth: float, elevation: float, heading: float, pitch: float, roll: float) -> None:
    xyz = from_polar(np.array([range_m]), np.array([azimuth]), np.array([elevation]))
    position, R = np.array([10.0, -20.0, 30.0]), attitude_rotation(heading, pitch, roll)
    level = np.array([xyz[0, 0], xyz[0, 1], 0.0])
    only, full, flat = (
        to_enu(xyz, position, R, heading, v)[0] for v in ("heading_only", "full_attitude", "full_attitude_flat")
    )
    np.testing.assert_allclose(only, position + heading_rotation(heading) @ level, atol=1e-9)
    np.testing.assert_allclose(full, position + R @ xyz[0], atol=1e-9)
    np.testing.assert_allclose(flat, position + R @ level, atol=1e-9)
    assert np.linalg.norm(full - position) == pytest.approx(range_m)
    for place in (only, flat):
        assert np.linalg.norm(place - position) == pytest.approx(range_m * math.cos(elevation)), "as measured, eq. 6"
    assert only[2] == pytest.approx(position[2]), "at the vehicle's own height"


def flown_by_a_corner_reflector(variant: Variant, *, from_m: float, to_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Targets of a reflector 3 m higher, (N, 3), and its place: towards it, with a lateral movement at the end."""
    random = np.random.default_rng(5)
    reflector, found = np.array([0.0, 68.0, 3.0]), []
    for k in range(400):
        north = 68.0 - from_m + (from_m - to_m) * min(k / 200, 1.0)
        east = 0.0 if k < 200 else 8.0 * math.sin((k - 200) / 100 * math.pi)
        position = np.array([east, north, 0.0])
        pitch, roll = np.radians(random.normal([-3.0, 0.0], 2.0))
        R = attitude_rotation(0.0, pitch, roll)
        x, y, z = R.T @ (reflector - position)
        away, azimuth, elevation = math.hypot(x, y, z), math.atan2(x, y), math.atan2(z, math.hypot(x, y))
        measured = from_polar(
            (np.floor((away + random.normal(0, 0.15, 1)) / 0.5) + 0.5) * 0.5,
            azimuth + random.normal(0, math.radians(1) / math.cos(azimuth), 1),
            elevation + random.normal(0, math.radians(7), 1),
        )
        if in_gate(polar(measured), Gate())[0]:
            found.append(to_enu(measured, position, R, 0.0, variant)[0])
    return np.array(found), reflector


@pytest.mark.parametrize(("from_m", "to_m", "within_m"), [(68.0, 60.0, 3.0), (40.0, 20.0, 1.5)])
def test_a_corner_reflector_is_one_compact_cluster(from_m: float, to_m: float, within_m: float) -> None:
    found, reflector = flown_by_a_corner_reflector("heading_only", from_m=from_m, to_m=to_m)
    aside = np.linalg.norm((found - reflector)[:, :2], axis=1)
    assert len(found) > 200
    assert (aside <= within_m).mean() >= 0.9
    voxels = (np.unique(np.floor(found), axis=0) + 0.5)[:, :]
    labels = clusters(voxels, 1.0)
    assert np.bincount(labels).max() >= 0.8 * len(voxels)


def test_measured_elevation_smears_it_vertically() -> None:
    spreads = {
        v: flown_by_a_corner_reflector(v, from_m=68.0, to_m=40.0)[0][:, 2].std()
        for v in ("heading_only", "full_attitude", "full_attitude_flat")
    }
    assert spreads["full_attitude"] > 3 * max(spreads["heading_only"], 0.5), "0.5 m: half a voxel"
    assert spreads["full_attitude_flat"] > 3 * spreads["heading_only"]
