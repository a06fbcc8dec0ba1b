"""``hedgehop survey --parts``: flights of their own that together are the one survey."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from planning.formats.qgc_plan import read_plan
from planning.ground.demo_hillside import demo_survey_polygon
from planning.missions import vehicle_profile
from server.cli.surveys import planned_parts
from tests.server.cli_runs import contents, hedgehop, write_demo

pytestmark = pytest.mark.xdist_group("survey-parts")
GSD = ("--gsd-cm", 0.5)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("inputs")
    ring = [[float(lon), float(lat)] for lat, lon in demo_survey_polygon()]
    area = folder / "area.geojson"
    area.write_text(json.dumps({"type": "Polygon", "coordinates": [[*ring, ring[0]]]}))
    return write_demo(folder)[0], area


@pytest.fixture(scope="module")
def halves(inputs: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    out = tmp_path_factory.mktemp("halves")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(planned_parts, "utc_now", lambda: "2026-01-01T00:00:00.000Z")
        run = hedgehop("survey", *inputs, "--out", out, *GSD, "--parts", 2, "--json")
    assert run.code == 0, run.err
    return out, run.json


def lines_flown(mission: Path) -> list[tuple[float, float]]:
    items = read_plan(mission.read_text()).items
    return [(round(item.lat_deg, 7), round(item.lon_deg, 7)) for item in items if item.command == 16]


def test_each_part_s_proof_stands_by_itself(inputs: tuple[Path, Path], halves: tuple[Path, dict[str, Any]]) -> None:
    out, summary = halves
    assert [entry["folder"] for entry in summary["parts"]] == ["part-1", "part-2"]
    assert summary == json.loads((out / "parts.json").read_text())
    for entry in summary["parts"]:
        again = hedgehop("certify", inputs[0], out / entry["folder"] / "mission.plan", "--json")
        assert again.code == 0
        assert again.json["certified"]
        assert again.json["min_distance_m"] == pytest.approx(entry["min_distance_m"], abs=1e-6)
        assert entry["feasible"]


def test_together_they_are_the_one_survey(
    inputs: tuple[Path, Path], halves: tuple[Path, dict[str, Any]], tmp_path: Path
) -> None:
    out, summary = halves
    one = hedgehop("survey", *inputs, "--out", tmp_path / "one", *GSD, "--json").json
    together = summary["survey"]
    assert together["area_m2"] == pytest.approx(one["survey"]["area_m2"], rel=0.01)
    assert together["photographed_share"] == pytest.approx(one["survey"]["photographed_share"], abs=0.005)
    assert together["faults"] == []
    (first, middle), (after, last) = (entry["lines"] for entry in summary["parts"])
    assert (first, after) == (1, middle + 1)
    whole = lines_flown(tmp_path / "one" / "mission.plan")
    parts = [lines_flown(out / f"part-{k}" / "mission.plan") for k in (1, 2)]
    assert (parts[0][0], parts[1][-1]) == (whole[0], whole[-1])
    assert last > middle


@pytest.mark.parametrize("where", ["local:2"])
def test_on_workers_the_files_are_the_same_bytes(
    inputs: tuple[Path, Path],
    halves: tuple[Path, dict[str, Any]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    where: str,
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(planned_parts, "utc_now", lambda: "2026-01-01T00:00:00.000Z")
    run = hedgehop("survey", *inputs, "--out", tmp_path, *GSD, "--parts", 2, "--cluster", where, "--json")
    assert run.json == halves[1]
    assert contents(tmp_path) == contents(halves[0])


def with_endurance(folder: Path, seconds: float) -> Path:
    text = (Path(vehicle_profile.__file__).parent / "profiles" / "mapper-rtk.toml").read_text()
    changed = re.sub(r"(?m)^endurance_s = .*$", f"endurance_s = {seconds}", text)
    assert changed != text
    (folder / "short.toml").write_text(changed)
    return folder / "short.toml"


def test_as_few_parts_as_the_battery_allows(inputs: tuple[Path, Path], tmp_path: Path) -> None:
    profile = with_endurance(tmp_path, 360)
    one = hedgehop("survey", *inputs, "--out", tmp_path / "one", *GSD, "--profile", profile, "--json")
    assert (one.code, one.json["feasible"]) == (1, False)
    run = hedgehop("survey", *inputs, "--out", tmp_path / "auto", *GSD, "--profile", profile, "--parts", "auto")
    assert run.code == 0, run.out
    parts = json.loads((tmp_path / "auto" / "parts.json").read_text())["parts"]
    assert len(parts) > 1
    assert all(entry["duration_s"] <= entry["usable_endurance_s"] for entry in parts)
    assert one.json["duration_s"] > (len(parts) - 1) * parts[0]["usable_endurance_s"] * 0.7
    assert f"part-{len(parts)}, lines {parts[-1]['lines'][0]} to" in run.out
    assert "together: photos:" in run.out


def test_as_few_parts_as_the_vehicle_s_items_allow(inputs: tuple[Path, Path], tmp_path: Path) -> None:
    run = hedgehop("survey", *inputs, "--out", tmp_path, *GSD, "--max-items", 25, "--parts", "auto", "--json")
    assert run.code == 0
    assert len(run.json["parts"]) > 1
    assert all(entry["items"] <= 25 for entry in run.json["parts"])


def test_a_line_that_no_vehicle_can_hold_is_named_and_nothing_is_written(
    inputs: tuple[Path, Path], tmp_path: Path
) -> None:
    run = hedgehop("survey", *inputs, "--out", tmp_path / "o", *GSD, "--max-items", 8, "--parts", 13, "--json")
    assert (run.code, run.json["error"]["code"]) == (2, "mission_capacity")
    assert run.json["error"]["where"].startswith("line 1")
    assert not (tmp_path / "o").exists()


def test_parts_of_another_survey_are_not_mixed_with_these(inputs: tuple[Path, Path], tmp_path: Path) -> None:
    (tmp_path / "part-3").mkdir()
    run = hedgehop("survey", *inputs, "--out", tmp_path, "--parts", 2)
    assert run.code == 2
    assert "There are parts of a survey in it already" in run.err
    assert [path.name for path in tmp_path.iterdir()] == ["part-3"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--parts", "0"), "no number of parts"),
        (("--parts", "²"), "no number of parts"),
        (("--parts", "many"), "no number of parts"),
        (("--parts", "-1"), "no number of parts"),
        (("--parts", "1999"), "has no 1999 parts"),
        (("--cluster", "local"), "One flight is planned here"),
        (("--parts", "2", "--cluster", "tcp://10.0.0.5:8786"), "anyone in that network"),
    ],
)
def test_what_cannot_be_done_is_said(
    inputs: tuple[Path, Path], tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    run = hedgehop("survey", *inputs, "--out", tmp_path / "o", *arguments)
    assert run.code == 2
    assert words in run.err
    assert not (tmp_path / "o").exists()
