"""``hedgehop traversability``: its layers, a radar log, landing sites, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from planning.terrain.geotiff import read_dsm
from telemetry.simulation.scenarios.foliage import foliage
from telemetry.simulation.scenarios.foliage.foliage_drive import lawn_drive
from telemetry.simulation.scenarios.foliage.foliage_figures import driven
from telemetry.simulation.scenarios.foliage.foliage_trials import trial_site
from tests.server.cli_runs import hedgehop, write_demo


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A radar log of the start of a drive, and its surface model beside it as .tif."""
    log = tmp_path_factory.mktemp("site") / "drive.npz"
    foliage.record(driven(trial_site(1, "c"), lawn_drive()[:700], 0), log)
    return log


def middle(model: Path) -> str:
    dsm = read_dsm(model)
    west, south, east, north = dsm.bounds_m
    ((lat_deg, lon_deg),) = dsm.lat_lon_from_xy(np.array([[(west + east) / 2, (south + north) / 2]])).tolist()
    return f"{lat_deg},{lon_deg}"


def test_all_layers_and_sites(site: Path, tmp_path: Path) -> None:
    model, out = site.with_suffix(".tif"), tmp_path / "ground"
    run = hedgehop(
        "traversability", model, "--uwb", site, "--near", middle(model), "--rotor-span-m", 0.6, "--radius-m", 14,
        "--resolution-m", 0.1, "--out", out, "--json",
    )  # fmt: skip
    assert run.code == 0, run.err
    found = run.json
    assert found["resolution_m"] == pytest.approx(0.1)
    assert found["scans"] == 700
    assert 0 < found["cleared"] <= found["untraversable"] < found["cells"] == 90_000
    assert len(found["sites"]) == 5
    assert "look before landing" in found["caution"]
    assert all(place["obstacle_distance_m"] >= 1.2 for place in found["sites"])
    assert {file.name for file in out.iterdir()} == {
        "before.tif", "cleared.tif", "probability.tif", "time_in_view.tif", "sites.geojson"
    }  # fmt: skip
    before, cleared = (read_dsm(out / f"{name}.tif").elevation_m for name in ("before", "cleared"))
    assert int(((before >= 1) & (cleared == 0)).sum()) == found["cleared"]
    assert read_dsm(out / "time_in_view.tif").elevation_m.max() > 2
    places = json.loads((out / "sites.geojson").read_text())["features"]
    assert [place["properties"]["rank"] for place in places] == [1, 2, 3, 4, 5]


def test_the_papers_rule_clears_less_and_wrong_numbers_are_refused(site: Path, tmp_path: Path) -> None:
    arguments = ("traversability", site.with_suffix(".tif"), "--uwb", site, "--resolution-m", 0.1, "--json")
    ours = hedgehop(*arguments, "--out", tmp_path / "ours.tif")
    paper = hedgehop(*arguments, "--out", tmp_path / "paper.tif", "--uwb-rule", "paper")
    assert 0 < paper.json["cleared"] < ours.json["cleared"]
    assert "the paper's rule" in paper.json["uwb_rule"]
    for option, value in (("--p-o", 0.3), ("--p-c2", 0.6), ("--nearest-m", 20), ("--prior", 1.5)):
        wrong = hedgehop(*arguments, "--out", tmp_path / "no.tif", option, value)
        assert wrong.code == 2, option
        assert not (tmp_path / "no.tif").exists()


def test_words_for_people_and_one_file(tmp_path: Path) -> None:
    model, _ = write_demo(tmp_path)
    run = hedgehop("traversability", model, "--out", tmp_path / "slope.tif", "--near", middle(model))
    assert "untraversable" in run.out
    assert (run.code == 0) == ("Landing site 1" in run.out)
    assert run.out.count("look before landing") == (run.code == 0)
    layer = read_dsm(tmp_path / "slope.tif").elevation_m
    assert 0 <= np.nanmin(layer) <= np.nanmax(layer) <= 1


def test_no_site_ends_it_with_1_and_a_reason(site: Path, tmp_path: Path) -> None:
    model = site.with_suffix(".tif")
    run = hedgehop(
        "traversability", model, "--near", middle(model), "--rotor-span", 9, "--out", tmp_path / "o", "--json"
    )
    assert run.code == 1
    assert run.json["sites"] == []
    assert run.json["caution"] == ""
    assert "two rotor spans" in run.json["no_site"]


def test_what_is_refused(site: Path, tmp_path: Path) -> None:
    model, broken = site.with_suffix(".tif"), tmp_path / "broken.npz"
    broken.write_bytes(b"no log")
    demo, _ = write_demo(tmp_path)
    wrong = {
        (tmp_path / "none.tif",): "none.tif",
        (model, "--uwb", tmp_path / "none.npz"): "There is no such file",
        (model, "--uwb", broken): "This is no UWB log",
        (demo, "--uwb", site): "never enters the surface model",
        (model, "--near", "here"): "is no place",
        (model, "--resolution-m", -1): "A resolution of -1 m",
        (model, "--near", "1,1", "--rotor-span-m", 0): "is no length",
    }
    for arguments, words in wrong.items():
        run = hedgehop("traversability", *arguments, "--out", tmp_path / "out")
        assert run.code == 2, arguments
        assert words in run.err
    assert hedgehop("traversability", model, "--out", tmp_path / "map.png").code == 2
    assert not (tmp_path / "out").exists()


def test_help_has_examples() -> None:
    assert "hedgehop traversability" in hedgehop("traversability", "--help").out.split("Examples:")[1]
