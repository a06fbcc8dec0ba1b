"""A survey in parts: the same lines, the same area, no part longer than it may be."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.polygons import area_m2
from planning.errors import ParameterError
from planning.route.survey import SurveyPlan
from planning.route.survey_parts import LineCosts, Lines, part_of, parts_in_number, parts_within
from tests.planning.test_survey import CORNER, RECTANGLE, U_SHAPE, plan, terrain


def costs_of(survey: SurveyPlan, home_m: tuple[float, float] | None = None) -> LineCosts:
    model = terrain()
    home = None if home_m is None else tuple(model.lat_lon_from_xy(np.array([home_m]) + CORNER)[0].tolist())
    return LineCosts(survey, model, home_lat_lon_deg=home, mean_speed_m_s=2.0, each_s=10.0)


TRIANGLE = np.array([[20.0, 20.0], [150.0, 20.0], [20.0, 110.0]])


@pytest.fixture(scope="module")
def rectangle() -> LineCosts:
    return costs_of(plan(RECTANGLE))


@pytest.fixture(scope="module")
def several(rectangle: LineCosts) -> list[LineCosts]:
    """Of lines that are alike and of such that are not, from near and from far."""
    triangle = plan(TRIANGLE, angle_deg=90.0)
    others = [(plan(RECTANGLE), (300.0, 40.0)), (triangle, None), (triangle, (0.0, 0.0))]
    return [rectangle, *(costs_of(survey, home) for survey, home in others)]


def slow_seconds(survey: SurveyPlan, lines: Lines, home_m: tuple[float, float] | None) -> float:
    """The way from point to point, one after another."""
    pois = [poi for k, row in enumerate(survey.row_of) if row in range(lines.first, lines.stop)
            for poi in survey.pois[2 * k : 2 * k + 2]]  # fmt: skip
    places = [
        tuple(place) for place in (terrain().xy_from_lat_lon(np.array([(p.lat_deg, p.lon_deg) for p in pois])) - CORNER)
    ]
    home = places[0] if home_m is None else home_m
    return 10.0 + sum(math.dist(a, b) for a, b in pairwise([home, *places, home])) / 2.0


@pytest.mark.parametrize("shape", [RECTANGLE, U_SHAPE])
@pytest.mark.parametrize("angle_deg", [None, 0.0, 37.0])
def test_parts_have_all_lines_and_all_of_the_area(shape: np.ndarray, angle_deg: float | None) -> None:
    survey, model = plan(shape, angle_deg=angle_deg), terrain()
    parts = [part_of(survey, model, lines) for lines in parts_in_number(costs_of(survey), 3)]
    assert [poi for part in parts for poi in part.pois] == list(survey.pois)
    assert sum(part.lines for part in parts) == survey.lines
    areas_m2 = [area_m2(model.xy_from_lat_lon(np.array(part.polygon_lat_lon_deg))) for part in parts]
    assert sum(areas_m2) == pytest.approx(area_m2(shape), rel=1e-5)
    assert min(areas_m2) > 0.1 * area_m2(shape)


def test_each_place_of_the_area_lies_beside_a_line_of_its_part() -> None:
    survey, model = plan(RECTANGLE, angle_deg=90.0), terrain()
    for lines in parts_in_number(costs_of(survey), 4):
        part = part_of(survey, model, lines)
        ys_m = model.xy_from_lat_lon(np.array([(p.lat_deg, p.lon_deg) for p in part.pois]))[:, 1]
        area_ys_m = model.xy_from_lat_lon(np.array(part.polygon_lat_lon_deg))[:, 1]
        half_m = survey.line_spacing_m / 2
        assert area_ys_m.min() == pytest.approx(ys_m.min() - half_m, abs=0.02)
        assert area_ys_m.max() == pytest.approx(ys_m.max() + half_m, abs=0.02)


def test_one_part_is_the_survey_itself() -> None:
    survey = plan(U_SHAPE)
    assert part_of(survey, terrain(), Lines(0, survey.lines)) == survey


@pytest.mark.parametrize("home_m", [None, (0.0, 0.0), (80.0, 110.0)])
def test_seconds_are_those_of_the_way_from_point_to_point(home_m: tuple[float, float] | None) -> None:
    survey = plan(U_SHAPE, angle_deg=90.0)
    costs = costs_of(survey, home_m)
    for first in range(survey.lines):
        for stop in range(first + 1, survey.lines + 1):
            found_s = costs.seconds(Lines(first, stop))
            assert found_s == pytest.approx(slow_seconds(survey, Lines(first, stop), home_m), abs=1e-6)


@given(most_s=st.floats(10.0, 900.0), which=st.integers(0, 3))
def test_parts_take_no_longer_than_they_may(several: list[LineCosts], most_s: float, which: int) -> None:
    costs = several[which]
    parts = parts_within(costs, most_s)
    assert [line for part in parts for line in range(part.first, part.stop)] == list(range(len(costs)))
    for part in parts:
        assert len(part) == 1 or costs.seconds(part) <= most_s
    if len(parts) > 1 and all(costs.seconds(Lines(k, k + 1)) <= most_s for k in range(len(costs))):
        assert costs.seconds(Lines(0, len(costs))) > most_s


def test_beside_a_line_that_is_too_long_the_others_are_not(several: list[LineCosts]) -> None:
    triangle = several[2]
    assert triangle.seconds(Lines(0, 1)) == max(triangle.seconds(Lines(k, k + 1)) for k in range(len(triangle)))
    most_s = 0.95 * triangle.seconds(Lines(0, 1))
    parts = parts_within(triangle, most_s)
    assert parts[0] == Lines(0, 1)
    assert any(len(part) > 1 for part in parts)
    assert all(triangle.seconds(part) <= most_s for part in parts[1:])


@given(count=st.integers(1, 40))
def test_so_many_parts_as_asked(rectangle: LineCosts, count: int) -> None:
    costs = rectangle
    if count > len(costs):
        with pytest.raises(ParameterError, match=r"has no \d+ parts"):
            parts_in_number(costs, count)
        return
    parts = parts_in_number(costs, count)
    assert len(parts) == count
    assert [line for part in parts for line in range(part.first, part.stop)] == list(range(len(costs)))


def test_parts_are_alike(rectangle: LineCosts) -> None:
    costs = rectangle
    seconds = [costs.seconds(part) for part in parts_in_number(costs, 2)]
    assert max(seconds) < 1.35 * min(seconds)


def test_lines_are_named_as_people_count() -> None:
    assert [Lines(0, 1).words, Lines(2, 5).words] == ["line 1", "lines 3 to 5"]
