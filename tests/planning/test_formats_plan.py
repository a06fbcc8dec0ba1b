import json
import math
from typing import Any

import pytest

from planning.basics.plan_model import Home, Mission, MissionItem
from planning.errors import FormatError
from planning.formats.detect import read_mission
from planning.formats.qgc_plan import read_plan, write_plan
from tests.planning.format_examples import HOSTILE, make_dsm, make_mission, make_path


def plan_with(items: list[Any], **changes: Any) -> str:
    mission = {"version": 2, "firmwareType": 3, "items": items, "plannedHomePosition": [47.0, 8.0, 400.0], **changes}
    return json.dumps({"fileType": "Plan", "version": 1, "mission": mission})


def simple(**changes: Any) -> dict[str, Any]:
    return {"type": "SimpleItem", "command": 16, "frame": 3, "params": [0, 0, 0, None, 47.0, 8.0, 20]} | changes


def test_a_mission_survives_the_round_trip():
    dsm = make_dsm(None)
    mission = make_mission(dsm, make_path(dsm), ("P1", "Hütte", ""))
    back = read_plan(write_plan(mission))
    assert [i.command for i in back.items] == [i.command for i in mission.items]
    assert [i.alt_m for i in back.items] == [i.alt_m for i in mission.items]
    assert [p.name for p in back.pois] == ["P1", "Hütte", ""]
    assert back.home.alt_dsm_m == mission.home.alt_dsm_m
    assert back.home.vertical_datum is None
    assert back.cruise_speed_m_s == 3.0
    assert back.warnings == ()


def test_hostile_names_lose_their_control_characters():
    dsm = make_dsm()
    back = read_plan(write_plan(make_mission(dsm, make_path(dsm), (HOSTILE, "", ""))))
    assert back.pois[0].name == "<script>alert(1)</script>&\"']]>, line break"


def test_not_a_number_is_null_both_ways():
    mission = Mission(Home(47.0, 8.0, math.nan), (MissionItem(16, 3, (0.0, 0.0, 0.0, math.nan), 47.0, 8.0, 5.0),))
    text = write_plan(mission)
    assert "NaN" not in text
    assert math.isnan(read_plan(text).items[0].params[3])
    assert math.isnan(read_plan(text).home.alt_dsm_m)


def test_a_real_plan_is_read(shared_data):
    mission = read_mission("s", (shared_data / "missions/mavsdk/qgroundcontrol_sample.plan").read_bytes())
    assert [i.command for i in mission.items] == [22, 16, 2000, 16, 16, 20]
    assert mission.firmware == "px4"
    assert mission.home.alt_dsm_m == pytest.approx(488.931, abs=1e-3)
    assert mission.cruise_speed_m_s == 5.0


def test_a_survey_becomes_the_items_that_it_embeds(shared_data):
    mission = read_mission("s", (shared_data / "missions/mavsdk/qgroundcontrol_sample_with_survey.plan").read_bytes())
    assert len(mission.items) == 13
    assert mission.items[0].command == 530


@pytest.mark.parametrize(
    ("file", "where", "what"),
    [
        ("qgroundcontrol_sample_with_structured_scan.plan", "$.mission.items[1]", "StructureScan"),
        ("qgroundcontrol_sample_with_survey_missing_items.plan", "$.mission.items[1]", "survey"),
        ("qgroundcontrol_sample_without_mission.plan", "$.mission", "missing"),
        ("qgroundcontrol_sample_wrong_overall_version.plan", "$.version", "42"),
    ],
)
def test_broken_plans_are_named_with_their_place(shared_data, file, where, what):
    with pytest.raises(FormatError, match=what) as caught:
        read_mission(file, (shared_data / "missions/mavsdk" / file).read_bytes())
    assert caught.value.where.endswith(where)
    assert caught.value.advice


@pytest.mark.parametrize(
    ("items", "words"),
    [
        ([simple(params=[0] * 6)], "7 params"),
        ([simple(params=[0, 0, 0, 0, 47, 8, None])], "no altitude"),
        ([simple(params=[0, 0, 0, 0, None, 8, 5])], "Only one"),
        ([simple(params=[0, 0, 0, 0, 95, 8, 5])], "no place on Earth"),
        ([simple(params=[0, 0, 0, 0, "a", 8, 5])], "number"),
        ([simple(command="16x")], "number"),
        ([simple(frame=-1)], "whole"),
        (["text"], "object"),
        ([{"type": "ComplexItem"}], "embed"),
        ({}, "list"),
    ],
)
def test_bad_items_are_refused(items, words):
    with pytest.raises(FormatError, match=words) as caught:
        read_plan(plan_with(items), "bad.plan")
    assert "$.mission.items" in caught.value.where


def test_the_frame_beats_the_altitude_mode():
    mission = read_plan(plan_with([simple(AltitudeMode=2)]))
    assert mission.items[0].frame == 3
    assert "AltitudeMode 2" in mission.warnings[0]


def test_a_plan_without_home_takes_the_first_place():
    mission = read_plan(plan_with([simple()], plannedHomePosition=None))
    assert (mission.home.lat_deg, mission.home.lon_deg) == (47.0, 8.0)
    assert "no home" in mission.warnings[0]


def test_swapped_coordinates_are_noticed():
    mission = read_plan(plan_with([simple(params=[0, 0, 0, 0, 8.0, 47.0, 20])]))
    assert any("swapped" in w for w in mission.warnings)


def test_a_plan_keeps_its_fence_and_its_rally_points():
    plan = json.loads(plan_with([simple()]))
    ring = [[47.0, 8.0], [47.0, 8.001], [47.001, 8.001]]
    plan |= {
        "geoFence": {
            "polygons": [{"polygon": ring, "inclusion": True, "version": 1}],
            "circles": [{"circle": {"center": [47.0, 8.0], "radius": 30.5}, "inclusion": False, "version": 1}],
        },
        "rallyPoints": {"points": [[47.0, 8.0, 30]]},
    }
    mission = read_plan(json.dumps(plan))
    assert mission.fence.polygons[0].corners_lat_lon_deg == ((47.0, 8.0), (47.0, 8.001), (47.001, 8.001))
    assert (mission.fence.circles[0].radius_m, mission.fence.circles[0].inclusion) == (30.5, False)
    assert mission.rally[0].alt_rel_home_m == 30
    again = read_plan(write_plan(mission))
    assert (again.fence, again.rally) == (mission.fence, mission.rally)


def test_a_fence_that_cannot_be_read_stops_the_plan():
    plan = json.loads(plan_with([simple()]))
    plan |= {"geoFence": {"polygons": [{}], "circles": []}}
    with pytest.raises(FormatError) as caught:
        read_plan(json.dumps(plan))
    assert caught.value.where.endswith("$.geoFence.polygons[0]")
