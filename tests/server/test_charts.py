"""Thinned curves keep their extremes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planning.basics.plan_model import VehicleProfile
from planning.ground.demo_hillside import demo_dsm, demo_pois
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from server.plan.profile_chart import chart, thinned


def test_few_points_stay_as_they_are() -> None:
    assert thinned(np.arange(5.0), np.zeros(5)).tolist() == [0, 1, 2, 3, 4]


@given(st.integers(0, 2**32 - 1), st.integers(2_000, 20_000), st.floats(0, 0.9))
def test_peaks_gorges_ends_and_marks_survive(seed: int, count: int, unknown: float) -> None:
    random = np.random.default_rng(seed)
    ground, path = random.normal(size=count), random.normal(size=count)
    ground[random.random(count) < unknown] = np.nan
    marks = random.integers(0, count, 7)
    keep = thinned(np.arange(count, dtype=float), ground, path, must_keep=marks)
    assert np.all(np.diff(keep) > 0)
    assert len(keep) <= 1700
    assert {0, count - 1, *marks.tolist()} <= set(keep.tolist())
    for curve in (ground, path):
        assert np.nanmin(curve[keep]) == np.nanmin(curve)
        assert np.nanmax(curve[keep]) == np.nanmax(curve)


def test_the_chart_of_the_demo() -> None:
    plan = plan_mission(demo_dsm(), PlanRequest(pois=demo_pois(), profile=VehicleProfile("x")))
    drawn = chart(plan)
    assert len(drawn.s_m) == len(drawn.ground_rel_home_m) == len(drawn.surface_rel_home_m) == len(drawn.path_rel_home_m)
    assert len(drawn.trend_s_m) == len(drawn.trend_distance_m)
    assert len(drawn.flown_s_m) == len(drawn.flown_rel_home_m)
    assert drawn.s_m[-1] == pytest.approx(plan.path.s_m[-1], abs=1e-3)
    assert drawn.poi_names == [poi.name for poi in demo_pois()]
    assert drawn.poi_s_m == sorted(drawn.poi_s_m)
    distances = [distance for distance in drawn.trend_distance_m if distance is not None]
    assert min(distances) == pytest.approx(plan.certificate.trend_distance_m.min(), abs=1e-3)
