"""``hedgehop survey`` on the demo terrain."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from planning.formats.qgc_plan import read_plan
from planning.ground.demo_hillside import demo_survey_polygon
from planning.missions.vehicle_profile import load_profile
from planning.planner.plan import plan_mission
from planning.terrain.geotiff import read_dsm
from server.library.documents import doc_from_profile, request_from_doc
from server.schemas import PlaceDoc, PlanDoc, SurveyDoc
from tests.server.cli_runs import hedgehop, write_demo


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_demo(tmp_path_factory.mktemp("inputs"))[0]


@pytest.fixture
def area(tmp_path: Path) -> Path:
    ring = [[float(lon), float(lat)] for lat, lon in demo_survey_polygon()]
    file = tmp_path / "area.geojson"
    file.write_text(json.dumps({"type": "Polygon", "coordinates": [[*ring, ring[0]]]}))
    return file


def test_survey_is_certified(model: Path, area: Path, tmp_path: Path) -> None:
    run = hedgehop("survey", model, area, "--out", tmp_path / "out", "--json")
    assert run.code == 0
    assert "lines" in run.err
    assert "1.00 cm per pixel" in run.err
    assert run.json["min_vertical_m"] > 45
    items = json.loads((tmp_path / "out" / "mission.plan").read_text())["mission"]["items"]
    photos = [item["params"][0] for item in items if item["command"] == 206]
    assert photos[0] > 0
    assert photos[-1] == 0
    assert [item["params"][0] for item in items if item["command"] == 205] == [-90]


def test_survey_says_what_its_photos_see(model: Path, area: Path, tmp_path: Path) -> None:
    run = hedgehop("survey", model, area, "--out", tmp_path / "out")
    assert "100 % at least twice; overlap over the surface 79 % front, 74 % side (80 %, 70 % asked)" in run.out
    certificate = json.loads((tmp_path / "out" / "certificate.json").read_text())
    assert certificate["survey"]["faults"] == []
    assert certificate["survey"]["height_m"] == pytest.approx(51.06, abs=0.01)


def test_the_browser_s_survey_is_the_command_line_s(model: Path, area: Path, tmp_path: Path) -> None:
    """One document and one command line ask for the same flight."""
    hedgehop("survey", model, area, "--out", tmp_path / "out")
    corners = [PlaceDoc(lat_deg=lat, lon_deg=lon) for lat, lon in demo_survey_polygon().tolist()]
    profile = doc_from_profile(load_profile("mapper-rtk"))
    dsm = read_dsm(model)
    plan = plan_mission(
        dsm, request_from_doc(PlanDoc(source="survey", survey=SurveyDoc(polygon=corners), profile=profile), dsm)
    )
    written = read_plan((tmp_path / "out" / "mission.plan").read_text())
    assert [(i.command, i.lat_deg, i.lon_deg, round(i.alt_m, 6)) for i in written.items] == [
        (i.command, i.lat_deg, i.lon_deg, round(i.alt_m, 6)) for i in plan.mission.items
    ]


def test_lower_flight_takes_more_lines(model: Path, area: Path, tmp_path: Path) -> None:
    high = hedgehop("survey", model, area, "--out", tmp_path / "high", "--json", "--height-m", 50)
    low = hedgehop("survey", model, area, "--out", tmp_path / "low", "--json", "--height-m", 25, "--angle-deg", 90)
    assert low.json["length_m"] > 1.5 * high.json["length_m"]
    assert low.json["min_vertical_m"] < 30


def test_too_many_lines_for_the_vehicle(model: Path, area: Path, tmp_path: Path) -> None:
    run = hedgehop("survey", model, area, "--out", tmp_path / "out", "--json", "--gsd-cm", 0.3, "--max-items", 30)
    assert (run.code, run.json["error"]["code"]) == (2, "mission_capacity")
    assert not (tmp_path / "out").exists()
