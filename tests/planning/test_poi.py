"""Checks on points of interest."""

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.basics.limits import LONGEST_LOITER_S
from planning.basics.plan_model import Poi
from planning.errors import PoiError
from planning.route.poi import check_pois
from planning.terrain.dsm import Dsm

elevation = np.zeros((100, 100), dtype=np.float32)
elevation[:, 60:70] = np.nan
DSM = Dsm(elevation, Affine(1, 0, 500_000, 0, -1, 5_000_100), CRS.from_epsg(32633), None, "0")


def at(x_m: float, y_m: float, name: str = "", loiter_s: float = 0.0) -> Poi:
    lat, lon = DSM.lat_lon_from_xy(np.array([[500_000 + x_m, 5_000_000 + y_m]]))[0]
    return Poi(float(lat), float(lon), name, loiter_s)


GOOD = at(10, 10, "A")


def test_good_points_come_back_in_metres() -> None:
    xy_m = check_pois([GOOD, at(50, 80, loiter_s=3)], DSM)
    np.testing.assert_allclose(xy_m - [500_000, 5_000_000], [[10, 10], [50, 80]], atol=1e-4)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (at(150, 10), "outside the surface model"),
        (at(65, 10), "unknown terrain"),
        (Poi(float("nan"), 15.0), "no numbers"),
        (Poi(95.0, 15.0), "look swapped"),
        (Poi(45.0, 200.0), "out of range"),
        (Poi(15.0, 195.0), "out of range"),
        (at(20, 20, loiter_s=-1), "loiter"),
        (at(20, 20, loiter_s=float("nan")), "loiter"),
        (at(20, 20, loiter_s=LONGEST_LOITER_S + 1), "at most 3,600"),
        (at(10.02, 10), "0.02 m apart"),
        (Poi(at(20, 20).lon_deg, at(20, 20).lat_deg), "but swapped it lies on it"),
    ],
)
def test_a_bad_point_is_named(bad: Poi, message: str) -> None:
    named = Poi(bad.lat_deg, bad.lon_deg, "mast", bad.loiter_s)
    with pytest.raises(PoiError, match=message) as error:
        check_pois([GOOD, named], DSM)
    assert 'Point 2 "mast"' in str(error.value)


def test_all_problems_are_listed_at_once() -> None:
    with pytest.raises(PoiError) as error:
        check_pois([at(150, 10), GOOD, at(65, 10), at(65, 10)], DSM)
    for part in ("Point 1:", "Point 3:", "Point 4:", "Point 3 and Point 4 are 0.00 m apart"):
        assert part in error.value.what


@pytest.mark.parametrize("pois", [[], [GOOD]])
def test_too_few_points(pois: list[Poi]) -> None:
    with pytest.raises(PoiError, match="at least 2 points"):
        check_pois(pois, DSM)


def test_one_point_is_enough_where_home_is_another() -> None:
    assert check_pois([GOOD], DSM, at_least=1).shape == (1, 2)


def test_the_safe_surface_must_be_known_too() -> None:
    hole = np.array(elevation)
    hole[:, :30] = np.nan
    with pytest.raises(PoiError, match="safe surface is unknown"):
        check_pois([GOOD, at(50, 50)], DSM, DSM.with_elevation(hole))
