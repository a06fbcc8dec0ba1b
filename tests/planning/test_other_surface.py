"""A mission over another surface model than it was planned on."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from planning.formats import qgc_plan, wpl
from planning.formats.other_surface import other_surface
from planning.planner.plan import plan_mission
from planning.report.exports import export_file
from tests.planning.plan_examples import request_over, small_dsm


@pytest.mark.parametrize("form", ["waypoints", "plan"])
def test_files_carry_the_model_and_another_one_is_told(form: str) -> None:
    dsm = replace(small_dsm(), name="hill 2025\n.tif")
    mission = plan_mission(dsm, request_over(dsm, [(0.3, 0.3), (0.7, 0.35)])).mission
    if form == "plan":
        again = qgc_plan.read_plan(qgc_plan.write_plan(mission))
    else:
        again = wpl.read_wpl(wpl.write_wpl(mission))
    assert (again.surface_sha256, again.surface_name) == (dsm.sha256, "hill 2025 .tif")
    assert other_surface(again, dsm) is None
    higher = replace(dsm.with_elevation(dsm.elevation_m + 2.0), sha256="cd" * 32, name="hill 2026.tif")
    said = other_surface(again, higher)
    assert said is not None
    assert 'another surface model, "hill 2026.tif" (SHA-256 cdcdcdcd), than the mission was planned on' in said
    assert f'"hill 2025 .tif" (SHA-256 {dsm.sha256[:8]})' in said
    assert "home's ground is 2.00 m higher here" in said
    scaled = other_surface(again, dsm.with_elevation(dsm.elevation_m - 1.0))
    assert scaled is not None
    assert "read with another scale" in scaled
    assert other_surface(replace(again, surface_sha256=""), higher) is None
    nameless = other_surface(replace(again, surface_name=""), replace(higher, name=""))
    assert nameless is not None
    assert "another surface model, one with SHA-256 cdcdcdcd, than" in nameless


def test_geojson_names_the_model() -> None:
    dsm = replace(small_dsm(), name="hill 2025.tif")
    plan = plan_mission(dsm, request_over(dsm, [(0.3, 0.3), (0.7, 0.35)]))
    text = export_file("mission.geojson", plan, dsm, title="", created_utc="", seconds={})
    home = next(f for f in json.loads(text)["features"] if f["properties"]["role"] == "home")["properties"]
    assert (home["surface_model"], home["surface_name"]) == (dsm.sha256, "hill 2025.tif")
