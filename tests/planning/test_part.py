"""Only a part of a large model is looked at, and the plan is the one over the whole."""

from __future__ import annotations

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from mapping.geometry.arrays import F64
from planning.basics.plan_model import PathParams, Poi, SurfaceParams, VehicleProfile
from planning.planner import part, plan
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import Dsm, SurfaceModel


def hills(size: int = 1400) -> Dsm:
    random = np.random.default_rng(4)
    y, x = np.mgrid[:size, :size] * 0.5
    z = 100 + 5 * np.sin(x / 40) + 4 * np.cos(y / 31) + random.normal(0, 0.02, x.shape)
    z[size // 2 + 30, size // 2 + 55] += 25.0
    z[size // 2 : size // 2 + 2, size // 2 - 30] = np.nan
    return Dsm(z.astype(np.float32), Affine(0.5, 0, 5e5, 0, -0.5, 4.17e6), CRS.from_epsg(32633), None, "")


DSM = hills()


def request(*, height_m: float = 5.0, reach_m: float = 60.0) -> PlanRequest:
    west, _, _, north = DSM.bounds_m
    xy_m = np.array(
        [[west + 350, north - 350], [west + 350 + reach_m, north - 330], [west + 370, north - 350 - reach_m]]
    )
    pois = tuple(Poi(lat, lon) for lat, lon in DSM.lat_lon_from_xy(xy_m).tolist())
    return PlanRequest(
        pois=pois,
        profile=VehicleProfile("part", position_error_m=0.1, rtl_height_m=60.0),
        surface=SurfaceParams(6.0, height_m),
        path=PathParams(),
    )


def both(monkeypatch: pytest.MonkeyPatch, asked: PlanRequest) -> tuple[Plan, Plan]:
    whole = plan_mission(DSM, asked)
    assert whole.dsm.elevation_m.shape == DSM.elevation_m.shape
    monkeypatch.setattr(part, "LARGE_PX", 1000)
    return whole, plan_mission(DSM, asked)


def assert_same_flight(one: Plan, other: Plan) -> None:
    np.testing.assert_allclose(one.line.points_m, other.line.points_m, atol=1e-6)
    for key in ("certified", "min_distance_m", "min_vertical_m", "rtl_height_needed_m", "max_height_above_ground_m"):
        assert getattr(one.certificate, key) == pytest.approx(getattr(other.certificate, key), abs=1e-6)
    np.testing.assert_allclose(one.certificate.trend_distance_m, other.certificate.trend_distance_m, atol=1e-6)
    assert [reason.code for reason in one.certificate.reasons] == [reason.code for reason in other.certificate.reasons]


def test_the_plan_over_a_part_is_the_plan_over_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, cut = both(monkeypatch, request())
    assert cut.dsm.elevation_m.size < 0.5 * DSM.elevation_m.size
    assert_same_flight(cut, whole)
    assert cut.holes.count == 1


def test_the_part_grows_until_nothing_that_was_found_is_as_far_as_its_border(monkeypatch: pytest.MonkeyPatch) -> None:
    margins_m: list[float] = []
    box_of = part._needed_box

    def noted(model: SurfaceModel, xy_m: F64, margin_m: float) -> tuple[int, int, int, int]:
        margins_m.append(margin_m)
        return box_of(model, xy_m, margin_m)

    monkeypatch.setattr(part, "_needed_box", noted)
    monkeypatch.setattr(plan, "least_margin_m", lambda model, asked: 12.0)
    whole, cut = both(monkeypatch, request(height_m=14.0))
    assert margins_m[-2:] == [12.0, 36.0]
    assert_same_flight(cut, whole)


def test_a_small_hole_that_the_part_cuts_is_no_border_to_rely_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the whole model it is filled; in the part it stays unknown, which counts as infinitely high."""
    monkeypatch.setattr(part, "LARGE_PX", 1000)
    heights = np.full((200, 300), 100.0, dtype=np.float32)
    heights[100, 60:72] = np.nan  # 3 m2, 6 m long
    model = Dsm(heights, Affine(0.5, 0, 5e5, 0, -0.5, 4.17e6), CRS.from_epsg(32633), None, "")
    west, _, _, north = model.bounds_m
    here = np.array([[west + 50.0, north - 50.0]])

    def deep_m(margin_m: float) -> float:
        ground = part.Grounds(model, 4.0).around(here, margin_m)
        return part._cut_holes_m(ground, model)

    assert deep_m(17.0) == pytest.approx(3.0)  # its west end lies 17 m west of the middle: 3 m of it are cut off
    assert deep_m(25.0) == 0.0
    assert deep_m(10.0) == 0.0
