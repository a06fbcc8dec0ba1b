"""A mission over another surface model than it was planned on."""

from __future__ import annotations

from dataclasses import replace

import pytest

from planning.formats import qgc_plan, wpl
from planning.other_surface import other_surface
from planning.plan import plan_mission
from tests.planning.plan_examples import request_over, small_dsm


@pytest.mark.parametrize("form", ["waypoints", "plan"])
def test_files_carry_the_model_and_another_one_is_told(form: str) -> None:
    dsm = small_dsm()
    mission = plan_mission(dsm, request_over(dsm, [(0.3, 0.3), (0.7, 0.35)])).mission
    if form == "plan":
        again = qgc_plan.read_plan(qgc_plan.write_plan(mission))
    else:
        again = wpl.read_wpl(wpl.write_wpl(mission))
    assert again.surface_sha256 == dsm.sha256
    assert other_surface(again, dsm) is None
    higher = replace(dsm.with_elevation(dsm.elevation_m + 2.0), sha256="cd" * 32)
    said = other_surface(again, higher)
    assert said is not None
    assert "another surface model (SHA-256 cdcdcdcd)" in said
    assert "home's ground is 2.00 m higher here" in said
    scaled = other_surface(again, dsm.with_elevation(dsm.elevation_m - 1.0))
    assert scaled is not None
    assert "read with another scale" in scaled
    assert other_surface(replace(again, surface_sha256=""), higher) is None
