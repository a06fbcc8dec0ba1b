"""Clicks and drags as pure functions on the document."""

from __future__ import annotations

from typing import Any

import pytest

from server.library.edits import clicked, moved, next_poi_name
from server.schemas import PlaceDoc, PlanDoc, PoiDoc, SelectionDoc


def poi(poi_id: str, name: str = "") -> PoiDoc:
    return PoiDoc(id=poi_id, lat_deg=1.0, lon_deg=2.0, name=name, loiter_s=3.0)


def through(tool: Any, document: PlanDoc) -> tuple[str, PlanDoc, SelectionDoc]:
    outcome = clicked(document, SelectionDoc(tool=tool, poi_id="old"), 10.0, 20.0)
    assert outcome is not None
    return outcome


def test_add_point_appends_and_selects_it() -> None:
    label, document, selection = through("add_poi", PlanDoc(source="survey", pois=[poi("a", "P1")]))
    assert (label, document.source) == ("Add P2", "pois")
    assert [p.name for p in document.pois] == ["P1", "P2"]
    assert (document.pois[1].lat_deg, document.pois[1].lon_deg) == (10.0, 20.0)
    assert selection == SelectionDoc(tool="add_poi", poi_id=document.pois[1].id)


def test_polygon_appends_a_corner_and_stays_in_hand() -> None:
    label, document, selection = through("polygon", PlanDoc())
    assert (label, document.source, selection.tool) == ("Add corner", "survey", "polygon")
    assert document.survey.polygon == [PlaceDoc(lat_deg=10.0, lon_deg=20.0)]


@pytest.mark.parametrize("tool", ["add_poi", "polygon", "fence_polygon"])
def test_the_second_click_of_a_double_click_adds_nothing(tool: Any) -> None:
    _, once, selection = through(tool, PlanDoc())
    assert clicked(once, selection, 10.0, 20.0) is None
    elsewhere = clicked(once, selection, 10.0, 20.00001)
    assert elsewhere is not None
    back = clicked(elsewhere[1], elsewhere[2], 10.0, 20.0)
    assert back is not None, "a place may be passed twice, as long as it is left between"


def test_home_and_look_at_are_set_once() -> None:
    _, with_home, selection = through("home", PlanDoc())
    assert (with_home.home, selection.tool) == (PlaceDoc(lat_deg=10.0, lon_deg=20.0), "select")
    _, looking, selection = through("look_at", PlanDoc())
    assert (looking.mission.heading, looking.mission.look_at) == ("point", PlaceDoc(lat_deg=10.0, lon_deg=20.0))
    assert selection.tool == "select"


def test_the_select_tool_edits_nothing() -> None:
    assert clicked(PlanDoc(), SelectionDoc(), 10.0, 20.0) is None


def test_names_fill_gaps() -> None:
    assert next_poi_name(PlanDoc(pois=[poi("a", "P1"), poi("b", "P3"), poi("c")])) == "P2"


def test_a_drag_moves_one_point_and_keeps_the_rest_of_it() -> None:
    before = PlanDoc(pois=[poi("a", "A"), poi("b")])
    outcome = moved(before, "b", 10.0, 20.0)
    assert outcome is not None
    label, document = outcome
    assert label == "Move point"
    assert document.pois[0] == before.pois[0]
    assert document.pois[1] == before.pois[1].model_copy(update={"lat_deg": 10.0, "lon_deg": 20.0})
    assert moved(before, "gone", 10.0, 20.0) is None
