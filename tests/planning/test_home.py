"""Home on the surface model."""

from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import MissionParams
from planning.errors import DatumError, MissionError, PoiError
from planning.missions.home import home_from_dsm, item_heights
from planning.terrain.dsm import Dsm

elevation = np.full((50, 50), 321.5, dtype=np.float32)
elevation[:, 40:] = np.nan
DSM = Dsm(elevation, Affine(1, 0, 500_000, 0, -1, 5_000_050), CRS.from_epsg(32633), None, "0")
AMSL = MissionParams(altitude_reference="amsl")


def place(x_m: float) -> tuple[float, float]:
    lat, lon = DSM.lat_lon_from_xy(np.array([[500_000 + x_m, 5_000_025]]))[0]
    return float(lat), float(lon)


def test_home_stands_on_the_model() -> None:
    home = home_from_dsm(replace(DSM, vertical_datum="EGM96 height"), place(10))
    assert (home.lat_deg, home.lon_deg) == place(10)
    assert (home.alt_dsm_m, home.vertical_datum) == (321.5, "EGM96 height")


@pytest.mark.parametrize("lat_lon", [place(45), place(500), (95.0, 15.0), (float("nan"), 15.0)])
def test_home_off_known_terrain_is_refused(lat_lon: tuple[float, float]) -> None:
    with pytest.raises(PoiError, match="home"):
        home_from_dsm(DSM, lat_lon)


def test_heights_are_relative_to_home_or_above_sea_level() -> None:
    home = home_from_dsm(DSM, place(10))
    relative = item_heights(home, MissionParams(), DSM)
    absolute = item_heights(home, AMSL, replace(DSM, vertical_datum="EGM2008 height"))
    assert (relative.frame, relative.origin_alt_dsm_m) == (3, 321.5)
    assert (absolute.frame, absolute.origin_alt_dsm_m) == (0, 0.0)


@pytest.mark.parametrize(("datum", "reason"), [(None, "no declared"), ("WGS 84 ellipsoid", "WGS 84 ellipsoid")])
def test_sea_level_needs_a_geoid(datum: str | None, reason: str) -> None:
    with pytest.raises(DatumError, match=reason):
        item_heights(home_from_dsm(DSM, place(10)), AMSL, replace(DSM, vertical_datum=datum))


def test_a_home_without_height_is_refused() -> None:
    home = replace(home_from_dsm(DSM, place(10)), alt_dsm_m=float("nan"))
    with pytest.raises(MissionError):
        item_heights(home, MissionParams(), DSM)
