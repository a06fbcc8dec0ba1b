"""``hedgehop goto`` against a simulated vehicle: up, over a wall, home; and what is refused without flying."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from mapping.geometry.frames import apart_m
from planning.fence.fence_model import Fence, circle
from planning.formats.fence_files import write_fence
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import write_dsm
from server.cli.flights.goto_command import _placed
from telemetry.topics.vehicle import VehicleState
from tests.server.cli_runs import Run, hedgehop
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle

pytestmark = pytest.mark.xdist_group("cli-flying")

WEST, NORTH, SIDE_M = 500_000.0, 4_170_000.0, 200
ON_GROUND = "--home-on-ground"
QUICK = ("--profile", "mapper-rtk", "--rtl-height-m", 60)


def _model() -> Dsm:
    """Flat ground with a wall of 9 m, 40 m east of home."""
    z = np.full((SIDE_M, SIDE_M), 100.0, np.float32)
    z[:, 140:142] = 109.0
    return Dsm(z, Affine(1.0, 0, WEST, 0, -1.0, NORTH), CRS.from_epsg(32633), None, "")


MODEL = _model()


def at(east_m: float, south_m: float = 100.5) -> str:
    lat, lon = MODEL.lat_lon_from_xy(np.array([[WEST + east_m, NORTH - south_m]]))[0]
    return f"{lat:.7f},{lon:.7f}"


@pytest.fixture(scope="module")
def dsm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("goto") / "model.tif"
    write_dsm(file, MODEL)
    return file


@pytest.fixture
def link() -> Iterator[str]:
    settings = ("--speedup", 10, "--boot-s", 1, "--parameter", "GUID_OPTIONS=64", "--parameter", "RTL_ALT=6000")
    with simulated_vehicle(f"{at(100.5)},100", *settings, *QUICKLY_DOWN) as where:
        yield where


def goto(link: str, dsm: Path, *arguments: object) -> Run:
    return hedgehop("goto", link, *arguments, "--dsm", dsm, *QUICK, "--json")


@pytest.mark.parametrize("missing", ["home_lat_deg", "home_lon_deg", "home_alt_amsl_m"])
def test_in_flight_a_whole_home_is_waited_for(missing: str) -> None:
    home: dict[str, Any] = {"home_lat_deg": 37.0, "home_lon_deg": 15.0, "home_alt_amsl_m": 100.0}
    flies = VehicleState(1, 1, armed=True, lat_deg=37.0, lon_deg=15.0, alt_rel_home_m=10.0, **home)
    missing_one: dict[str, Any] = {missing: None}
    assert _placed(flies) is flies
    assert _placed(replace(flies, **missing_one)) is None
    assert _placed(replace(flies, armed=False, **missing_one)) is not None, "it takes its home when it arms"


def test_up_over_the_wall_and_home(link: str, dsm: Path) -> None:
    on_the_ground = goto(link, dsm, "to", at(170.5), "--height-m", 5)
    assert on_the_ground.code == 1
    assert "not in the air" in on_the_ground.err
    up = goto(link, dsm, "take-off", "--height-m", 5)
    assert (up.code, up.json["flown"]) == (0, True), up.err
    doubted = goto(link, dsm, "to", at(170.5), "--height-m", 5, "--check")
    assert doubted.code != 0
    assert "was not heard here" in doubted.err
    assert "--home-on-ground" in doubted.err
    judged = goto(link, dsm, "to", at(170.5), "--height-m", 5, "--check", ON_GROUND)
    assert (judged.code, judged.json["flown"], judged.json["certified"]) == (0, False, True), judged.err
    there = goto(link, dsm, "to", at(170.5), "--height-m", 5, ON_GROUND)
    assert (there.code, there.json["flown"]) == (0, True), there.err
    assert max(place["alt_rel_home_m"] for place in there.json["places"]) > 9.0 + there.json["required_clearance_m"]
    assert there.json["clearance_m"] >= there.json["required_clearance_m"]
    next_one = goto(link, dsm, "to", at(170.5, 130.5), "--height-m", 6, ON_GROUND)
    assert (next_one.code, next_one.json["flown"], next_one.json["certified"]) == (0, True, True), next_one.err
    ended, begins = there.json["places"][-1], next_one.json["places"][0]
    away_m = apart_m((ended["lat_deg"], ended["lon_deg"]), (begins["lat_deg"], begins["lon_deg"]))
    assert away_m < 1.0, "it begins where the way before it ended"
    assert abs(begins["alt_rel_home_m"] - ended["alt_rel_home_m"]) < 1.0
    turned = goto(link, dsm, "look", at(100.5), ON_GROUND)
    assert turned.code == 0, turned.err
    home = goto(link, dsm, "home", "--height-m", 5, ON_GROUND)
    assert (home.code, home.json["flown"]) == (0, True), home.err


def test_a_fence_on_board_is_kept_without_flying(link: str, dsm: Path, tmp_path: Path) -> None:
    file = tmp_path / "fence.kml"
    lat, lon = (float(part) for part in at(120.5).split(","))
    file.write_text(write_fence(file.name, Fence(circles=(circle(lat, lon, 5.0, inclusion=False, where="t"),)), ()))
    assert hedgehop("fence", link, "upload", file).code == 0
    assert goto(link, dsm, "take-off", "--height-m", 6).code == 0
    refused = goto(link, dsm, "to", at(130.5), "--height-m", 6, ON_GROUND)
    assert (refused.code, refused.json["flown"], refused.json["problem"]) == (1, False, "return")
    assert "exclusion" in refused.json["reasons"][0]
    assert goto(link, dsm, "home", "--height-m", 5, ON_GROUND).code == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("to",), "to needs a place"),
        (("height", "-37,175"), "takes no place"),
        (("to", "-37;175"), "is no place"),
        (("soar",), "soar"),
    ],
)
def test_wrong_input_is_told_before_any_vehicle_is_asked(arguments: tuple[str, ...], said: str, dsm: Path) -> None:
    run = goto("tcp:127.0.0.1:1", dsm, *arguments)
    assert run.code == 2
    assert said in run.out + run.err
