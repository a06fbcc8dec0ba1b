"""The files of a plan agree with each other and with the plan."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from planning.basics.plan_model import Camera
from planning.formats import kml, qgc_plan, trajectory_csv, wpl
from planning.planner.plan import Plan, plan_mission
from planning.report.exports import FILES, export_file, report_input
from planning.terrain.dsm import Dsm
from tests.planning.format_examples import HOSTILE, geojson_by_role
from tests.planning.plan_examples import QUAD, pois_at, request_over, small_dsm

SECONDS = {"read": 0.5, "total": 1.5}
PLACES = [(0.3, 0.3), (0.7, 0.6)]


@pytest.fixture(scope="module")
def dsm() -> Dsm:
    return small_dsm()


@pytest.fixture(scope="module")
def plan(dsm: Dsm) -> Plan:
    return plan_mission(dsm, request_over(dsm, PLACES))


def export(name: str, plan: Plan, dsm: Dsm, title: str = "hill") -> str:
    return export_file(name, plan, dsm, title=title, created_utc="2026-01-02T03:04:05.678Z", seconds=SECONDS)


def test_all_files(plan: Plan, dsm: Dsm) -> None:
    assert all(export(name, plan, dsm) for name in FILES)
    with pytest.raises(KeyError):
        export("../mission.plan", plan, dsm)


def test_missions_agree(plan: Plan, dsm: Dsm) -> None:
    rows = wpl.read_wpl(export("mission.waypoints", plan, dsm))
    items = qgc_plan.read_plan(export("mission.plan", plan, dsm))
    assert (
        [i.command for i in rows.items] == [i.command for i in items.items] == [i.command for i in plan.mission.items]
    )
    assert [(p.name, p.loiter_s) for p in items.pois] == [(p.name, p.loiter_s) for p in plan.mission.pois]
    for ours, planned in zip(items.pois, plan.mission.pois, strict=True):
        assert (ours.lat_deg, ours.lon_deg) == pytest.approx((planned.lat_deg, planned.lon_deg), abs=1e-9)
    marks = geojson_by_role(export("mission.geojson", plan, dsm))
    waypoints = [mark["geometry"]["coordinates"][1] for mark in marks["waypoint"]]
    assert waypoints == [i.lat_deg for i in plan.mission.items if i.lat_deg]
    summary = marks["path"][0]["properties"]["summary"]
    assert summary["certified"] is True
    assert "dsm" not in summary


def test_paths_agree(plan: Plan, dsm: Dsm) -> None:
    rows = trajectory_csv.read_trajectory(export("trajectory.csv", plan, dsm))
    above_home_m = plan.path.alt_dsm_m - plan.mission.home.alt_dsm_m
    np.testing.assert_allclose(rows.alt_rel_home_m, above_home_m, atol=6e-4)
    track = kml.read_kml_track(export("trajectory.kml", plan, dsm).encode())
    assert len(track.lat_lon_deg) == len(above_home_m)


def test_certificate(plan: Plan, dsm: Dsm) -> None:
    certificate = json.loads(export("certificate.json", plan, dsm))
    assert certificate["created_utc"] == "2026-01-02T03:04:05.678Z"
    assert certificate["seconds"] == SECONDS
    assert len(certificate["legs"]) == len(plan.certificate.legs)
    assert certificate["min_distance_m"] == plan.certificate.min_distance_m


def test_neither_title_nor_time_need_be_given(plan: Plan, dsm: Dsm) -> None:
    before = datetime.now(UTC)
    certificate = json.loads(export_file("certificate.json", plan, dsm))
    assert before - timedelta(milliseconds=1) < datetime.fromisoformat(certificate["created_utc"]) <= datetime.now(UTC)
    assert certificate["seconds"] == {}
    page = export_file("report.html", plan, dsm)
    assert "<h1>Mission</h1>" in page
    assert "Computed in" not in page


def test_report_tells_the_worst_ground_sampling_distance(plan: Plan, dsm: Dsm) -> None:
    camera = Camera(4000, 3000, 8.8, 13.2, 8.8)
    seen = replace(plan, request=replace(plan.request, profile=replace(QUAD, camera=camera)))
    inputs = report_input(seen, title="hill", created_utc="", seconds=SECONDS)
    highest_m = float(np.max(plan.path.alt_dsm_m - plan.path.ground_alt_dsm_m))
    assert inputs.gsd_cm == pytest.approx(100 * highest_m * 13.2 / (8.8 * 4000), rel=0.15)
    assert report_input(plan, title="hill", created_utc="", seconds=SECONDS).gsd_cm is None
    assert [row.chosen for row in inputs.trade].count(True) == 1


def test_hostile_names(dsm: Dsm) -> None:
    pois = tuple(replace(poi, name=HOSTILE) for poi in pois_at(dsm, PLACES))
    plan = plan_mission(dsm, request_over(dsm, PLACES, pois=pois))
    for name in FILES:
        text = export(name, plan, dsm, title=HOSTILE)
        assert not set("\x00\x1b\u202e") & set(text)
        if name in ("report.html", "trajectory.kml"):
            assert "<script" not in text
    assert "&lt;script&gt;" in export("report.html", plan, dsm, title=HOSTILE)
