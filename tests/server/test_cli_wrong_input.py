"""Wrong input on the command line: exit code 2, one message, one JSON object, nothing left behind."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.server.cli_runs import contents, hedgehop, write_demo

HEADER = "lat_deg,lon_deg,name,loiter_s\n"


@dataclass(frozen=True)
class Inputs:
    folder: Path
    model: Path
    points: Path


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    folder = tmp_path_factory.mktemp("inputs")
    return Inputs(folder, *write_demo(folder))


@pytest.fixture
def earlier(tmp_path: Path) -> Path:
    """An output directory of an earlier run, which a failure must leave as it was."""
    out = tmp_path / "flight"
    out.mkdir()
    (out / "mission.plan").write_text("an earlier plan")
    return out


def refused(out: Path, *arguments: object) -> dict[str, str]:
    """The error of a plan that must fail as every wrong input does."""
    before = contents(out)
    run = hedgehop("plan", *arguments, "--out", out, "--json")
    assert run.code == 2, run.err
    assert contents(out) == before
    assert "Traceback" not in run.err
    errors = [line for line in run.err.splitlines() if not line.startswith("Note: ")]
    assert len(errors) == 1
    assert errors[0].startswith("Error: ")
    error = run.json["error"]
    assert set(run.json) == {"error"}
    assert set(error) == {"code", "what", "where", "advice"}
    assert error["what"] in errors[0]
    assert errors[0].endswith(error["advice"])
    return error


OPTIONS = [
    ("--radius-m", "0", "parameter", "Radius R is 0 m"),
    ("--radius-m", "-1", "parameter", "Radius R is -1 m"),
    ("--radius-m", "nan", "parameter", "Radius R is nan m"),
    ("--radius-m", "inf", "parameter", "Radius R is inf m"),
    ("--radius-m", "600", "parameter", "larger than the surface model"),
    ("--height-m", "0", "parameter", "Height H is 0 m"),
    ("--height-m", "nan", "parameter", "Height H is nan m"),
    ("--height-m", "600", "parameter", "larger than the surface model"),
    ("--height-m", "1e308", "parameter", "Height H is 1e+308 m"),
    ("--smooth-m", "-1", "parameter", "Smoothing is -1 m"),
    ("--max-hole-m2", "-1", "parameter", "Largest hole to fill is -1 m2"),
    ("--mean-speed-m-s", "6", "parameter", "Mean speed 6 m/s and maximum speed 5 m/s contradict"),
    ("--max-speed-m-s", "50", "parameter", "Mean speed 3 m/s and maximum speed 50 m/s contradict"),
    ("--max-climb-m-s", "0", "parameter", "Climb limit is 0 m/s"),
    ("--max-descent-m-s", "nan", "parameter", "Descent limit is nan m/s"),
    ("--max-accel-m-s2", "1e300", "parameter", "Acceleration limit is 1e+300 m/s2"),
    ("--step-m", "0", "parameter", "Sampling step is 0 m"),
    ("--step-m", "1e-9", "parameter", "samples"),
    ("--step-m", "30", "parameter", "Sampling step 30 m is larger than radius R"),
    ("--max-items", "0", "parameter", "0 mission items"),
    ("--max-items", "5", "mission_capacity", "the vehicle takes 5"),
    ("--position-error-m", "-1", "parameter", "Position error is -1 m"),
    ("--required-clearance-m", "0", "parameter", "Required clearance is 0 m"),
    ("--rtl-height-m", "inf", "parameter", "RTL height is inf m"),
    ("--max-height-above-ground-m", "nan", "parameter", "Maximum height above ground is nan m"),
    ("--excess-height-m", "-1", "parameter", "Excess height is -1 m"),
    ("--home", "37.9,15.2", "poi", "The height of home at 37.9000000, 15.2000000 is unknown"),
    ("--home", "15.0,95.0,3", "parameter", "is no place"),
    ("--home", "nan,nan", "parameter", "outside the range of degrees"),
    ("--look-at", "0,0", "parameter", "point to look at"),
    ("--heading", "point", "parameter", "needs --look-at"),
    ("--heading", "fixed", "parameter", "needs --heading-deg"),
    ("--heading-deg", "nan", "parameter", "The heading is nan"),
    ("--gimbal-pitch-deg", "999", "parameter", "pitch is 999"),
    ("--camera-trigger-m", "0", "parameter", "between photos is 0"),
    ("--loiter-s", "-1", "parameter", "A wait of -1 s"),
    ("--loiter-s", "3601", "parameter", "A wait of 3601 s"),
    ("--profile", "no-such", "format", "no readable vehicle profile"),
    ("--crs", "nonsense", "raster_no_crs", '"nonsense" is no known'),
    ("--z-scale", "0", "parameter", "height scale"),
    ("--radius-m", "wide", "usage", "--radius-m"),
    ("--end", "fall", "usage", "'fall' is not one of"),
]


@pytest.mark.parametrize(("option", "value", "code", "words"), OPTIONS)
def test_option(demo: Inputs, earlier: Path, option: str, value: str, code: str, words: str) -> None:
    error = refused(earlier, demo.model, demo.points, option, value)
    assert error["code"] == code
    assert words in error["what"]
    assert error["advice"] or error["where"]


def test_amsl_without_a_datum(earlier: Path, shared_data: Path) -> None:
    model = shared_data / "dsm" / "coromandel" / "coromandel_dsm_050.tif"
    points = shared_data / "logs" / "arducopter" / "pois.csv"
    error = refused(earlier, model, points, "--altitude-reference", "amsl")
    assert error["code"] == "datum"
    accepted = hedgehop(
        "plan", model, points, "--out", earlier, "--rtl-height-m", 70,
        "--altitude-reference", "amsl", "--vertical-datum", "EGM2008 height", "--position-error-m", 0.1,
    )  # fmt: skip
    assert accepted.code == 0
    assert "\t0\t16\t" in (earlier / "mission.waypoints").read_text()


POINTS = {
    "empty": ("", "format", "no rows"),
    "header only": (HEADER, "format", "no rows"),
    "binary": ("\x00\x01\x02", "format", "binary"),
    "one point": (HEADER + "37.7299,14.9930,a,0\n", "poi", "at least 2 points, there is 1"),
    "words": (HEADER + "here,there,a,0\n", "format", "should be a number, got 'here'"),
    "not finite": (HEADER + "nan,14.99,a,0\n", "format", "should be finite"),
    "outside": (HEADER + "37.7299,14.9930,a,0\n38.5,15.5,b,0\n", "poi", 'Point 2 "b": 38.5000000, 15.5000000 lies out'),
    "swapped": (HEADER + "14.9930,37.7299,a,0\n14.9932,37.7301,b,0\n", "poi", "but swapped it lies on it"),
    "twice the same": (HEADER + "37.7299,14.9930,a,0\n" * 2, "poi", "0.00 m apart"),
    "entities": ('<!DOCTYPE k [<!ENTITY a "b">]><kml>&a;</kml>', "format", "entities"),
}


@pytest.mark.parametrize("kind", POINTS)
def test_points(demo: Inputs, earlier: Path, tmp_path: Path, kind: str) -> None:
    text, code, words = POINTS[kind]
    file = tmp_path / "points.csv"
    file.write_text(text)
    error = refused(earlier, demo.model, file)
    assert error["code"] == code
    assert words in error["what"]


def test_swapped_points_are_also_noted(demo: Inputs, tmp_path: Path) -> None:
    file = tmp_path / "points.csv"
    file.write_text(POINTS["swapped"][0])
    assert "Latitude and longitude look swapped" in hedgehop("plan", demo.model, file, "--out", tmp_path / "out").err


@pytest.mark.parametrize(
    ("name", "words"), [("missing.csv", "No such file"), (".", "Is a directory"), ("demo.tif", "This is a TIFF")]
)
def test_points_that_are_no_file_of_points(demo: Inputs, earlier: Path, name: str, words: str) -> None:
    error = refused(earlier, demo.model, demo.folder / name)
    assert words in error["what"]
    assert error["where"] == str(demo.folder / name)


def test_model_that_is_none(demo: Inputs, earlier: Path, tmp_path: Path) -> None:
    junk, cut = tmp_path / "junk.tif", tmp_path / "cut.tif"
    junk.write_bytes(bytes(range(256)) * 20)
    cut.write_bytes(demo.model.read_bytes()[: demo.model.stat().st_size // 2])
    (tmp_path / "vrt.tif").write_text("<VRTDataset rasterXSize='2' rasterYSize='2'></VRTDataset>")
    (tmp_path / "empty").mkdir()
    assert "no GeoTIFF" in refused(earlier, tmp_path / "empty", demo.points)["what"]
    assert "no such file" in refused(earlier, demo.folder / "missing.tif", demo.points)["what"]
    assert "unknown kind" in refused(earlier, junk, demo.points)["what"]
    assert "VRT" in refused(earlier, tmp_path / "vrt.tif", demo.points)["what"]
    assert refused(earlier, cut, demo.points)["code"].startswith("raster")


@pytest.mark.parametrize("name", ["all-nodata.tif", "corrupt.tif", "rotated.tif", "float32.tif", "RGB.byte.gcp.vrt"])
def test_odd_rasters(demo: Inputs, earlier: Path, shared_data: Path, name: str) -> None:
    error = refused(earlier, shared_data / "odd_rasters" / name, demo.points)
    assert error["code"].startswith("raster")
    assert error["where"] == name


@pytest.mark.parametrize(
    ("text", "words"),
    [("name = 'x", "no TOML"), ("name = 'x'\nwings = 2", 'Unknown key "wings"'), ("radius_m = 1", 'no "name"')],
)
def test_broken_profile(demo: Inputs, earlier: Path, tmp_path: Path, text: str, words: str) -> None:
    profile = tmp_path / "mine.toml"
    profile.write_text(text)
    assert words in refused(earlier, demo.model, demo.points, "--profile", profile)["what"]


@pytest.mark.parametrize("below", ["", "below"])
def test_out_is_a_file(demo: Inputs, tmp_path: Path, below: str) -> None:
    file = tmp_path / "taken"
    file.write_text("mine")
    run = hedgehop("plan", demo.model, demo.points, "--out", file / below, "--json")
    assert run.code == 2
    assert run.json["error"]["code"] == "storage"
    assert file.read_text() == "mine"


def test_unforeseen_failure_is_told_without_a_traceback(
    demo: Inputs, earlier: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def burst(*_: object, **__: object) -> None:
        raise ZeroDivisionError("of the test")

    monkeypatch.setattr("server.cli.shared.planning_run.plan_mission", burst)
    run = hedgehop("plan", demo.model, demo.points, "--out", earlier, "--json")
    assert run.code == 1
    assert run.json["error"]["code"] == "internal"
    assert "ZeroDivisionError: of the test" in run.err
    assert "Traceback" not in run.err


def test_control_characters_never_reach_the_terminal(demo: Inputs, tmp_path: Path) -> None:
    run = hedgehop("plan", demo.model, tmp_path / "\x1b[31mred", "--out", tmp_path / "out")
    assert run.code == 2
    assert "\x1b" not in run.err
    assert "\\x1b[31mred" in run.err


MISSIONS = {
    "points": (HEADER + "1,2,a,0\n", "format", "This is no mission"),
    "empty": ("", "format", "empty"),
    "elsewhere": ("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t-37.1\t175.6\t3\t1\n", "mission", "Home lies outside"),
}


@pytest.mark.parametrize("kind", MISSIONS)
def test_mission_that_cannot_be_judged(demo: Inputs, tmp_path: Path, kind: str) -> None:
    text, code, words = MISSIONS[kind]
    file = tmp_path / "mission.waypoints"
    file.write_text(text)
    run = hedgehop("certify", demo.model, file, "--json")
    assert (run.code, run.json["error"]["code"]) == (2, code)
    assert words in run.json["error"]["what"]


@pytest.mark.parametrize("option", ["--required-clearance-m", "--position-error-m", "--rtl-height-m", "--max-hole-m2"])
def test_certify_demands(demo: Inputs, tmp_path: Path, option: str) -> None:
    mission = tmp_path / "plain.waypoints"
    mission.write_text("QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t37.729\t14.9926\t1712\t1\n")
    run = hedgehop("certify", demo.model, mission, option, "1e300", "--json")
    assert (run.code, run.json["error"]["code"]) == (2, "parameter")


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        (("--profile", "generic-quad"), "parameter", "no camera"),
        (("--gsd-cm", "1", "--height-m", "20"), "parameter", "either a ground sampling distance or a height"),
        (("--gsd-cm", "0"), "parameter", "ground sampling distance is 0.0 cm"),
        (("--gsd-cm", "1e9"), "parameter", "Height H is"),
        (("--height-m", "nan"), "parameter", "height above ground is nan m"),
        (("--side-overlap", "1"), "parameter", "side overlap is 1.0"),
        (("--angle-deg", "nan"), "parameter", "angle is nan"),
    ],
)
def test_survey(demo: Inputs, tmp_path: Path, options: tuple[str, ...], code: str, words: str) -> None:
    area = tmp_path / "area.geojson"
    ring = "[[14.992,37.7295],[14.993,37.7295],[14.993,37.7302],[14.992,37.7295]]"
    area.write_text(f'{{"type": "Polygon", "coordinates": [{ring}]}}')
    run = hedgehop("survey", demo.model, area, "--out", tmp_path / "out", "--json", *options)
    assert (run.code, run.json["error"]["code"]) == (2, code)
    assert words in run.json["error"]["what"]
    assert not (tmp_path / "out").exists()


def test_survey_of_points(demo: Inputs, tmp_path: Path) -> None:
    run = hedgehop("survey", demo.model, demo.points, "--out", tmp_path / "out", "--json")
    assert (run.code, run.json["error"]["what"]) == (2, "There is no polygon in it.")
