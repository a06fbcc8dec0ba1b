"""Back-and-forth lines over a polygon."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.basics.plan_model import Camera
from planning.errors import ParameterError, PoiError
from planning.route.survey import SurveyPlan, survey_lines
from planning.terrain.dsm import Dsm

CAMERA = Camera(6000, 4000, 20.0, 23.5, 15.6)
CORNER = np.array([500_000.0, 5_000_000.0])
RECTANGLE = np.array([[20.0, 20.0], [120.0, 20.0], [120.0, 60.0], [20.0, 60.0]])
U_SHAPE = np.array(
    [[20, 20], [140, 20], [140, 90], [100, 90], [100, 40], [60, 40], [60, 90], [20, 90]], dtype=np.float64
)


def terrain(unknown: slice | None = None) -> Dsm:
    elevation = np.zeros((120, 160), dtype=np.float32)
    if unknown is not None:
        elevation[:, unknown] = np.nan
    return Dsm(elevation, Affine(1, 0, CORNER[0], 0, -1, CORNER[1] + 120), CRS.from_epsg(32633), None, "0")


def plan(shape_m: np.ndarray, dsm: Dsm | None = None, **asked: Any) -> SurveyPlan:
    dsm = dsm or terrain()
    keywords = {"gsd_cm": 0.5, "side_overlap": 0.6, "front_overlap": 0.7} | asked
    return survey_lines(dsm.lat_lon_from_xy(shape_m + CORNER), dsm, camera=CAMERA, **keywords)


def ends_m(survey: SurveyPlan) -> np.ndarray:
    degrees = np.array([(p.lat_deg, p.lon_deg) for p in survey.pois])
    return (terrain().xy_from_lat_lon(degrees) - CORNER).reshape(-1, 2, 2)


def test_lines_run_along_the_longest_edge_and_back() -> None:
    survey = plan(RECTANGLE)
    assert survey.angle_deg == pytest.approx(90, abs=1e-3)
    lines = ends_m(survey)
    assert len(lines) == survey.lines
    np.testing.assert_allclose(np.ptp(lines[:, :, 1], axis=1), 0, atol=1e-3)
    np.testing.assert_allclose(np.abs(np.diff(lines[:, :, 0], axis=1)), 100, atol=1e-3)
    direction = np.sign(lines[:, 1, 0] - lines[:, 0, 0])
    assert np.all(direction[1:] == -direction[:-1])


def test_spacing_and_trigger_follow_from_eq_1_and_the_overlaps() -> None:
    survey = plan(RECTANGLE)
    assert survey.height_m == pytest.approx(6000 * 0.5 * 20 / 2350)
    across_m = 6000 * 0.005
    assert survey.line_spacing_m <= across_m * 0.4 + 1e-9
    assert survey.line_spacing_m == pytest.approx(40 / np.ceil(40 / (across_m * 0.4)), rel=1e-4)
    assert survey.trigger_distance_m == pytest.approx(across_m * 15.6 / 23.5 * 0.3)
    assert survey.gsd_cm == pytest.approx(0.5)


def test_a_height_may_be_given_instead_of_a_gsd() -> None:
    assert plan(RECTANGLE, gsd_cm=None, height_m=30.0).height_m == 30.0
    for gsd_cm, height_m in ((None, None), (1.0, 30.0)):
        with pytest.raises(ParameterError, match="either"):
            plan(RECTANGLE, gsd_cm=gsd_cm, height_m=height_m)


@pytest.mark.parametrize("angle_deg", [0.0, 30.0, 135.0, 200.0])
def test_lines_take_the_angle_asked_for(angle_deg: float) -> None:
    lines = ends_m(plan(RECTANGLE, angle_deg=angle_deg))
    step = lines[:, 1] - lines[:, 0]
    angle = np.degrees(np.arctan2(step[:, 0], step[:, 1])) % 180
    np.testing.assert_allclose((angle - angle_deg + 90) % 180, 90, atol=0.01)


def test_every_place_of_a_concave_polygon_is_near_a_line() -> None:
    survey = plan(U_SHAPE)
    lines = ends_m(survey)
    a, b = lines[:, 0], lines[:, 1]
    y, x = np.mgrid[21:90:2, 21:60:2]
    for p in np.column_stack([x.ravel(), y.ravel()]).astype(float):
        t = np.clip(((p - a) * (b - a)).sum(axis=1) / ((b - a) ** 2).sum(axis=1), 0, 1)
        gap = np.hypot(*(a + t[:, None] * (b - a) - p).T).min()
        assert gap <= survey.line_spacing_m / 2 * 1.01


TRIANGLE = np.array([[20.0, 20.0], [140.0, 30.0], [60.0, 100.0]])
SLIVER = np.array([[20.0, 20.0], [140.0, 60.0], [140.0, 60.4]])


@pytest.mark.parametrize("shape", [TRIANGLE, SLIVER, U_SHAPE])
@pytest.mark.parametrize("height_m", [5.0, 20.0, 60.0])
@pytest.mark.parametrize("angle_deg", [None, 0.0, 77.0])
def test_every_place_is_photographed(shape: np.ndarray, height_m: float, angle_deg: float | None) -> None:
    """Also where the outline runs askew to the lines and a line through the strip's middle would end early."""
    survey = plan(shape, gsd_cm=None, height_m=height_m, angle_deg=angle_deg)
    lines = ends_m(survey)
    steps = np.linspace(0, 1, 41)[:, None]
    corners = np.vstack([shape, shape[:1]])
    outline = np.concatenate([a + steps * (b - a) for a, b in pairwise(corners)])
    for p in outline:
        along = (lines[:, 1] - lines[:, 0]) / np.hypot(*(lines[:, 1] - lines[:, 0]).T)[:, None]
        off = p - lines[:, 0]
        x, y = (off * along).sum(axis=1), off[:, 0] * along[:, 1] - off[:, 1] * along[:, 0]
        beside = np.abs(y) <= survey.line_spacing_m / 2 + 0.02
        assert (beside & (x >= -0.02) & (x <= np.hypot(*(lines[:, 1] - lines[:, 0]).T) + 0.02)).any()


