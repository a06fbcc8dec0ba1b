"""The certificate on a recorded mission over real terrain, whose clearance others have worked out."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rasterio
from affine import Affine
from pyproj import CRS, Proj
from scipy import ndimage

from planning.basics.plan_model import Home, Mission, MissionItem
from planning.certificate.certificate_model import ClearanceParams
from planning.certificate.clearance import certify
from planning.certificate.pyramid import max_pyramid
from planning.certificate.returns import return_altitude
from planning.certificate.ways_home import places_along
from planning.missions.flown import flown_line
from planning.terrain.dsm import Dsm
from tests.reference import clearance as oracle

DEFAULT_RTL_M = 15.0
PARAMS = ClearanceParams(3.35, 0.35, 2.5, rtl_height_m=70.0, home_known_dsm_m=(803.15, 803.15))
"""What the mission's authors asked for, and the height at which their vehicle stood."""


@pytest.fixture(scope="module")
def with_holes(shared_data: Path) -> Dsm:
    with rasterio.open(shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif") as source:
        cells = source.read(1)
        cells[cells == source.nodata] = np.nan
        return Dsm(cells, Affine(*source.transform[:6]), CRS.from_wkt(source.crs.to_wkt()), None, "0" * 64)


@pytest.fixture(scope="module")
def without_holes(with_holes: Dsm) -> Dsm:
    """Unknown cells take the height of the nearest known one, as the mission's authors did it."""
    cells = with_holes.elevation_m
    nearest = ndimage.distance_transform_edt(np.isnan(cells), return_distances=False, return_indices=True)
    assert nearest is not None
    return with_holes.with_elevation(cells[tuple(nearest)])


@pytest.fixture(scope="module")
def mission(shared_data: Path) -> Mission:
    text = (shared_data / "logs" / "arducopter" / "mission.waypoints").read_text()
    rows = [[float(field) for field in line.split("\t")] for line in text.splitlines()[1:]]
    items = tuple(MissionItem(int(r[3]), int(r[2]), (r[4], r[5], r[6], r[7]), r[8], r[9], r[10]) for r in rows[1:])
    return Mission(Home(rows[0][8], rows[0][9], rows[0][10]), items)


def test_the_recorded_figures_come_out(without_holes, mission):
    certificate = certify(without_holes, flown_line(mission, without_holes), PARAMS)
    assert certificate.certified
    assert certificate.min_vertical_m == pytest.approx(4.93, abs=0.005)
    assert certificate.min_distance_m == pytest.approx(4.92, abs=0.005)
    assert mission.items[certificate.legs[certificate.worst.leg].item].command == 16
    assert 28 <= certificate.legs[certificate.worst.leg].item <= 31  # near sequence 30


def test_where_its_vehicle_did_not_tell_nobody_knows_how_high_home_is(without_holes, mission):
    line = flown_line(mission, without_holes)
    refused = certify(without_holes, line, replace(PARAMS, home_known_dsm_m=None))
    assert [reason.code for reason in refused.reasons] == ["home_on_top", "return_near_home"]
    assert refused.home is not None
    assert refused.home.drop_m == pytest.approx(6.62, abs=0.005)
    assert refused.min_distance_m == pytest.approx(4.92, abs=0.005)
    assert refused.home.min_distance_m == 0.0


def test_holes_beside_the_route_are_not_certified(with_holes, mission):
    certificate = certify(with_holes, flown_line(mission, with_holes), PARAMS)
    assert not certificate.certified
    assert certificate.min_vertical_m == pytest.approx(4.93, abs=0.005)
    assert certificate.min_distance_m == pytest.approx(1.0, abs=0.2)
    assert certificate.rtl_height_needed_m == math.inf
    assert [reason.code for reason in certificate.reasons] == ["clearance", "return_unknown"]


@pytest.mark.parametrize("holes", [False, True])
def test_brute_force_agrees(with_holes, without_holes, mission, holes):
    dsm = with_holes if holes else without_holes
    line = flown_line(mission, dsm)
    certificate = certify(dsm, line, PARAMS)
    west, _, _, north = dsm.bounds_m
    lat_deg, lon_deg = dsm.lat_lon_from_xy(line.points_m[:, :2]).T
    stretch = np.max(Proj(dsm.crs).get_factors(lon_deg, lat_deg).tissot_semimajor)
    assert 1.0002 < stretch < 1.0004  # metres of the grid in a metre on the ground
    points = (line.points_m - [west, north, 0.0]) * [1.0 / stretch, -1.0 / stretch, 1.0]
    for leg in range(26, 32):
        res_m = dsm.resolution_m / stretch
        exact_m = oracle.segment_distance(dsm.elevation_m, res_m, points[leg], points[leg + 1])
        assert certificate.legs[leg].min_distance_m == pytest.approx(exact_m, abs=1e-6)


def test_the_default_return_height_leads_into_the_trees(without_holes, mission):
    line = flown_line(mission, without_holes)
    needed_m = certify(without_holes, line, PARAMS).rtl_height_needed_m
    assert DEFAULT_RTL_M < needed_m < PARAMS.rtl_height_m
    low = replace(PARAMS, rtl_height_m=DEFAULT_RTL_M)
    refused = certify(without_holes, line, low)
    assert [reason.code for reason in refused.reasons] == ["return_height"]
    enough = replace(PARAMS, rtl_height_m=needed_m)
    assert certify(without_holes, line, enough).certified


def test_ways_home_at_the_routes_own_height_run_seven_metres_below_the_surface(without_holes, mission):
    line = flown_line(mission, without_holes)
    west, _, _, north = without_holes.bounds_m
    points = (line.points_m - [west, north, 0.0]) * [1.0, -1.0, 1.0]
    pyramid = max_pyramid(without_holes.elevation_m, without_holes.resolution_m)
    places, s_m = places_along(points, 0.5)
    below_m = [return_altitude(pyramid, place[None], points[0, :2], 1e-9)[0] - place[2] for place in places]
    assert max(below_m) == pytest.approx(7.0, abs=0.05)
    assert s_m[int(np.argmax(below_m))] == pytest.approx(154.0, abs=1.0)
