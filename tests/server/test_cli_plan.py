"""``hedgehop plan`` on recorded terrain: verdicts, JSON, and the files, read by others' readers."""

from __future__ import annotations

import json
import math
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path
from typing import Any

import pytest
from pymavlink import mavwp

from planning.ground.demo_hillside import demo_survey_polygon
from planning.terrain.geotiff import read_dsm, write_dsm
from tests.planning.plan_examples import PLAN_FILES
from tests.server.cli_runs import Run, hedgehop

KEYS = {
    "certified", "min_distance_m", "min_vertical_m", "required_clearance_m", "worst", "rtl_height_needed_m",
    "home_column_clear", "home", "length_m", "duration_s", "samples", "items", "dsm", "seconds", "reasons",
}  # fmt: skip
SURVEYED = ("--position-error-m", 0.1)
"""The first point lies on the edge of bush: with standalone GNSS no place nearby would do for home."""


@pytest.fixture(scope="module")
def hillside(shared_data: Path) -> tuple[Path, Path]:
    return (
        shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif",
        shared_data / "logs" / "arducopter" / "pois.csv",
    )


@pytest.fixture(scope="module")
def flight(hillside: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    out = tmp_path_factory.mktemp("flight")
    return hedgehop("plan", *hillside, "--out", out, "--rtl-height-m", 70, *SURVEYED, "--json"), out


def planned(hillside: tuple[Path, Path], out: Path, *options: object) -> Run:
    return hedgehop("plan", *hillside, "--out", out, "--rtl-height-m", 70, *SURVEYED, "--json", *options)


def test_certified(flight: tuple[Run, Path]) -> None:
    run, _ = flight
    summary = run.json
    assert run.code == 0
    assert set(summary) >= KEYS
    assert set(summary["worst"]) == {"lat_deg", "lon_deg", "alt_rel_home_m", "leg"}
    assert set(summary["seconds"]) == {"read", "surface", "path", "certificate", "total"}
    assert summary["certified"] is True
    assert summary["reasons"] == []
    assert 4.9 <= summary["min_distance_m"] <= summary["min_vertical_m"] < 6.5
    assert summary["required_clearance_m"] == pytest.approx(2.212, abs=0.001)
    budget = summary["clearance_budget"]
    assert sum(term["value_m"] for term in budget["terms"]) == pytest.approx(summary["required_clearance_m"])
    assert {term["code"] for term in budget["terms"]} == {
        "vehicle_radius", "position_error", "following", "dsm_accuracy", "downwash",
    }  # fmt: skip
    assert (budget["set_by_hand"], budget["uncovered"]) == (False, [])
    assert summary["tube"]["radius_m"] == 1.1
    assert summary["tube"]["min_distance_m"] == pytest.approx(summary["min_distance_m"] - 1.1)
    assert summary["rtl_height_needed_m"] == pytest.approx(48.2, abs=0.2)
    assert summary["length_m"] == pytest.approx(211.8, abs=0.1)
    assert summary["samples"] == pytest.approx(2122, abs=6)
    assert 75 < summary["duration_s"] < 300


def test_model_in_the_summary(flight: tuple[Run, Path]) -> None:
    model = flight[0].json["dsm"]
    assert {key: model[key] for key in ("crs", "width", "height", "resolution_m", "holes_filled")} == {
        "crs": "EPSG:2193", "width": 290, "height": 252, "resolution_m": 0.5, "holes_filled": 25,
    }  # fmt: skip
    assert model["unknown_share"] == pytest.approx(0.002, abs=1e-4)
    assert model["sha256"].startswith("2aaa2746")


def test_worst_place_is_where_the_old_flight_was_lowest_too(flight: tuple[Run, Path]) -> None:
    worst = flight[0].json["worst"]
    north_m = (worst["lat_deg"] + 37.1244525) * 111_320
    east_m = (worst["lon_deg"] - 175.6884838) * 111_320 * math.cos(math.radians(37.12))
    assert math.hypot(north_m, east_m) < 2.0
    assert worst["alt_rel_home_m"] == pytest.approx(49.9, abs=0.3)


def test_a_flight_longer_than_the_battery_is_not_feasible(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    weak = tmp_path / "weak.toml"
    weak.write_text('name = "weak"\nendurance_s = 120.0\nrtl_height_m = 70.0\nposition_error_m = 0.5\n')
    out = tmp_path / "out"
    run = hedgehop("plan", *hillside, "--out", out, "--profile", weak)
    assert run.code == 1
    assert run.out.startswith("CERTIFIED, NOT FEASIBLE\n")
    assert "endurance less reserve is 1 min 30 s. Fly faster, shorten the route or split it." in run.out
    assert "✕ CERTIFIED, NOT FEASIBLE" in (out / "report.html").read_text()
    answer = json.loads((out / "certificate.json").read_text())
    assert (answer["certified"], answer["feasible"]) == (True, False)
    states = {row["code"]: row["state"] for row in answer["feasibility"]}
    assert states == {"battery": "fails", "speed": "holds", "climb": "holds", "items": "holds"}
    again = hedgehop("certify", hillside[0], out / "mission.plan", "--json")
    assert (again.code, again.json["certified"], again.json["feasible"]) == (1, True, False)


def test_whether_a_nameless_vehicle_can_fly_is_not_judged(hillside: tuple[Path, Path]) -> None:
    mission = hillside[1].parent / "mission.waypoints"
    run = hedgehop("certify", hillside[0], mission, "--rtl-height-m", 70)
    assert run.code == 1
    assert run.out.startswith("NOT CERTIFIED, feasibility not judged\n")
    assert "names no vehicle: Generic quadrotor is taken" in run.err
    named = hedgehop("certify", hillside[0], mission, "--rtl-height-m", 70, "--profile", "generic-quad", "--json")
    assert named.json["feasible"] is True


def test_the_terms_are_set_and_what_is_left_out_is_said(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    options = ("--following-m", 0.3, "--dsm-rms-m", 0.1, "--downwash-m", 0.7, "--vehicle-radius-m", 0.4)
    run = planned(hillside, tmp_path, "--position-error-m", 0.2, *options)
    terms = {term["code"]: term["value_m"] for term in run.json["clearance_budget"]["terms"]}
    assert terms == pytest.approx(
        {"following": 0.3, "dsm_accuracy": 0.3, "downwash": 0.7, "vehicle_radius": 0.4, "position_error": 0.2}
    )
    by_hand = hedgehop(
        "plan", *hillside, "--out", tmp_path, "--rtl-height-m", 70, "--required-clearance-m", 3, "--flown-as", "guided"
    )
    assert by_hand.code == 0
    assert "following the line 1.80 m" in by_hand.out
    assert "NOT covered: 1.65 m of following the line, 0.07 m of accuracy of the surface model" in by_hand.out
    assert "The required clearance of 3.00 m was set by hand" in by_hand.err
    page = (tmp_path / "report.html").read_text()
    assert "Not covered: following the line" in page
    assert "The proof is of a tube: everything within 1.80 m of the line" in page


def test_certify_takes_vehicle_and_demands_from_the_missions_own_file(
    hillside: tuple[Path, Path], tmp_path: Path
) -> None:
    run = planned(hillside, tmp_path, "--profile", "x500-rtk-px4", "--following-m", 0.6, "--flown-as", "guided")
    for name in ("mission.waypoints", "mission.plan"):
        again = hedgehop("certify", hillside[0], tmp_path / name, "--json")
        assert again.code == 0
        assert "vehicle as in the mission's file: X500, PX4, RTK" in again.err
        assert again.json["clearance_budget"] == run.json["clearance_budget"]
        assert again.json["rtl_height_m"] == 70
    other = hedgehop("certify", hillside[0], tmp_path / "mission.plan", "--profile", "generic-quad", "--json")
    assert other.json["required_clearance_m"] > run.json["required_clearance_m"]
    assert "--profile generic-quad is taken instead of the mission's own X500, PX4, RTK" in other.err
    wider = hedgehop("certify", hillside[0], tmp_path / "mission.plan", "--position-error-m", 0.5, "--json")
    assert wider.json["required_clearance_m"] == pytest.approx(run.json["required_clearance_m"] + 0.4)
    assert "position error of 0.5 m is taken instead of the mission's own 0.1" in wider.err


def test_certify_over_another_model_says_so_first(
    hillside: tuple[Path, Path], flight: tuple[Run, Path], tmp_path: Path
) -> None:
    higher = tmp_path / "higher.tif"
    dsm = read_dsm(hillside[0])
    write_dsm(higher, dsm.with_elevation(dsm.elevation_m + 0.5))
    mission = flight[1] / "mission.plan"
    words = "than the mission was planned on"
    run = hedgehop("certify", higher, mission)
    assert words in run.out.splitlines()[0]
    assert "home's ground is 0.50 m higher here" in run.out.splitlines()[0]
    summary = hedgehop("certify", higher, mission, "--json").json
    assert next(iter(summary)) == "other_surface"
    assert words in summary["other_surface"]
    same = hedgehop("certify", hillside[0], mission, "--json")
    assert same.json["other_surface"] is None
    assert words not in same.err


def test_return_height_too_low(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    run = hedgehop("plan", *hillside, "--out", tmp_path, "--rtl-height-m", 30, *SURVEYED)
    assert run.code == 1
    assert run.out.startswith("NOT CERTIFIED, FEASIBLE\n")
    assert "way home: NOT clear at the return height of 30.00 m above home, needed 48." in run.out
    assert "Set the return height to at least 49 m (ArduPilot: RTL_ALT 4900 cm" in run.out
    assert json.loads((tmp_path / "certificate.json").read_text())["reasons"][0]["code"] == "return_height"


def test_without_a_home_one_is_chosen_that_does_and_the_plan_says_so(
    hillside: tuple[Path, Path], flight: tuple[Run, Path], tmp_path: Path
) -> None:
    run, _ = flight
    assert run.json["warnings"][0].startswith("Home was put 3.4 m to the north-east of the first point")
    assert "Home was put" in run.err
    assert run.json["home"]["chosen"] is True
    assert run.json["home"]["drop_m"] < 1.0
    assert run.json["home"]["min_distance_m"] > 3.35
    given = planned(hillside, tmp_path, "--home", "-37.12445073,175.68928790")
    assert given.code == 1
    assert given.json["home"]["chosen"] is False
    assert given.json["reasons"][0]["code"] == "home_on_top"
    better = given.json["home"]["better"]
    moved = planned(hillside, tmp_path, "--home", f"{better['lat_deg']},{better['lon_deg']}")
    assert moved.code == 0


def test_files(flight: tuple[Run, Path]) -> None:
    assert {path.name for path in flight[1].iterdir()} == PLAN_FILES


def test_mission_read_by_pymavlink(flight: tuple[Run, Path]) -> None:
    run, out = flight
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(out / "mission.waypoints")) == run.json["items"] + 1
    items: list[Any] = [loader.wp(k) for k in range(loader.count())]
    commands = [item.command for item in items]
    assert commands[:3] == [16, 178, 22]
    assert commands[-1] == 20
    waypoints = [item for item in items[1:] if item.command == 16]
    assert {item.frame for item in waypoints} == {3}
    assert [item.param1 for item in waypoints if item.param1] == [2, 3, 2]
    assert items[0].z == pytest.approx(803.47)


def test_plan_file_is_what_qgroundcontrol_reads(flight: tuple[Run, Path]) -> None:
    run, out = flight
    plan = json.loads((out / "mission.plan").read_text())
    assert (plan["fileType"], plan["version"], plan["mission"]["version"]) == ("Plan", 1, 2)
    assert len(plan["mission"]["items"]) == run.json["items"]
    assert {"geoFence", "rallyPoints"} <= set(plan)
    assert all(len(item["params"]) == 7 for item in plan["mission"]["items"])


def test_trajectory_columns(flight: tuple[Run, Path]) -> None:
    lines = [line for line in (flight[1] / "trajectory.csv").read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == "lat_deg,lon_deg,alt_rel_home_m,alt_amsl_m,speed_m_s,time_to_next_s,loiter_s"
    assert len(lines) - 1 == flight[0].json["samples"]
    assert {line.split(",")[3] for line in lines[1:]} == {""}


def test_kml_and_geojson(flight: tuple[Run, Path]) -> None:
    root = ElementTree.fromstring((flight[1] / "trajectory.kml").read_bytes())
    names = [element.text for element in root.iter("{http://www.opengis.net/kml/2.2}name")]
    assert {"P1", "P2", "P3", "P4", "P5"} <= set(names)
    features = json.loads((flight[1] / "mission.geojson").read_text())["features"]
    roles = [feature["properties"]["role"] for feature in features]
    assert (roles.count("path"), roles.count("poi"), roles.count("home")) == (1, 5, 1)


def test_certificate_file(flight: tuple[Run, Path]) -> None:
    run, out = flight
    certificate = json.loads((out / "certificate.json").read_text())
    assert set(certificate) >= set(run.json) | {"legs", "trend", "assumptions", "created_utc"}
    assert {key: certificate[key] for key in run.json} == run.json
    assumed = certificate["assumptions"]
    assert (assumed["holes_filled"], assumed["holes_filled_area_m2"], assumed["max_hole_m2"]) == (25, 6.25, 4.0)
    assert assumed["dsm_sha256"] == run.json["dsm"]["sha256"]


def test_report_runs_nothing_and_loads_nothing(flight: tuple[Run, Path]) -> None:
    page = (flight[1] / "report.html").read_text()
    assert "<script" not in page.lower()
    assert "http://" not in page.replace("http://www.w3.org/", "")
    assert "✓ CERTIFIED, FEASIBLE" in page


@pytest.mark.parametrize("name", ["mission.waypoints", "mission.plan"])
def test_certify_agrees_with_plan(flight: tuple[Run, Path], hillside: tuple[Path, Path], name: str) -> None:
    run, out = flight
    again = hedgehop("certify", hillside[0], out / name, "--rtl-height-m", 70, *SURVEYED, "--json")
    assert again.code == 0
    for key in ("min_distance_m", "min_vertical_m", "rtl_height_needed_m", "required_clearance_m"):
        assert again.json[key] == pytest.approx(run.json[key], abs=0.01)
    assert again.json["worst"] == pytest.approx(run.json["worst"], abs=0.01)
    assert (again.json["items"], again.json["dsm"]) == (run.json["items"], run.json["dsm"])


def test_certify_the_recorded_mission(hillside: tuple[Path, Path]) -> None:
    mission = hillside[1].parent / "mission.waypoints"
    run = hedgehop("certify", hillside[0], mission, "--json", "--rtl-height-m", 70, *SURVEYED)
    assert run.code == 1
    assert [reason["code"] for reason in run.json["reasons"]] == ["home_on_top"]
    better = run.json["home"]["better"]
    assert better["does"]
    assert better["away_m"] < 5.0
    assert f"{better['lat_deg']:.7f}, {better['lon_deg']:.7f}" in run.json["reasons"][0]["mend"]
    assert run.json["min_vertical_m"] == pytest.approx(4.93, abs=0.005)
    assert run.json["min_distance_m"] == pytest.approx(4.92, abs=0.005)
    assert hedgehop("certify", hillside[0], mission).code == 1


def test_certify_shows_every_leg(flight: tuple[Run, Path], hillside: tuple[Path, Path]) -> None:
    mission = flight[1] / "mission.plan"
    text = hedgehop("certify", hillside[0], mission, "--rtl-height-m", 70, *SURVEYED, "--verbose").out
    legs = hedgehop("certify", hillside[0], mission, "--rtl-height-m", 70, *SURVEYED, "--verbose", "--json").json[
        "legs"
    ]
    assert text.startswith("CERTIFIED, FEASIBLE\n")
    assert len([line for line in text.splitlines() if line.startswith("  leg ")]) == len(legs) > 5
    assert min(leg["min_distance_m"] for leg in legs) == flight[0].json["min_distance_m"]


@pytest.mark.parametrize(
    "options",
    [
        ("--end", "land"),
        ("--profile", "x500-rtk-px4"),
        ("--profile", "x500-rtk-px4", "--end", "land"),
        ("--on-steep", "slow"),
        ("--paper",),
        ("--home", "-37.1244232,175.6893094"),
        ("--remove-spikes",),
    ],
)
def test_other_ways_to_fly_are_certified(hillside: tuple[Path, Path], tmp_path: Path, options: tuple[str, ...]) -> None:
    run = planned(hillside, tmp_path, *options)
    assert run.code == 0, run.err
    assert run.json["min_distance_m"] >= run.json["required_clearance_m"]
    last = json.loads((tmp_path / "mission.plan").read_text())["mission"]["items"][-1]["command"]
    assert last == (21 if "land" in options else 20)


def test_px4(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    planned(hillside, tmp_path, "--profile", "x500-rtk-px4")
    assert json.loads((tmp_path / "mission.plan").read_text())["mission"]["firmwareType"] == 12


def test_camera_gimbal_and_heading(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    run = planned(
        hillside, tmp_path,
        "--look-at", "-37.1241,175.6888", "--gimbal-pitch-deg", -45, "--camera-trigger-m", 5,
    )  # fmt: skip
    assert run.code == 0
    items = json.loads((tmp_path / "mission.plan").read_text())["mission"]["items"]
    commands = [item["command"] for item in items]
    assert {195, 205, 206, 197} <= set(commands)
    assert items[commands.index(206)]["params"][0] == 5
    planned(hillside, tmp_path, "--heading-deg", 90)
    items = json.loads((tmp_path / "mission.plan").read_text())["mission"]["items"]
    assert next(item["params"][0] for item in items if item["command"] == 115) == 90


def test_shortest_order_and_loiter(hillside: tuple[Path, Path], flight: tuple[Run, Path], tmp_path: Path) -> None:
    run = planned(hillside, tmp_path, "--shortest-order", "--loiter-s", 4)
    assert run.json["length_m"] < flight[0].json["length_m"]
    ours = json.loads((tmp_path / "mission.geojson").read_text())["features"]
    pois = [feature["properties"] for feature in ours if feature["properties"]["role"] == "poi"]
    assert pois[0]["name"] == "P1"
    assert sorted((poi["name"], poi["loiter_s"]) for poi in pois) == [
        ("P1", 4), ("P2", 2), ("P3", 3), ("P4", 2), ("P5", 4),
    ]  # fmt: skip


def test_holes_kept_as_columns(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    run = planned(hillside, tmp_path, "--max-hole-m2", 0)
    assert run.code == 1
    assert run.json["dsm"]["holes_filled"] == 0
    assert run.json["rtl_height_needed_m"] is None
    assert "an unknown cell or the model's edge" in run.json["reasons"][0]["text"]
    assumed = json.loads((tmp_path / "certificate.json").read_text())["assumptions"]
    assert (assumed["holes_filled"], assumed["max_hole_m2"]) == (0, 0.0)


def test_height_limit(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    run = planned(hillside, tmp_path, "--max-height-above-ground-m", 15)
    assert run.code == 1
    assert "the limit is 15.00 m" in run.json["reasons"][0]["text"]


def test_hostile_names(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    rows = hillside[1].read_text().replace("P1", "<script>alert(1)</script>").replace("P2", "../../etc\x1b[31m/passwd")
    points = tmp_path / "<img src=x onerror=alert(1)>.csv"
    points.write_text(rows)
    out = tmp_path / "out"
    run = planned((hillside[0], points), out)
    assert run.code == 0
    assert {path.name for path in out.iterdir()} == PLAN_FILES
    page = (out / "report.html").read_text()
    assert "<script" not in page
    assert "<img" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    assert "<script>" not in (out / "trajectory.kml").read_text()
    for path in out.iterdir():
        assert b"\x1b" not in path.read_bytes()


def test_an_area_without_points_is_sent_to_survey(hillside: tuple[Path, Path], tmp_path: Path) -> None:
    ring = " ".join(f"{lon},{lat}" for lat, lon in [*demo_survey_polygon(), demo_survey_polygon()[0]])
    area = tmp_path / "area.kml"
    area.write_text(
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Placemark><Polygon><outerBoundaryIs><LinearRing>'
        f"<coordinates>{ring}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark></kml>"
    )
    run = hedgehop("plan", hillside[0], area, "--out", tmp_path / "out", "--json")
    assert run.code == 2
    assert "hedgehop survey" in run.json["error"]["advice"]


def test_a_kmz_line_is_certified(hillside: tuple[Path, Path], flight: tuple[Run, Path], tmp_path: Path) -> None:
    archive = tmp_path / "track.kmz"
    with zipfile.ZipFile(archive, "w") as file:
        file.write(flight[1] / "trajectory.kml", "doc.kml")
    run = hedgehop("certify", hillside[0], archive, "--json", "--rtl-height-m", 70)
    assert run.json["min_distance_m"] > 1.0
    assert "the path as it was sampled" in run.err
