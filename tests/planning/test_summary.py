"""The figures of a plan as JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from pyproj import CRS

from planning.planner.plan import Plan, plan_mission
from planning.report.summary import certificate_summary, crs_name, dsm_summary, plan_summary, unknown_share
from planning.terrain.dsm import Dsm
from tests.planning.plan_examples import request_over, small_dsm


@pytest.fixture(scope="module")
def dsm() -> Dsm:
    return small_dsm()


@pytest.fixture(scope="module")
def plan(dsm: Dsm) -> Plan:
    return plan_mission(dsm, request_over(dsm, [(0.3, 0.3), (0.7, 0.6)]))


def test_plan_summary_is_json_and_true(plan: Plan, dsm: Dsm) -> None:
    summary = plan_summary(plan, dsm)
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert summary["items"] == len(plan.mission.items)
    assert summary["samples"] == len(plan.path.s_m)
    assert summary["length_m"] == plan.path.s_m[-1]
    assert summary["duration_s"] == plan.predicted.total_s
    assert summary["usable_endurance_s"] == 900.0
    assert summary["certified"] is plan.certificate.certified


def test_infinite_figures_become_null(plan: Plan) -> None:
    lost = replace(plan.certificate, rtl_height_needed_m=np.inf, min_vertical_m=-np.inf)
    summary = certificate_summary(lost)
    assert summary["rtl_height_needed_m"] is None
    assert summary["min_vertical_m"] is None


def test_model_as_read(dsm: Dsm) -> None:
    holed_m = dsm.elevation_m.copy()
    holed_m[:25] = np.nan
    summary = dsm_summary(dsm, dsm.with_elevation(holed_m).window(0, 0, 50, 100), holes_filled=3)
    assert summary == {
        "sha256": dsm.sha256,
        "crs": "EPSG:32633",
        "vertical_datum": dsm.vertical_datum,
        "width": 100,
        "height": 100,
        "resolution_m": 0.5,
        "part": {"width": 100, "height": 50},
        "unknown_share": 0.5,
        "holes_filled": 3,
    }


def test_unknown_share_in_blocks(dsm: Dsm, monkeypatch: pytest.MonkeyPatch) -> None:
    holed_m = dsm.elevation_m.copy()
    holed_m[-1, :50] = np.nan
    assert unknown_share(dsm.with_elevation(holed_m)) == pytest.approx(0.005)


def test_name_of_a_system_without_a_code(dsm: Dsm) -> None:
    own = CRS.from_proj4("+proj=tmerc +lat_0=37.7 +lon_0=15 +k=1 +x_0=0 +y_0=0 +ellps=GRS80 +units=m")
    assert crs_name(replace(dsm, crs=own)) == own.name
