"""hedgehop plan over surface models of other kinds."""

from __future__ import annotations

from pathlib import Path

from tests.server.cli_runs import hedgehop


def test_campus_is_certified(shared_data: Path, tmp_path: Path) -> None:
    points = tmp_path / "pois.csv"
    points.write_text("49.1382210,20.2180263,,0\n49.1386161,20.2175308,,1\n49.1377898,20.2176067,,1\n")
    run = hedgehop("plan", shared_data / "dsm" / "campus" / "dsm.tif", points, "--out", tmp_path / "out", "--json")
    assert run.code == 0
    assert run.json["dsm"]["crs"] == "EPSG:8353"


def test_metres_are_told_from_centimetres(shared_data: Path, tmp_path: Path) -> None:
    points = tmp_path / "pois.csv"
    points.write_text("41.6882698,-93.8972652\n41.6874698,-93.8982652\n")
    model = shared_data / "dsm" / "uint16_centimetres" / "small_dem_3m_merged.tif"
    guessed = hedgehop("plan", model, points, "--out", tmp_path / "out")
    assert "look like centimetres, not metres: use --z-scale 0.01" in guessed.err
    declared = hedgehop("plan", model, points, "--out", tmp_path / "out", "--z-scale", 0.01)
    assert declared.err == ""


def test_grid_without_a_reference_system(shared_data: Path, tmp_path: Path) -> None:
    points = tmp_path / "pois.csv"
    points.write_text("0.6435885,-124.2444082\n0.6455885,-124.2434082\n")
    model = shared_data / "dsm" / "landslide" / "pre_runout_DEM.asc"
    refused = hedgehop("plan", model, points, "--out", tmp_path / "out", "--json")
    assert (refused.code, refused.json["error"]["code"]) == (2, "raster_no_crs")
    assert "--crs" in refused.json["error"]["advice"]
    accepted = hedgehop("plan", model, points, "--out", tmp_path / "out", "--json", "--crs", "EPSG:32610")
    assert accepted.json["dsm"]["crs"] == "EPSG:32610"
