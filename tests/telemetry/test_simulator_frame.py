"""Coordinates of the simulated world."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod

from telemetry.simulation.simulator.neu_frame import NeuFrame

places = st.tuples(st.floats(-84, 84), st.floats(-180, 180), st.floats(-100, 4000))
metres = st.floats(-3000, 3000)


@settings(deadline=None)
@given(places, metres, metres, metres)
def test_there_and_back(place: tuple[float, float, float], north_m: float, east_m: float, up_m: float) -> None:
    frame = NeuFrame(*place)
    back = frame.neu_from_geodetic(*frame.geodetic_from_neu((north_m, east_m, up_m)))
    assert np.allclose(back, (north_m, east_m, up_m), atol=1e-4)


@settings(deadline=None)
@given(st.floats(-70, 70), st.floats(-179, 179), st.floats(-1000, 1000), st.floats(-1000, 1000))
def test_distances_are_those_of_the_ellipsoid(lat: float, lon: float, north_m: float, east_m: float) -> None:
    frame = NeuFrame(lat, lon, 0.0)
    there = frame.geodetic_from_neu((north_m, east_m, 0.0))
    _, _, distance_m = Geod(ellps="WGS84").inv(lon, lat, there[1], there[0])
    assert abs(distance_m - np.hypot(north_m, east_m)) < 0.5 + 2e-4 * distance_m


def test_crosses_the_date_line() -> None:
    lat, lon, _ = NeuFrame(0.0, 179.9999, 0.0).geodetic_from_neu((0.0, 100.0, 0.0))
    assert lat == 0
    assert -180 <= lon < -179.99
