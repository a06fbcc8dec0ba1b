"""The main job end to end: what is planned is what the files say, never lower, and rightly certified."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.basics.plan_model import Mission, MissionParams, PathParams, Poi, SurfaceParams, VehicleProfile
from planning.errors import CapacityError, DatumError, MissionError, ParameterError, PoiError
from planning.formats import qgc_plan, wpl
from planning.missions.flown import flown_line
from planning.planner.plan import Plan, plan_mission, plan_trade, read_back
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm
from tests.planning.plan_examples import QUAD, pois_at, request_over, small_dsm
from tests.reference import clearance as oracle

TRIANGLE = [(0.3, 0.3), (0.7, 0.35), (0.5, 0.7)]


@pytest.fixture(scope="module")
def dsm() -> Dsm:
    return small_dsm()


@pytest.fixture(scope="module")
def plan(dsm: Dsm) -> Plan:
    return plan_mission(dsm, request_over(dsm, TRIANGLE))


def from_corner(points_m: np.ndarray, dsm: Dsm) -> np.ndarray:
    return np.column_stack([points_m[:, 0] - dsm.transform.c, dsm.transform.f - points_m[:, 1], points_m[:, 2]])


def height_over_path(plan: Plan) -> np.ndarray:
    """How far the flown line runs above each sample of the path: it visits the samples in their order."""
    points = plan.line.points_m
    if plan.request.mission.end == "land":
        points = points[: plan.built.waypoints + 1]
    s_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
    along = plan.path.s_m / plan.path.s_m[-1] * s_m[-1]
    keep = np.concatenate([[True], np.diff(s_m) > 1e-6])
    return np.interp(along, s_m[keep], points[keep, 2]) - plan.path.alt_dsm_m


def test_a_plan_is_certified(plan: Plan) -> None:
    assert plan.certificate.certified
    assert plan.certificate.min_distance_m >= plan.certificate.required_clearance_m == pytest.approx(2.612, abs=0.001)
    assert plan.mission.planned_for == plan.request.planned_for
    assert plan.warnings == ()
    assert plan.predicted.total_s > plan.timing.t_s[-1]
    assert plan.mission.pois == plan.request.pois


@given(
    shares=st.lists(st.tuples(st.floats(0.2, 0.8), st.floats(0.2, 0.8)), min_size=2, max_size=4).filter(
        lambda places: all(np.hypot(a - c, b - d) > 0.05 for (a, b), (c, d) in itertools.pairwise(places))
    ),
    height_m=st.floats(1.0, 6.0),
    end=st.sampled_from(["rtl", "land"]),
)
@settings(max_examples=12, deadline=None, derandomize=True, phases=[Phase.generate])
def test_the_certificate_agrees_with_brute_force(shares: list[tuple[float, float]], height_m: float, end: str) -> None:
    dsm = small_dsm()
    request = request_over(
        dsm,
        shares,
        surface=SurfaceParams(8.0, height_m),
        mission=MissionParams(end=end),  # type: ignore[arg-type]
    )
    plan = plan_mission(dsm, request)
    points_m = from_corner(plan.line.points_m, dsm)
    judged = [
        oracle.segment_distance(dsm.elevation_m, dsm.resolution_m, start, end)
        for start, end in itertools.pairwise(points_m)
    ]
    assert plan.certificate.min_distance_m == pytest.approx(min(judged), abs=1e-4)
    too_near = min(judged) < plan.certificate.required_clearance_m - 1e-6
    assert not (too_near and plan.certificate.certified)


@pytest.mark.parametrize("excess_height_m", [0.0, 0.3, 1.0, 4.0])
@pytest.mark.parametrize("end", ["rtl", "land"])
def test_the_flown_line_is_nowhere_below_the_path(dsm: Dsm, excess_height_m: float, end: str) -> None:
    mission = MissionParams(excess_height_m=excess_height_m, end=end)  # type: ignore[arg-type]
    plan = plan_mission(dsm, request_over(dsm, TRIANGLE, mission=mission))
    above_m = height_over_path(plan)
    assert above_m.min() >= -1e-6
    assert above_m.max() <= excess_height_m + 0.03
    assert (plan.path.alt_dsm_m >= plan.path.surface_alt_dsm_m - 1e-9).all()


def test_a_vehicle_with_few_items_flies_higher_not_lower(dsm: Dsm, plan: Plan) -> None:
    fewest = len(plan.mission.items) - plan.built.waypoints + 5
    tight = plan_mission(
        dsm, request_over(dsm, TRIANGLE, mission=MissionParams(max_items=fewest, excess_height_m=0.05))
    )
    assert len(tight.mission.items) <= fewest
    assert "excess height was raised" in tight.warnings[0]
    assert height_over_path(tight).min() >= -1e-6
    with pytest.raises(CapacityError, match="needs at least"):
        plan_mission(dsm, request_over(dsm, TRIANGLE, mission=MissionParams(max_items=5)))


def wpl_with(change: object) -> object:
    """A writer of .waypoints whose rows 2 and up are changed field by field."""

    def write(mission: Mission) -> str:
        lines = WRITE_WPL(mission).splitlines()
        for k, line in enumerate(lines):
            fields = line.split("\t")
            if len(fields) == 12 and fields[3] == "16" and fields[0] != "0":
                lines[k] = "\t".join(change(fields))  # type: ignore[operator]
        return "\n".join(lines) + "\n"

    return write


WRITE_WPL, WRITE_PLAN = wpl.write_wpl, qgc_plan.write_plan


def one_centimetre_down(fields: list[str]) -> list[str]:
    return [*fields[:10], f"{float(fields[10]) - 0.01:.2f}", fields[11]]


def swapped(fields: list[str]) -> list[str]:
    return [*fields[:8], fields[9], fields[8], *fields[10:]]


def one_metre_east(fields: list[str]) -> list[str]:
    return [*fields[:9], f"{float(fields[9]) + 1.1e-5:.9f}", *fields[10:]]


@pytest.mark.parametrize("change", [one_centimetre_down, swapped, one_metre_east])
def test_a_writer_that_is_wrong_is_caught(dsm: Dsm, monkeypatch: pytest.MonkeyPatch, change: object) -> None:
    monkeypatch.setattr("planning.planner.plan.wpl.write_wpl", wpl_with(change))
    with pytest.raises(MissionError) as caught:
        plan_mission(dsm, request_over(dsm, TRIANGLE))
    assert "not describe the flight" in caught.value.what or "lat" in caught.value.what.lower()


def test_a_plan_writer_that_loses_its_last_waypoint_is_caught(
    dsm: Dsm, plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(mission: Mission) -> str:
        document = json.loads(WRITE_PLAN(mission))
        del document["mission"]["items"][-2]
        return json.dumps(document)

    monkeypatch.setattr("planning.planner.plan.qgc_plan.write_plan", write)
    with pytest.raises(MissionError, match=r"mission\.plan"):
        read_back(plan.mission, dsm)


def test_writers_that_both_lose_a_centimetre_are_caught(dsm: Dsm, plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    def lowered(mission: Mission) -> Mission:
        return replace(mission, items=tuple(replace(i, alt_m=i.alt_m - 0.01) if i.alt_m else i for i in mission.items))

    monkeypatch.setattr("planning.planner.plan.wpl.write_wpl", lambda mission: WRITE_WPL(lowered(mission)))
    monkeypatch.setattr("planning.planner.plan.qgc_plan.write_plan", lambda mission: WRITE_PLAN(lowered(mission)))
    with pytest.raises(MissionError, match=r"mission\.waypoints"):
        read_back(plan.mission, dsm)


def test_what_is_certified_is_what_the_file_says(dsm: Dsm, plan: Plan) -> None:
    line = flown_line(wpl.read_wpl(wpl.write_wpl(plan.mission)), dsm)
    np.testing.assert_array_equal(line.points_m, plan.line.points_m)


def test_home_elsewhere_is_flown_from_but_is_no_point(dsm: Dsm) -> None:
    home = pois_at(dsm, [(0.25, 0.7)])[0]
    plan = plan_mission(dsm, request_over(dsm, TRIANGLE, home_lat_lon_deg=(home.lat_deg, home.lon_deg)))
    assert plan.path.vertex_poi == (None, 0, 1, 2)
    assert (plan.mission.home.lat_deg, plan.mission.home.lon_deg) == pytest.approx((home.lat_deg, home.lon_deg))
    first = plan.request.pois[0]
    at_first = plan_mission(dsm, request_over(dsm, TRIANGLE, home_lat_lon_deg=(first.lat_deg, first.lon_deg)))
    assert at_first.path.vertex_poi == (0, 1, 2)


def test_a_landing_flies_home_high_enough(dsm: Dsm) -> None:
    low = replace(QUAD, rtl_height_m=60.0)
    plan = plan_mission(dsm, request_over(dsm, TRIANGLE, mission=MissionParams(end="land"), profile=low))
    assert plan.certificate.certified
    assert not plan.line.ends_with_rtl
    assert plan.line.points_m[-1, 2] >= plan.line.home_alt_dsm_m + plan.certificate.rtl_height_needed_m - 1e-6


def test_too_close_is_told_not_raised(dsm: Dsm) -> None:
    plan = plan_mission(dsm, request_over(dsm, TRIANGLE, required_clearance_m=12.0))
    assert not plan.certificate.certified
    assert plan.certificate.reasons


def test_battery_is_watched(dsm: Dsm) -> None:
    plan = plan_mission(dsm, request_over(dsm, TRIANGLE, profile=replace(QUAD, endurance_s=60.0)))
    assert plan.certificate.certified
    assert plan.feasibility.feasible is False
    (failure,) = plan.feasibility.failures
    assert failure.code == "battery"
    assert "endurance less reserve is 45 s" in failure.text


def test_assumptions(dsm: Dsm) -> None:
    holed_m = dsm.elevation_m.copy()
    holed_m[50, 50] = np.nan
    holed_m[60:62, 60:62] = np.nan
    holed = dsm.with_elevation(holed_m)
    request = request_over(dsm, TRIANGLE, surface=SurfaceParams(8.0, 4.0, fill_hole_area_m2=0.5))
    assumed = plan_mission(holed, request, assumptions={"spikes_removed": 2}).certificate.assumptions
    assert (assumed["holes_filled"], assumed["holes_filled_area_m2"], assumed["max_hole_m2"]) == (1, 0.25, 0.5)
    assert assumed["spikes_removed"] == 2
    assert assumed["ball_radius_m"] == 8.0
    assert "product_version" not in assumed


def test_progress_names_the_steps(dsm: Dsm) -> None:
    steps: list[str] = []
    plan_mission(dsm, request_over(dsm, TRIANGLE), report=lambda step, share: steps.append(step))
    assert steps == ["Dilating the surface", "Laying the path", "Proving the clearance"]


def test_refusals(dsm: Dsm) -> None:
    with pytest.raises(PoiError, match="at least 2 points"):
        plan_mission(dsm, request_over(dsm, TRIANGLE[:1]))
    with pytest.raises(PoiError, match="outside the surface model"):
        plan_mission(dsm, request_over(dsm, [*TRIANGLE, (1.2, 0.5)]))
    with pytest.raises(PoiError, match="height of home"):
        plan_mission(dsm, request_over(dsm, TRIANGLE, home_lat_lon_deg=(0.0, 0.0)))
    amsl = request_over(dsm, TRIANGLE, mission=MissionParams(altitude_reference="amsl"))
    with pytest.raises(DatumError):
        plan_mission(replace(dsm, vertical_datum=None), amsl)
    with pytest.raises(ParameterError, match="larger than the surface model"):
        plan_mission(dsm, request_over(dsm, TRIANGLE, surface=SurfaceParams(51.0, 4.0)))
    with pytest.raises(ParameterError, match="contradict"):
        plan_mission(dsm, request_over(dsm, TRIANGLE, path=PathParams(mean_speed_m_s=5.0)))


def test_amsl_is_the_same_path(dsm: Dsm, plan: Plan) -> None:
    amsl = plan_mission(dsm, request_over(dsm, TRIANGLE, mission=MissionParams(altitude_reference="amsl")))
    np.testing.assert_array_equal(amsl.path.alt_dsm_m, plan.path.alt_dsm_m)
    assert {item.frame for item in amsl.mission.items if item.command == 16} == {0}
    assert height_over_path(amsl).min() >= -1e-6
    assert amsl.certificate.certified


def test_trade_falls(plan: Plan) -> None:
    trade = plan_trade(plan)
    assert [choice.waypoints for choice in trade] == sorted((choice.waypoints for choice in trade), reverse=True)
    assert plan.built.waypoints in [choice.waypoints for choice in trade if choice.excess_height_m == 1.0]


def test_home_in_a_filled_hole_is_refused_and_never_chosen() -> None:
    """The hole takes the roof's height; counted from there, the whole flight would be eight metres too low."""
    heights = np.zeros((200, 200), np.float32)
    heights[96:104, 104:112] = 8.0
    heights[99:102, 101:104] = np.nan
    dsm = Dsm(heights, Affine(0.5, 0, 5e5, 0, -0.5, 5e6), CRS.from_epsg(32633), None, "0" * 64)
    xy_m = np.array([(5e5 + 51.2, 5e6 - 50.2), (5e5 + 25, 5e6 - 70), (5e5 + 30, 5e6 - 30)])
    pois = tuple(Poi(float(lat), float(lon)) for lat, lon in dsm.lat_lon_from_xy(xy_m))
    request = PlanRequest(pois, VehicleProfile("x", position_error_m=0.1))
    with pytest.raises(PoiError, match="home"):
        plan_mission(dsm, replace(request, home_lat_lon_deg=(pois[0].lat_deg, pois[0].lon_deg)))
    plan = plan_mission(dsm, request)
    assert plan.certificate.certified
    assert plan.line.home_alt_dsm_m == 0.0
    assert "unknown cells within" in plan.warnings[0]