def test_parts_of_one_line_are_flown_in_its_direction() -> None:
    lines = ends_m(plan(U_SHAPE, angle_deg=90.0))
    rows = np.round(lines[:, 0, 1], 1)
    doubled = [row for row in np.unique(rows) if (rows == row).sum() == 2]
    assert doubled
    for row in doubled:
        xs = lines[rows == row][:, :, 0].ravel()
        assert np.all(np.diff(xs) > 0) or np.all(np.diff(xs) < 0)


def test_unknown_terrain_is_named_with_its_place() -> None:
    with pytest.raises(PoiError, match=r"line 1\.") as error:
        plan(RECTANGLE, terrain(unknown=slice(70, 80)))
    assert "survey at 45.15" in error.value.where
    assert "unknown 50." in error.value.what


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        (RECTANGLE[:2], "three corners"),
        (RECTANGLE[[0, 2, 1, 3]], "crosses itself"),
        (RECTANGLE[0] + np.array([[0, 0], [0.5, 0], [0.5, 0.5]]), "covers"),
    ],
)
def test_useless_polygons_are_refused(shape: np.ndarray, message: str) -> None:
    with pytest.raises(PoiError, match=message):
        plan(shape)


def test_a_closed_outline_is_taken_as_it_is_meant() -> None:
    assert plan(np.vstack([RECTANGLE, RECTANGLE[:1]])).lines == plan(RECTANGLE).lines


def test_useless_parameters_are_refused() -> None:
    with pytest.raises(ParameterError, match="overlap"):
        plan(RECTANGLE, side_overlap=1.0)
    with pytest.raises(ParameterError, match="angle"):
        plan(RECTANGLE, angle_deg=float("nan"))
    with pytest.raises(ParameterError, match="lines"):
        plan(RECTANGLE, gsd_cm=0.0005)
    with pytest.raises(ParameterError, match="camera"):
        survey_lines(RECTANGLE, terrain(), camera=None, gsd_cm=1.0, side_overlap=0.5, front_overlap=0.5)
