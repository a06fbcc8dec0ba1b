"""What a survey's photos really see, against a slow oracle and against what was asked."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import Camera, FlownLine, MissionParams, PathParams, SurfaceParams, VehicleProfile
from planning.ground.demo_hillside import demo_dsm, demo_survey_polygon
from planning.missions.vehicle_profile import load_profile, path_params
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest, survey_request
from planning.report.summary import plan_summary
from planning.route.survey import SurveyPlan, survey_lines
from planning.route.survey_coverage import SurveyCoverage, photo_places, survey_coverage
from planning.terrain.dsm import Dsm
from tests.reference.photo_cover import photos_of_each_cell

CAMERA = Camera(6000, 4000, 20.0, 23.5, 15.6)
HALF_ACROSS, HALF_ALONG = 23.5 / 40, 15.6 / 40
ORIGIN = (500_000.0, 4_000_000.0)
OFFSET_M = np.array([*ORIGIN, 0.0])
DOWN = MissionParams(camera_trigger_m=4.0, gimbal_pitch_deg=-90.0)


def model(elevation_m: np.ndarray, cell_m: float = 1.0) -> Dsm:
    grid = Affine(cell_m, 0, ORIGIN[0], 0, -cell_m, ORIGIN[1])
    return Dsm(elevation_m.astype(np.float32), grid, CRS.from_epsg(32633), None, "0")


def flight(points_m: list[tuple[float, float, float]]) -> FlownLine:
    points = np.array(points_m) + OFFSET_M
    home = (float(points[0, 0]), float(points[0, 1]))
    return FlownLine(points, np.arange(len(points) - 1), home, 0.0, float(points[0, 2]), True)


def whole(dsm: Dsm, **fields: float) -> SurveyPlan:
    """A survey of all of the model; only its area, spacing and overlaps count here."""
    west, south, east, north = dsm.bounds_m
    corners = dsm.lat_lon_from_xy(np.array([(west, south), (east, south), (east, north), (west, north)]))
    survey = SurveyPlan(
        pois=(),
        line_spacing_m=6.0,
        trigger_distance_m=4.0,
        height_m=20.0,
        gsd_cm=0.4,
        angle_deg=90.0,
        lines=2,
        polygon_lat_lon_deg=tuple((float(lat), float(lon)) for lat, lon in corners),
        side_overlap=0.7,
        front_overlap=0.8,
    )
    return replace(survey, **fields)


@pytest.mark.parametrize("seed", range(4))
def test_as_many_places_are_seen_as_by_looking_through_every_photo(seed: int) -> None:
    """Rough ground with towers and unknown cells, and lines that climb: what stands in between hides."""
    rng = np.random.default_rng(seed)
    elevation = rng.uniform(0, 2, (24, 30))
    elevation[rng.random(elevation.shape) < 0.03] = 14.0
    elevation[5:7, 20:23] = np.nan
    dsm = model(elevation)
    line = flight([(2, -6, 18), (28, -6, 22), (28, -17, 22), (2, -17, 16)])
    mission = replace(DOWN, heading="fixed", heading_deg=30.0) if seed % 2 else DOWN
    got = survey_coverage(dsm, line, whole(dsm), CAMERA, mission)
    photos, directions = photo_places(line.points_m - OFFSET_M, 4.0)
    headings = np.full(len(photos), math.radians(30.0)) if seed % 2 else directions
    top_m = np.nan_to_num(elevation.astype(np.float32), nan=-np.inf)
    shots = [(float(e), float(n), float(u), float(h)) for (e, n, u), h in zip(photos, headings, strict=True)]
    counts = photos_of_each_cell(top_m, 1.0, shots, half_across=HALF_ACROSS, half_along=HALF_ALONG)
    assert got is not None
    assert got.photos == len(photos)
    assert 0.1 < np.mean(counts >= 2) < np.mean(counts >= 1) < 1.0
    assert got.photographed_share == pytest.approx(np.mean(counts >= 1), abs=1e-9)
    assert got.twice_share == pytest.approx(np.mean(counts >= 2), abs=1e-9)


def test_over_flat_ground_the_overlaps_are_those_of_the_footprint() -> None:
    dsm = model(np.zeros((40, 60)))
    line = flight([(0, -10, 20), (60, -10, 20), (60, -16, 20), (0, -16, 20)])
    got = survey_coverage(dsm, line, whole(dsm), CAMERA, DOWN)
    assert got is not None
    assert got.side_overlap == pytest.approx(1 - 6.0 / (20 * 2 * HALF_ACROSS))
    assert got.front_overlap == pytest.approx(1 - 4.0 / (20 * 2 * HALF_ALONG))
    assert got.gsd_cm == pytest.approx(20 * 23.5 * 100 / (6000 * 20))


def test_a_nose_that_points_across_the_lines_swaps_the_overlaps() -> None:
    dsm = model(np.zeros((40, 60)))
    line = flight([(0, -10, 20), (60, -10, 20)])
    north = replace(DOWN, heading="fixed", heading_deg=0.0)
    got = survey_coverage(dsm, line, whole(dsm), CAMERA, north)
    assert got is not None
    assert got.side_overlap == pytest.approx(1 - 6.0 / (20 * 2 * HALF_ALONG))
    assert got.front_overlap == pytest.approx(1 - 4.0 / (20 * 2 * HALF_ACROSS))


def test_photos_are_taken_at_even_distances_over_ground_with_the_line_s_height() -> None:
    places, directions = photo_places(np.array([(0, 0, 5), (0, 0, 9), (10, 0, 19), (10, 5, 19)], dtype=float), 4.0)
    np.testing.assert_allclose(places, [(0, 0, 9), (4, 0, 13), (8, 0, 17), (10, 2, 19)])
    np.testing.assert_allclose(directions, [math.pi / 2] * 3 + [0.0])


def test_a_wall_hides_what_stands_behind_it() -> None:
    ground = np.zeros((20, 60))
    walled = ground.copy()
    walled[:, 24] = 15.0
    line = flight([(5, -10, 20), (25, -10, 20)])
    open_, hidden = (survey_coverage(d, line, whole(d), CAMERA, DOWN) for d in (model(ground), model(walled)))
    assert open_ is not None
    assert hidden is not None
    assert hidden.photographed_share < open_.photographed_share - 0.03


def test_unknown_ground_and_ground_far_from_every_photo_are_not_photographed() -> None:
    elevation = np.zeros((400, 400))
    elevation[:, :40] = np.nan
    dsm = model(elevation)
    got = survey_coverage(dsm, flight([(380, -10, 20), (399, -10, 20)]), whole(dsm), CAMERA, DOWN)
    assert got is not None
    assert got.photographed_share < 0.01
    assert got.faults()
    assert survey_coverage(dsm, flight([(0, -10, 20), (9, -10, 20)]), whole(dsm), CAMERA, MissionParams()) is None


def test_a_fine_model_is_judged_by_the_highest_cell_of_each_block() -> None:
    """A spike on each block of a 1200 x 1200 model: the overlap is that above the spikes."""
    elevation = np.zeros((1200, 1200))
    elevation[::3, ::3] = 10.0
    dsm = model(elevation, 0.02)
    got = survey_coverage(dsm, flight([(0, -12, 20), (24, -12, 20)]), whole(dsm), CAMERA, DOWN)
    assert got is not None
    assert got.side_overlap == pytest.approx(1 - 6.0 / (10 * 2 * HALF_ACROSS), rel=1e-6)
    assert got.area_m2 == pytest.approx(24.0**2, rel=0.01)


def demo_survey(**surface: float) -> tuple[Dsm, PlanRequest]:
    dsm, profile = demo_dsm(), load_profile("mapper-rtk")
    lines = survey_lines(
        demo_survey_polygon(), dsm, camera=profile.camera, gsd_cm=1.0, side_overlap=0.7, front_overlap=0.8
    )
    request = survey_request(PlanRequest(pois=(), profile=profile, path=path_params(profile)), lines)
    return dsm, replace(request, surface=replace(request.surface, **surface))


def test_a_survey_flies_at_the_height_that_eq_1_gives() -> None:
    dsm, request = demo_survey()
    assert request.survey is not None
    assert request.surface.height_m == request.survey.height_m == pytest.approx(51.06, abs=0.01)
    plan = plan_mission(dsm, request)
    assert plan.coverage is not None
    assert plan.coverage.faults() == ()
    assert plan.coverage.twice_share == 1.0
    assert plan_summary(plan, dsm)["survey"]["faults"] == []


def test_lines_spaced_for_another_height_than_flown_are_found_out() -> None:
    """51 m spaced, 5 m flown: most of the area is on one photo at most."""
    dsm, request = demo_survey(height_m=5.0)
    coverage = plan_mission(dsm, request).coverage
    assert coverage is not None
    assert coverage.photographed_share < 0.7
    assert coverage.twice_share < 0.2
    assert len(coverage.faults()) == 3


def test_the_request_s_own_photo_distance_and_gimbal_stay() -> None:
    lines = whole(model(np.zeros((40, 60))))
    mission = MissionParams(camera_trigger_m=7.0, gimbal_pitch_deg=-60.0)
    request = PlanRequest((), VehicleProfile("v"), surface=SurfaceParams(9.0, 3.0), path=PathParams(), mission=mission)
    made = survey_request(request, lines)
    assert (made.mission.camera_trigger_m, made.mission.gimbal_pitch_deg) == (7.0, -60.0)
    assert (made.surface.radius_m, made.surface.height_m) == (9.0, 20.0)
    plain = survey_request(replace(request, mission=MissionParams()), lines)
    assert (plain.mission.camera_trigger_m, plain.mission.gimbal_pitch_deg) == (4.0, -90.0)


FULL = SurveyCoverage(51.0, 1e4, 99, 1.0, 1.0, 0.8, 0.7, 0.8, 0.7, 1.1, 1.0, -90.0)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({}, ""),
        ({"gimbal_pitch_deg": -60.0}, "does not look straight down"),
        ({"gimbal_pitch_deg": None}, "does not look straight down"),
        ({"twice_share": 0.9}, "90% of the area is photographed twice"),
        ({"twice_share": 0.9, "asked_front_overlap": 0.3, "front_overlap": 0.3}, ""),
        ({"photographed_share": 0.5, "asked_front_overlap": 0.3, "front_overlap": 0.3}, "50% of the area"),
        ({"front_overlap": 0.74}, "front overlap is 74%"),
        ({"side_overlap": -math.inf}, "side overlap is 0%"),
        ({"side_overlap": 0.66}, ""),
    ],
)
def test_faults_say_what_is_not_as_asked(fields: dict[str, float], words: str) -> None:
    faults = replace(FULL, **fields).faults()
    assert len(faults) == (1 if words else 0)
    assert words in "".join(faults)
