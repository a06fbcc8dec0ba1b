"""A mission meets the same models in plan, certificate and flight; their errors count no farther than known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import ANY_VEHICLE, Home, Mission, MissionItem, Poi, SurfaceParams
from planning.certificate.certificate_model import Certificate
from planning.certificate.clearance import certify
from planning.errors import MissionError, RasterTooLargeError
from planning.fence.fence_model import NO_FENCE, Fence, FencePolygon, RallyPoint
from planning.missions.flown import flown_line
from planning.planner.part import certify_part, looked_over, mission_places, needed_part
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from planning.route.survey import SurveyPlan
from planning.terrain.catalogue import nearby
from planning.terrain.catalogue.joined_models import Catalogue
from planning.terrain.catalogue.models import CatalogueModel
from planning.terrain.dsm import FLIGHT_MARGIN_M, Dsm
from tests.planning.catalogue_samples import in_memory, tower_beside
from tests.planning.test_catalogue_nearby import at
from tests.planning.test_catalogue_surface import catalogue_of

HERE = (1002.5, 1002.5), (1022.5, 1002.5)
FAR = (1702.5, 1002.5)


def lat_lon(catalogue: Catalogue, *east_south_m: tuple[float, float]) -> list[tuple[float, float]]:
    found = catalogue.lat_lon_from_xy(at(*east_south_m))
    return [(round(lat_deg, 7), round(lon_deg, 7)) for lat_deg, lon_deg in found.tolist()]


def request_for(catalogue: Catalogue, *places: tuple[float, float], fence: Fence = NO_FENCE) -> PlanRequest:
    return PlanRequest(
        surface=SurfaceParams(height_m=10.0),
        pois=tuple(Poi(*place) for place in lat_lon(catalogue, *places)),
        profile=replace(ANY_VEHICLE, rtl_height_m=30.0),
        fence=fence,
    )


def flown(mission: Mission, request: PlanRequest, part: Dsm) -> Certificate | None:
    """None: home lies where the part knows nothing."""
    try:
        return certify(part, flown_line(mission, part), request.clearance())
    except MissionError:
        return None


def certified_again(catalogue: Catalogue, plan: Plan) -> Certificate:
    params, hole_m2 = plan.request.clearance(), plan.request.surface.fill_hole_area_m2
    return certify_part(catalogue, plan.mission, params, max_hole_m2=hole_m2, assumptions={})[1]


def test_what_is_flown_from_elsewhere_is_not_certified_with_the_error_of_here() -> None:
    catalogue, truth = tower_beside(1602.5, 15.0)
    request = request_for(catalogue, *HERE)
    plan = plan_mission(catalogue, request)
    assert plan.certificate.certified
    part = needed_part(catalogue, mission_places(catalogue, plan.mission))
    assert part.place_m == 0.0
    as_planned = flown(plan.mission, request, part)
    assert as_planned is not None
    assert as_planned.certified
    assert as_planned.required_clearance_m == plan.certificate.required_clearance_m
    ((lat_deg, lon_deg),) = lat_lon(catalogue, FAR)
    home = replace(plan.mission, home=Home(lat_deg, lon_deg, 0.0, None))
    rally = replace(plan.mission, rally=(RallyPoint(lat_deg, lon_deg, 30.0),))
    for mission in (home, rally):
        real = flown(mission, request, truth)
        assert real is not None
        assert not real.certified
        over = flown(mission, request, part)
        assert over is None or not over.certified


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.floats(0.0, 2000.0), st.floats(0.0, 2000.0), st.sampled_from([0.0, 30.0, 200.0]))
@example(1000.0, 1000.0, 0.0)
def test_the_error_of_a_part_holds_in_all_of_it(east_m: float, south_m: float, demanded_m: float) -> None:
    catalogue, _ = tower_beside(100.0, 15.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("planning.planner.part.FLIGHT_MARGIN_M", 25.0)
        part = needed_part(catalogue, at((east_m, south_m)), demanded_m)
    shares, _ = catalogue.shares_of(part)
    assert part.place_m >= max(share.model.place_m for share in shares)


def test_a_part_is_whole_where_its_error_is_the_largest_of_all() -> None:
    catalogue, _ = tower_beside(100.0, 15.0)
    within, beside = needed_part(catalogue, at(*HERE)), needed_part(catalogue, at(FAR))
    assert (within.place_m, beside.place_m) == (0.0, 15.0)
    assert beside.bounds_m == catalogue.bounds_m
    (east, south), around_m = HERE[0], FLIGHT_MARGIN_M + within.resolution_m
    ((west_m, north_m),) = at((east - around_m, south - around_m)).tolist()
    assert west_m <= within.bounds_m[0]
    assert within.bounds_m[3] <= north_m


def test_what_is_not_flown_to_changes_nothing() -> None:
    catalogue, _ = tower_beside(100.0, 15.0)
    request, beside = request_for(catalogue, *HERE), lat_lon(catalogue, (1160.0, 1000.0), (1000.0, 1000.0), HERE[1])
    plan = plan_mission(catalogue, request)
    area = SurveyPlan(request.pois, 10.0, 5.0, 10.0, 1.0, 0.0, 1, tuple(beside), 0.5, 0.5)
    survey = plan_mission(catalogue, replace(request, survey=area))
    look = MissionItem(MavCmd.DO_SET_ROI_LOCATION, 3, lat_deg=beside[0][0], lon_deg=beside[0][1])
    looking = replace(plan.mission, items=(*plan.mission.items, look))
    assert looked_over(catalogue, at((1160.0, 1000.0))).place_m == 15.0
    expected = {"models_place_error_m": 0.0, "models_finest": "flight, cells of 5 m"}
    certificates = [plan.certificate, survey.certificate, certified_again(catalogue, plan)]
    certificates.append(certified_again(catalogue, replace_mission(plan, looking)))
    for certificate in certificates:
        assert certificate.assumptions | expected == certificate.assumptions
        assert certificate.required_clearance_m == plan.certificate.required_clearance_m
    assert needed_part(catalogue, mission_places(catalogue, looking)).place_m == 0.0


def replace_mission(plan: Plan, mission: Mission) -> Plan:
    return replace(plan, built=replace(plan.built, mission=mission))


def rough(cells: int, *, seed: int, cell_m: float, year: int, name: str, off_m: float = 0.0) -> CatalogueModel:
    heights = np.random.default_rng(seed).uniform(0.0, 0.3, (cells, cells)).astype(np.float32)
    far_m = {"survey": 0.0, "flight": 500.0, "fine": 950.0}[name]
    south_m = 300.0 if name == "fine" else far_m
    return in_memory(
        heights, cell_m=cell_m, year=year, name=name, east_m=far_m, south_m=south_m, place_m=off_m, horizontal_m=off_m
    )


@pytest.mark.parametrize(("with_fine", "cell_m", "place_m"), [(False, 5.0, 15.0), (True, 2.5, 15.0)])
def test_a_way_round_a_fence_that_leads_to_other_models_is_judged_with_them(
    with_fine: bool, cell_m: float, place_m: float
) -> None:
    survey = rough(200, seed=1, cell_m=10.0, year=2010, name="survey", off_m=15.0)
    fine = [rough(40, seed=3, cell_m=2.5, year=2023, name="fine")] if with_fine else []
    catalogue = catalogue_of((rough(200, seed=2, cell_m=5.0, year=2024, name="flight"), *fine, survey))
    ends = (972.5, 1002.5), (1032.5, 1002.5)
    assert (looked_over(catalogue, at(*ends)).resolution_m, looked_over(catalogue, at(*ends)).place_m) == (5.0, 0.0)
    ring = lat_lon(catalogue, (992.0, 600.0), (1012.0, 600.0), (1012.0, 1500.0), (992.0, 1500.0))
    request = request_for(catalogue, *ends, fence=Fence(polygons=(FencePolygon(False, tuple(ring)),)))
    request = replace(request, surface=SurfaceParams(height_m=30.0), profile=replace(ANY_VEHICLE, rtl_height_m=120.0))
    plan = plan_mission(catalogue, request)
    assert plan.detours
    assert (plan.ground.resolution_m, plan.ground.place_m) == (cell_m, place_m)
    again = certified_again(catalogue, plan)
    assert again.min_distance_m == pytest.approx(plan.certificate.min_distance_m, abs=1e-6)
    assert again.required_clearance_m == plan.certificate.required_clearance_m
    assert again.assumptions["models_finest"] == plan.certificate.assumptions["models_finest"]
    assert plan.certificate.assumptions["models_place_error_m"] == place_m
    home, ground = plan.mission.home, plan.ground
    home_xy_m = ground.xy_from_lat_lon(np.array([(home.lat_deg, home.lon_deg)]))
    assert home.alt_dsm_m == float(ground.elevation_at(home_xy_m)[0])


def specks() -> tuple[CatalogueModel, CatalogueModel]:
    survey = in_memory(np.zeros((300, 300), np.float32), cell_m=20.0, year=2010, name="survey", place_m=15.0)
    fine = np.zeros((400, 400), np.float32)
    return in_memory(fine, cell_m=0.02, year=2024, name="fine", east_m=1000.0, south_m=1000.0), survey


def test_places_too_far_apart_for_the_cells_are_refused_before_any_is_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(nearby, "counting_in", lambda *_: pytest.fail("looked for who counts"))
    with pytest.raises(RasterTooLargeError, match="more than the limit") as error:
        catalogue_of(specks()).over(at((900.0, 900.0), (1500.0, 1500.0)))
    assert "fine, the finest model here (0.02 m)" in error.value.where


def test_who_counts_is_looked_for_no_longer_than_it_could_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, counting_in = list[int](), nearby.counting_in

    def counted(*args: object) -> set[int]:
        asked.append(1)
        return counting_in(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(nearby, "counting_in", counted)
    assert catalogue_of(specks()).over(at((900.0, 900.0), (1200.0, 1200.0))).place_m == 15.0
    assert len(asked) == 1
