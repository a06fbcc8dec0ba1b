"""The generated scene holds what the demo promises."""

import numpy as np
import pytest
from scipy import ndimage

from planning.ground.demo_hillside import demo_dsm, demo_pois, demo_survey_polygon, small_hill
from planning.terrain.dsm import Dsm
from planning.terrain.spikes import find_spikes
from planning.terrain.vertical_datum import is_amsl


@pytest.fixture(scope="module")
def dsm() -> Dsm:
    return demo_dsm()


@pytest.fixture(scope="module")
def route_xy_m(dsm: Dsm) -> np.ndarray:
    """The route, a point every half metre."""
    corners = dsm.xy_from_lat_lon(np.array([[poi.lat_deg, poi.lon_deg] for poi in demo_pois()]))
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))])
    along = np.arange(0.0, s[-1], 0.5)
    return np.column_stack([np.interp(along, s, corners[:, 0]), np.interp(along, s, corners[:, 1])])


def test_grid_datum_and_place(dsm: Dsm) -> None:
    assert dsm.elevation_m.shape == (1000, 1000)
    assert dsm.resolution_m == 0.5
    assert dsm.crs.to_epsg() == 32633
    assert is_amsl(dsm.vertical_datum)
    lat, lon = dsm.lat_lon_from_xy(np.array([dsm.bounds_m[:2]]))[0]
    assert (lat, lon) == pytest.approx((37.73, 14.99), abs=0.01)
    assert 1600 < np.nanmin(dsm.elevation_m) < np.nanmax(dsm.elevation_m) < 1850


def test_the_same_seed_gives_the_same_scene(dsm: Dsm) -> None:
    np.testing.assert_array_equal(demo_dsm(7).elevation_m, dsm.elevation_m)
    assert demo_dsm(7).sha256 == dsm.sha256
    assert demo_dsm(8).sha256 != dsm.sha256


def test_one_small_hole_and_one_patch_at_the_edge(dsm: Dsm) -> None:
    labels, count = ndimage.label(np.isnan(dsm.elevation_m))  # pyright: ignore[reportGeneralTypeIssues]
    areas_m2 = sorted(np.bincount(labels.ravel())[1:] * dsm.resolution_m**2)
    assert count == 2
    assert areas_m2[0] == 1.5
    assert areas_m2[1] > 500
    assert np.isnan(dsm.elevation_m[:, -1]).any()


def test_the_mast_is_the_only_spike(dsm: Dsm) -> None:
    (mast,) = find_spikes(dsm)
    assert mast.kind == "spike"
    assert mast.window[2:] == (1, 1)
    assert 15 < mast.height_m < 18.1


def test_the_route_is_sensible(dsm: Dsm, route_xy_m: np.ndarray) -> None:
    pois = demo_pois()
    assert 5 <= len(pois) <= 6
    assert len({poi.name for poi in pois}) == len(pois)
    assert 300 < 0.5 * len(route_xy_m) < 450
    west, south, east, north = dsm.bounds_m
    assert (route_xy_m - (west, south) > 80).all()
    assert ((east, north) - route_xy_m > 80).all()


def test_no_unknown_cell_and_an_interesting_profile_under_the_route(dsm: Dsm, route_xy_m: np.ndarray) -> None:
    ground = dsm.elevation_at(route_xy_m)
    assert np.isfinite(ground).all()
    assert np.ptp(ground) > 15


def test_home_is_level_and_the_way_home_clear_at_60_m(dsm: Dsm, route_xy_m: np.ndarray) -> None:
    home = route_xy_m[0]
    columns, rows = ~dsm.transform @ (home[0], home[1])
    around = dsm.elevation_m[int(rows) - 4 : int(rows) + 5, int(columns) - 4 : int(columns) + 5]
    assert np.ptp(around) < 0.8
    low, high = route_xy_m.min(axis=0) - 10, route_xy_m.max(axis=0) + 10
    x, y = np.meshgrid(np.arange(low[0], high[0], 0.5), np.arange(low[1], high[1], 0.5))
    region = dsm.elevation_at(np.column_stack([x.ravel(), y.ravel()]))
    assert np.nanmax(region) - dsm.elevation_at(home[None])[0] < 60 - 10


def test_the_survey_polygon_lies_on_known_ground(dsm: Dsm) -> None:
    polygon = dsm.xy_from_lat_lon(demo_survey_polygon())
    assert polygon.shape == (4, 2)
    assert np.isfinite(dsm.elevation_at(polygon)).all()
    x, y = polygon.T
    assert 5_000 < 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1))) < 20_000


def test_the_small_hill_is_a_whole_model():
    hill = small_hill()
    assert hill.elevation_m.shape == (120, 120)
    assert np.isfinite(hill.elevation_m).all()
    assert hill.elevation_m[60, 60] == hill.elevation_m.max() == 10.0
