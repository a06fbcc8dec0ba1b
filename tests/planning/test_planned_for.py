"""A mission's own files carry the vehicle and the demands it was planned with."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from planning.basics.plan_model import Mission, PlannedFor
from planning.formats.planned_for import planned_for_line
from planning.formats.qgc_plan import read_plan, write_plan
from planning.formats.wpl import read_wpl, write_wpl
from planning.missions.vehicle_profile import load_profile
from tests.planning.format_examples import HOSTILE, make_dsm, make_mission, make_path

PLANNED = PlannedFor(replace(load_profile("mapper-rtk"), following_m=0.3, name="naïve # drone"), "guided", 2.5, 120.0)


@pytest.fixture
def mission() -> Mission:
    dsm = make_dsm()
    return make_mission(dsm, make_path(dsm))


@pytest.mark.parametrize("planned", [PLANNED, PlannedFor(load_profile("x500-rtk-px4"))])
def test_both_formats_carry_it(mission: Mission, planned: PlannedFor) -> None:
    flight = replace(mission, planned_for=planned)
    assert read_wpl(write_wpl(flight)).planned_for == planned
    assert read_plan(write_plan(flight)).planned_for == planned


def test_missions_of_others_carry_none(mission: Mission) -> None:
    assert read_wpl(write_wpl(mission)).planned_for is None
    assert read_wpl(write_wpl(replace(mission, planned_for=PLANNED), comments=False)).planned_for is None
    assert read_plan(write_plan(mission)).planned_for is None


@pytest.mark.parametrize(
    "change",
    [
        {"profile": None},
        {"profile": {"name": "a", "radius_m": -1.0}},
        {"profile": {"name": "a", "unheard": 1.0}},
        {"way": "by magic"},
        {"required_clearance_m": -2.0},
        {"required_clearance_m": "much"},
        {"more": 1},
    ],
)
def test_what_makes_no_sense_is_left_out_and_said(mission: Mission, change: dict[str, object]) -> None:
    text = json.dumps(json.loads(planned_for_line(PLANNED)) | change)
    found = read_wpl(f"QGC WPL 110\n# planned_for: {text}\n" + write_wpl(mission, comments=False).split("\n", 1)[1])
    assert found.planned_for is None
    assert len(found.items) == len(mission.items)
    assert any("cannot be read and is left out" in warning for warning in found.warnings)


def test_hostile_names_stay_on_their_line(mission: Mission) -> None:
    planned = PlannedFor(replace(PLANNED.profile, name=HOSTILE))
    text = write_wpl(replace(mission, planned_for=planned))
    assert len(text.splitlines()) == len(write_wpl(replace(mission, planned_for=PLANNED)).splitlines())
    assert read_wpl(text).items == read_wpl(write_wpl(mission)).items
