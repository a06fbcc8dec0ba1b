"""``hedgehop fence`` and ``rally`` against a simulated vehicle, and ``certify`` of plans that carry a fence."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from planning.fence.fence_model import Fence, RallyPoint, circle, polygon
from planning.formats.fence_files import read_fence, write_fence
from planning.formats.qgc_plan import read_plan
from planning.terrain.geotiff import write_dsm
from tests.server.cli_runs import hedgehop, write_demo
from tests.server.flight_logs import PLAIN, mission
from tests.server.simulated import simulated_vehicle
from tests.server.test_cli_flying import write_mission

pytestmark = pytest.mark.xdist_group("cli-flying")

FLIGHT = mission([(50.0, 150.0, 12.0), (90.0, 150.0, 12.0), (90.0, 175.0, 14.0)])
LAT, LON = FLIGHT.home.lat_deg, FLIGHT.home.lon_deg
SQUARE = [(LAT - 0.01, LON - 0.01), (LAT - 0.01, LON + 0.01), (LAT + 0.01, LON + 0.01), (LAT + 0.01, LON - 0.01)]
FENCE = Fence(
    polygons=(polygon(SQUARE, inclusion=True, where="t"),),
    circles=(circle(LAT + 0.005, LON, 33.5, inclusion=False, where="t"),),
)
RALLY = (RallyPoint(round(LAT + 1e-4, 7), round(LON, 7), 30.5),)


@pytest.fixture(scope="module")
def link() -> Iterator[str]:
    with simulated_vehicle(f"{LAT:.7f},{LON:.7f},100", "--boot-s", 1) as where:
        yield where


def test_a_fence_goes_up_comes_down_and_goes_away(link: str, tmp_path: Path) -> None:
    file, onboard = tmp_path / "fence.kml", tmp_path / "onboard.plan"
    file.write_text(write_fence(file.name, FENCE, RALLY))
    sent = hedgehop("fence", link, "upload", file, "--json")
    assert sent.code == 0, sent.err
    assert (sent.json["verified"], sent.json["items"], sent.json["differences"]) == (True, 5, [])
    assert "FENCE_ENABLE" in sent.err
    saved = hedgehop("fence", link, "download", onboard, "--json")
    assert saved.code == 0, saved.err
    assert saved.json["items"] == 5
    assert read_fence(onboard.name, onboard.read_bytes()).fence == FENCE
    cleared = hedgehop("fence", link, "clear")
    assert cleared.code == 0, cleared.err
    assert "VERIFIED: 0 items" in cleared.out
    empty = hedgehop("fence", link, "download", onboard)
    assert "The vehicle has no fence" in empty.out


def test_floor_and_ceiling_are_shown_then_set_and_found_as_they_should_be(link: str, tmp_path: Path) -> None:
    file = tmp_path / "heights.plan"
    file.write_text(write_fence(file.name, Fence(floor_rel_home_m=5.0, ceiling_rel_home_m=60.0), ()))
    shown = hedgehop("fence", link, "upload", file, "--heights", "show", "--json")
    assert shown.code == 0, shown.err
    assert "FENCE_ALT_MAX 100 -> 60 m" in shown.err
    assert "FENCE_ENABLE 0 -> 1" in shown.err
    assert (shown.json["heights"]["set"], shown.json["heights"]["written"]) == (False, [])
    done = hedgehop("fence", link, "upload", file, "--heights", "set")
    assert done.code == 0, done.err
    assert "FENCE_TYPE 7 -> 9" in done.err  # as it was shown before: nothing had been written
    assert "FLOOR AND CEILING: SET, read back" in done.out
    again = hedgehop("fence", link, "upload", file, "--heights", "set")
    assert (again.code, "the vehicle has them already" in again.out) == (0, True)
    held = hedgehop("params", "get", "FENCE_*", "--link", link, "--json")
    values = {each["name"]: each["value"] for each in held.json["parameters"]}
    assert (values["FENCE_ALT_MAX"], values["FENCE_ALT_MIN"], values["FENCE_TYPE"]) == (60.0, 5.0, 9.0)


def test_a_looser_ceiling_than_the_one_that_acts_is_set_by_whoever_says_so_alone(link: str, tmp_path: Path) -> None:
    strict, loose = tmp_path / "strict.plan", tmp_path / "loose.plan"
    strict.write_text(write_fence(strict.name, Fence(ceiling_rel_home_m=40.0), ()))
    shape = circle(LAT, LON, 90.0, inclusion=True, where="t")
    loose.write_text(write_fence(loose.name, Fence(circles=(shape,), ceiling_rel_home_m=70.0), ()))
    assert hedgehop("fence", link, "clear").code == 0
    assert hedgehop("fence", link, "upload", strict, "--heights", "set").code == 0

    def ceiling_and_shapes() -> tuple[float, int]:
        held = hedgehop("params", "get", "FENCE_ALT_MAX", "--link", link, "--json")
        shapes = hedgehop("fence", link, "download", tmp_path / "onboard.plan", "--json")
        return held.json["parameters"][0]["value"], shapes.json["items"]

    refused = hedgehop("fence", link, "upload", loose, "--heights", "set")
    assert refused.code != 0
    assert "This raises the ceiling that acts now, from 40 to 70 m above home. Nothing was sent." in refused.err
    assert "--looser" in refused.err
    assert ceiling_and_shapes() == (40.0, 0)
    shown = hedgehop("fence", link, "upload", strict, "--heights", "show", "--json")
    assert shown.json["heights"]["looser"] == []
    wanted = hedgehop("fence", link, "upload", loose, "--heights", "set", "--looser", "--json")
    assert wanted.code == 0, wanted.err
    assert wanted.json["heights"]["looser"] == ["This raises the ceiling that acts now, from 40 to 70 m above home."]
    assert ceiling_and_shapes() == (70.0, 1)


def test_rally_points_go_up_in_whole_metres_and_come_down(link: str, tmp_path: Path) -> None:
    file, onboard = tmp_path / "rally.plan", tmp_path / "onboard.geojson"
    file.write_text(write_fence(file.name, Fence(), RALLY))
    sent = hedgehop("rally", link, "upload", file)
    assert sent.code == 0, sent.err
    assert "VERIFIED: 1 items" in sent.out
    saved = hedgehop("rally", link, "download", onboard, "--json")
    assert saved.json["rally"] == [{"lat_deg": RALLY[0].lat_deg, "lon_deg": RALLY[0].lon_deg, "alt_rel_home_m": 31.0}]
    assert read_fence(onboard.name, onboard.read_bytes()).rally[0].alt_rel_home_m == 31.0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("fence", "tcp:127.0.0.1:1", "upload"), "a file is needed"),
        (("fence", "tcp:127.0.0.1:1", "clear", "f.plan"), "takes no file"),
        (("fence", "nowhere", "clear"), "nowhere"),
        (("fence", "tcp:127.0.0.1:1", "download", "f.csv"), "No fence is written"),
        (("fence", "tcp:127.0.0.1:1", "soar", "f.csv"), "soar"),
        (("rally", "tcp:127.0.0.1:1", "upload", "FENCE"), "holds no rally points"),
        (("fence", "tcp:127.0.0.1:1", "upload", "FENCE", "--heights", "set"), "neither floor nor ceiling"),
        (("fence", "tcp:127.0.0.1:1", "clear", "--heights", "set"), "goes with upload alone"),
        (("fence", "tcp:127.0.0.1:1", "upload", "FENCE", "--looser"), "goes with --heights set alone"),
    ],
)
def test_wrong_input_is_told_before_any_vehicle_is_asked(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    file = tmp_path / "fence.kml"
    file.write_text(write_fence(file.name, FENCE, ()))
    run = hedgehop(*(file if each == "FENCE" else each for each in arguments))
    assert run.code == 2
    assert said in run.err


def test_certify_judges_the_fence_of_a_plan_and_the_one_that_is_given(tmp_path: Path) -> None:
    model = tmp_path / "plain.tif"
    write_dsm(model, PLAIN)
    flight = write_mission(tmp_path / "short.waypoints", FLIGHT)
    wide, tight = tmp_path / "wide.kml", tmp_path / "tight.geojson"
    wide.write_text(write_fence(wide.name, FENCE, ()))
    tight.write_text(write_fence(tight.name, Fence(circles=(circle(LAT, LON, 20.0, inclusion=True, where="t"),)), ()))
    given = ("certify", model, flight, "--position-error-m", 0.1, "--rtl-height-m", 30, "--json")
    free, kept, left = (hedgehop(*given, *more) for more in ((), ("--fence", wide), ("--fence", tight)))
    assert free.json["fence"] is None
    assert (kept.json["fence"]["keeps"], kept.code) == (True, 0), kept.err
    assert kept.json["fence"]["shape"] == "inclusion polygon 1" or "exclusion" in kept.json["fence"]["shape"]
    assert (left.json["fence"]["keeps"], left.code) == (False, 1)
    assert [reason["code"] for reason in left.json["reasons"]] == ["fence"]


def test_a_plan_carries_its_fence_into_its_file_and_certify_finds_it_there(tmp_path: Path) -> None:
    model, points = write_demo(tmp_path)
    free = hedgehop("plan", model, points, "--out", tmp_path / "free", "--json").json
    assert free["detours"] == []
    home = free["home"]
    low = Fence(
        circles=(circle(home["lat_deg"], home["lon_deg"], 2000.0, inclusion=True, where="t"),), ceiling_rel_home_m=1.0
    )
    fence = tmp_path / "fence.kml"
    fence.write_text(write_fence(fence.name, low, ()))
    planned = hedgehop("plan", model, points, "--out", tmp_path / "out", "--fence", fence)
    assert planned.code == 1
    assert "fence: NOT kept" in planned.out
    written = tmp_path / "out" / "mission.plan"
    assert read_plan(written.read_bytes()).fence == low
    again = hedgehop("certify", model, written, "--json")
    assert again.code == 1
    assert "fence" in {reason["code"] for reason in again.json["reasons"]}
    assert "Fence: 1 circle, ceiling at 1 m above home of the mission's own file." in again.err


def test_a_plan_whose_points_the_fence_leaves_out_is_refused_with_each_distance(tmp_path: Path) -> None:
    model, points = write_demo(tmp_path)
    home = hedgehop("plan", model, points, "--out", tmp_path / "free", "--json").json["home"]
    around = Fence(circles=(circle(home["lat_deg"], home["lon_deg"], 5.0, inclusion=True, where="t"),))
    fence = tmp_path / "fence.kml"
    fence.write_text(write_fence(fence.name, around, ()))
    planned = hedgehop("plan", model, points, "--out", tmp_path / "out", "--fence", fence)
    assert planned.code == 2
    assert "m outside inclusion circle 1 of the fence" in planned.err
