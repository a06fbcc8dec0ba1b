"""Which datums may be written as heights above mean sea level."""

from __future__ import annotations

import pytest

from planning.terrain.vertical_datum import is_amsl

GEOIDS = (
    "EGM96 height", "EGM96", "egm2008", "EGM2008 geoid height", "EGM 2008", "EPSG:5773", "EPSG:5703", "NAVD88 height",
    "NAVD88 height (ftUS)", "NAVD 88", "navd88", "NGVD29 height", "CGVD2013(CGG2013) height", "DHHN2016 height",
    "DHHN92", "AHD height", "ODN height", "Newlyn", "NAP height", "EVRF2007 height", "NZVD2016 height", "RH2000 height",
    "N2000 height", "NGF-IGN69 height", "LN02 height", "MSL height", "mean sea level", "AMSL", "Orthometric height",
    "GEOID18", "Baltic 1977 height", "Genoa 1942 height", "JGD2011 (vertical) height", "WGS 84 + EGM96 height",
)  # fmt: skip

OTHERS = (
    "", " ", "unknown", "Unknown vertical datum", "ellipsoid", "Ellipsoidal", "WGS 84 ellipsoidal height", "WGS 84",
    "WGS84", "GRS80", "EPSG:4979", "EPSG:4326", "EPSG:32633", "ETRS89 height above ellipsoid", "HAE", "height",
    "Site datum 3", "local", "Local datum (m)", "above ground", "AGL", "MSL depth", "MLLW height", "LAT depth",
    "Chart datum", "EGM96 height above ellipsoid", "EGM96 geoid undulation", "not EGM96", "unnamed", "geoid?", "DHHN",
)  # fmt: skip


@pytest.mark.parametrize("name", GEOIDS)
def test_geoids_and_levelling_networks_are_above_sea_level(name):
    assert is_amsl(name)


@pytest.mark.parametrize("name", [None, *OTHERS])
def test_whatever_is_not_known_to_be_a_geoid_is_not(name):
    assert not is_amsl(name)
