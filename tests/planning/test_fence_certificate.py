"""The certificate of missions with fences and rally points: over flat ground, and with a wall in the way."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from planning.basics.plan_model import Mission
from planning.certificate.as_json import certificate_json
from planning.certificate.certificate_model import Certificate, ClearanceParams
from planning.certificate.clearance import certify
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, circle, polygon
from planning.formats import qgc_plan
from planning.missions.flown import flown_line
from planning.planner.part import certify_part
from planning.planner.plan import plan_mission
from planning.terrain.dsm import Dsm
from tests.planning.plan_examples import request_over, small_dsm
from tests.planning.test_flown import HOME, RTL, TAKE_OFF, at, flat_dsm, item

PARAMS = ClearanceParams(required_clearance_m=2.0, vehicle_radius_m=0.5, position_error_m=1.0, rtl_height_m=15.0)
FLIGHT = (TAKE_OFF, item(16, 50, 70, 10.0), item(16, 70, 70, 10.0), RTL)


def judged(
    fence: Fence = NO_FENCE, *rally: RallyPoint, dsm: Dsm | None = None, params: ClearanceParams = PARAMS
) -> Certificate:
    ground = dsm or flat_dsm()
    mission = Mission(HOME, FLIGHT, fence=fence, rally=rally)
    return certify(ground, flown_line(mission, ground), params)


def codes(certificate: Certificate) -> set[str]:
    return {reason.code for reason in certificate.reasons}


def around(radius_m: float, east_m: float = 60.0, north_m: float = 60.0, *, inclusion: bool) -> Fence:
    return Fence(circles=(circle(*at(east_m, north_m), radius_m, inclusion=inclusion, where="test"),))


def test_without_a_fence_nothing_is_said_of_one() -> None:
    certificate = judged()
    assert certificate.certified
    assert certificate.fence is None
    assert certificate_json(certificate)["fence"] is None


def test_a_flight_inside_its_fence_is_certified_with_the_distance() -> None:
    certificate = judged(around(30.0, inclusion=True))
    assert certificate.certified
    assert certificate.fence is not None
    assert certificate.fence.min_distance_m == pytest.approx(30.0 * 0.993 - 10 * 2**0.5, abs=0.02)
    assert certificate.fence.margin_m == 1.5


@pytest.mark.parametrize("radius_m", [14.0, 15.0])
def test_a_flight_that_leaves_its_fence_or_comes_too_near_is_not_certified(radius_m: float) -> None:
    certificate = judged(around(radius_m, inclusion=True))
    assert codes(certificate) == {"fence"}
    assert json.dumps(certificate_json(certificate)["fence"])


def test_the_tube_around_the_line_counts() -> None:
    exclusion = around(5.0, 50.0 - 5.0 * 1.007 - 2.0, 60.0, inclusion=False)
    assert judged(exclusion).certified
    wider = replace(PARAMS, position_error_m=1.6)
    assert codes(judged(exclusion, params=wider)) == {"fence"}


def test_a_ceiling_below_the_return_height_is_not_kept() -> None:
    assert judged(Fence(ceiling_rel_home_m=16.6)).certified
    certificate = judged(Fence(ceiling_rel_home_m=14.0))
    assert codes(certificate) == {"fence"}
    assert certificate_json(certificate)["fence"]["min_distance_m"] is None  # no shapes
    assert codes(judged(Fence(floor_rel_home_m=9.0))) == {"fence"}


def test_a_rally_point_on_open_ground_is_fine_and_one_off_the_model_is_not() -> None:
    assert judged(Fence(), RallyPoint(*at(30, 40), 20.0)).certified
    assert codes(judged(Fence(), RallyPoint(*at(300, 40), 20.0))) == {"rally"}
    assert codes(judged(Fence(), RallyPoint(0.0, 0.0, 20.0))) == {"rally"}


def test_a_wall_on_the_way_to_a_rally_point_is_found() -> None:
    elevation_m = np.full((100, 100), 120.0, np.float32)
    elevation_m[:, 20] = 140.0
    walled = flat_dsm(elevation_m=elevation_m)
    assert judged(dsm=walled).certified
    certificate = judged(Fence(), RallyPoint(*at(8, 60), 20.0), dsm=walled)
    assert codes(certificate) == {"rally"}
    assert "needs 22.00 m above home" in certificate.reasons[0].text
    assert judged(
        Fence(), RallyPoint(*at(8, 60), 20.0), dsm=walled, params=replace(PARAMS, rtl_height_m=22.5)
    ).certified


def test_a_rally_point_on_a_wall_is_no_place_to_land() -> None:
    elevation_m = np.full((100, 100), 120.0, np.float32)
    elevation_m[40:42, 20] = 123.0
    certificate = judged(Fence(), RallyPoint(*at(20.5, 59.0), 20.0), dsm=flat_dsm(elevation_m=elevation_m))
    assert codes(certificate) == {"rally"}
    assert "no place to land" in certificate.reasons[0].text


def test_a_fence_elsewhere_is_told_to_be_too_far_to_judge() -> None:
    far = Fence(polygons=(polygon([(1.0, 1.0), (1.0, 1.1), (1.1, 1.1)], inclusion=False, where="t"),))
    assert "not judged" in judged(far).reasons[0].text


def test_a_plan_keeps_its_fence_in_its_certificate_and_in_its_file() -> None:
    dsm = small_dsm()
    asked = request_over(dsm, [(0.3, 0.3), (0.7, 0.6)])
    free = plan_mission(dsm, asked)
    west, south, east, north = dsm.bounds_m
    lat_deg, lon_deg = dsm.lat_lon_from_xy(np.array([[(west + east) / 2, south + 0.45 * (north - south)]]))[0]
    exclusion = Fence(circles=(circle(float(lat_deg), float(lon_deg), 2.0, inclusion=False, where="t"),))
    fenced = plan_mission(dsm, replace(asked, fence=exclusion))
    assert "fence" not in codes(free.certificate)
    assert "fence" in codes(fenced.certificate)
    written = qgc_plan.read_plan(qgc_plan.write_plan(fenced.mission))
    assert written.fence == exclusion
    params = asked.clearance()
    _, again = certify_part(dsm, written, params, max_hole_m2=asked.surface.fill_hole_area_m2, assumptions={})
    assert codes(again) == codes(fenced.certificate)
    assert again.fence == fenced.certificate.fence
