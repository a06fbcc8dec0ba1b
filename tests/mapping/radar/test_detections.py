"""Places between cells, and the coordinates of what was found."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.radar.detections import Detections, between_cells
from mapping.radar.targets import polar


@given(st.floats(-0.45, 0.45), st.floats(-0.45, 0.45), st.integers(0, 15), st.integers(2, 20))
def test_a_top_between_cells(across: float, along: float, d: int, c: int) -> None:
    doppler = (np.arange(16) - d - across + 8) % 16 - 8
    ranges = np.arange(24) - c - along
    power = np.exp(-0.5 * (doppler[:, None] ** 2 + ranges[None, :] ** 2)).astype(np.float32)
    places = between_cells(power, np.array([[d, c]]))
    assert -8.0 <= places[0][0] < 8.0
    assert math.remainder(places[0][0] - d - across, 16) == pytest.approx(0.0, abs=1e-3)
    assert places[1][0] == pytest.approx(c + along, abs=1e-3)


def test_at_the_ends_of_the_range_and_with_one_chirp() -> None:
    power = np.array([[9.0, 1.0, 1.0, 9.0]], np.float32)
    doppler, ranges = between_cells(power, np.array([[0, 0], [0, 3]]))
    np.testing.assert_array_equal(doppler, [0.0, 0.0])
    np.testing.assert_array_equal(ranges, [0.0, 3.0])


def test_coordinates_and_picking() -> None:
    found = Detections(
        np.array([10.0, 20.0]),
        np.array([0.0, 1.0]),
        np.array([math.pi / 2, 0.1]),
        np.array([0.0, 0.2]),
        np.array([30.0, 20.0]),
        np.array([[0, 10], [1, 20]]),
    )
    np.testing.assert_allclose(found.xyz_m[0], [10.0, 0.0, 0.0], atol=1e-12)
    back = polar(found.xyz_m)
    np.testing.assert_allclose(back.azimuth_rad, found.azimuth_rad)
    np.testing.assert_allclose(back.elevation_rad, found.elevation_rad, atol=1e-12)
    second = found.where(np.array([False, True]))
    assert len(second) == 1
    assert second.range_m[0] == 20.0
