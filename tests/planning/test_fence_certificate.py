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
from planning.errors import PoiError
from planning.fence.fence_model import NO_FENCE, Fence, RallyPoint, circle, polygon
from planning.formats import qgc_plan
from planning.margins.following_error import Firmware
from planning.missions.flown import flown_line
from planning.planner.part import certify_part
from planning.planner.plan import plan_mission
from planning.terrain.dsm import Dsm
from tests.planning.plan_examples import pois_at, request_over, small_dsm
from tests.planning.test_flown import HOME, RTL, TAKE_OFF, at, flat_dsm, item

PARAMS = ClearanceParams(required_clearance_m=2.0, vehicle_radius_m=0.5, position_error_m=1.0, rtl_height_m=15.0)
FLIGHT = (TAKE_OFF, item(16, 50, 70, 10.0), item(16, 70, 70, 10.0), RTL)


def judged(
    fence: Fence = NO_FENCE,
    *rally: RallyPoint,
    dsm: Dsm | None = None,
    params: ClearanceParams = PARAMS,
    firmware: Firmware = "ardupilot",
) -> Certificate:
    ground = dsm or flat_dsm()
    mission = Mission(HOME, FLIGHT, fence=fence, rally=rally, firmware=firmware)
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


@pytest.mark.parametrize(("firmware", "highest_m"), [("ardupilot", 20.0), ("px4", 35.0)])
def test_a_way_to_a_rally_point_is_as_high_below_the_ceiling_as_its_autopilot_flies_it(
    firmware: Firmware, highest_m: float
) -> None:
    """The vehicle may be 1.5 m higher; the return height is 15 m."""
    rally = RallyPoint(*at(30, 40), 20.0)
    assert judged(Fence(ceiling_rel_home_m=highest_m + 1.6), rally, firmware=firmware).certified
    certificate = judged(Fence(ceiling_rel_home_m=highest_m + 1.4), rally, firmware=firmware)
    assert codes(certificate) == {"fence"}
    assert f"climbs to {highest_m:.2f} m above home" in certificate.reasons[0].text


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


def place_in(dsm: Dsm, east: float, north: float) -> tuple[float, float]:
    """At shares of the model's sides."""
    (poi,) = pois_at(dsm, [(east, north)])
    return poi.lat_deg, poi.lon_deg


def test_a_plan_that_cannot_keep_its_fence_says_so_in_its_certificate_and_in_its_file() -> None:
    """Home is the first point: from the second the way back leads through the circle, however the line is laid."""
    dsm = small_dsm()
    asked = request_over(dsm, [(0.3, 0.3), (0.7, 0.6)])
    free = plan_mission(dsm, asked)
    exclusion = Fence(circles=(circle(*place_in(dsm, 0.5, 0.45), 2.0, inclusion=False, where="t"),))
    fenced = plan_mission(dsm, replace(asked, fence=exclusion))
    assert "fence" not in codes(free.certificate)
    assert "fence" in codes(fenced.certificate)
    assert fenced.certificate.fence is not None
    assert fenced.certificate.fence.part == "home"
    assert {detour.shape for detour in fenced.detours} == {"exclusion circle 1"}
    written = qgc_plan.read_plan(qgc_plan.write_plan(fenced.mission))
    assert written.fence == exclusion
    params = asked.clearance()
    _, again = certify_part(dsm, written, params, max_hole_m2=asked.surface.fill_hole_area_m2, assumptions={})
    assert codes(again) == codes(fenced.certificate)
    assert again.fence == fenced.certificate.fence


def test_a_plan_is_laid_around_its_fence_and_certified_while_its_points_stay_what_they_are() -> None:
    dsm = small_dsm()
    asked = request_over(dsm, [(0.2, 0.6), (0.8, 0.6)], home_lat_lon_deg=place_in(dsm, 0.5, 0.1))
    asked = replace(asked, pois=tuple(replace(poi, loiter_s=4.0) for poi in asked.pois))
    exclusion = Fence(circles=(circle(*place_in(dsm, 0.5, 0.6), 3.0, inclusion=False, where="t"),))
    straight, laid = plan_mission(dsm, asked), plan_mission(dsm, replace(asked, fence=exclusion))
    assert straight.detours == ()
    assert "fence" not in codes(laid.certificate)
    assert laid.certificate.fence is not None
    assert laid.certificate.fence.min_distance_m >= laid.certificate.fence.margin_m
    assert {(detour.shape, detour.before_poi) for detour in laid.detours} == {("exclusion circle 1", 1)}
    assert len(laid.path.vertex) == len(straight.path.vertex) + len(laid.detours)
    waits_s = [item.params[0] for item in laid.mission.items if item.command == 16]
    assert sum(waits_s) == 8.0
    assert laid.mission.pois == straight.mission.pois
    assert float(laid.path.s_m[-1]) > float(straight.path.s_m[-1])


def test_points_where_the_fence_lets_nobody_be_are_refused_all_at_once_and_by_name() -> None:
    dsm = small_dsm()
    asked = request_over(dsm, [(0.2, 0.6), (0.5, 0.6), (0.8, 0.6)], home_lat_lon_deg=place_in(dsm, 0.5, 0.1))
    circles = (
        circle(*place_in(dsm, 0.5, 0.6), 3.0, inclusion=False, where="t"),
        circle(*place_in(dsm, 0.2, 0.6), 40.0, inclusion=True, where="t"),
        circle(*place_in(dsm, 0.8, 0.6), 1.0, inclusion=False, where="t"),
    )
    with pytest.raises(PoiError) as refused:
        plan_mission(dsm, replace(asked, fence=Fence(circles=circles)))
    assert 'Point 2 "P2" lies 3.02 m inside exclusion circle 1 of the fence' in refused.value.what
    assert 'Point 3 "P3" lies' in refused.value.what
    assert 'Point 1 "P1"' not in refused.value.what


def test_a_point_that_is_closed_in_is_told_with_the_shapes_that_close_it() -> None:
    dsm = small_dsm()
    asked = request_over(dsm, [(0.2, 0.6), (0.8, 0.6)], home_lat_lon_deg=place_in(dsm, 0.5, 0.1))
    wall = polygon(
        [place_in(dsm, *at) for at in ((0.5, 0.0), (0.52, 0.0), (0.52, 1.0), (0.5, 1.0))], inclusion=False, where="t"
    )
    plan = plan_mission(dsm, replace(asked, fence=Fence((wall,)), home_lat_lon_deg=place_in(dsm, 0.2, 0.1)))
    assert "fence" in codes(plan.certificate)
    assert plan.detours == ()
    said = 'from Point 1 "P1" to Point 2 "P2" that keeps to the fence: exclusion polygon 1'
    assert any(said in warning for warning in plan.warnings)
