"""``hedgehop cloud``: both models, what is told, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.geotiff import read_dsm
from tests.planning.cloud_samples import CORNER, some_points, write_las
from tests.server.cli_runs import contents, hedgehop


def test_a_cloud_becomes_two_models_and_its_spike_goes_when_asked(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    plane = np.column_stack([rng.uniform(0, 20, (20_000, 2)), rng.uniform(0, 0.1, 20_000)])
    xyz: F64 = CORNER + np.vstack([plane, np.array([[10.0, 10.0, 30.0]])]).round(3)
    classes = np.full(len(xyz), 2, np.uint8)
    classes[-1] = 5
    cloud, out = write_las(tmp_path / "a.laz", xyz, classes), tmp_path / "dsm.tif"
    run = hedgehop("cloud", cloud, "--out", out, "--cell", 0.5, "--json")
    assert run.code == 0, run.err
    assert "1 isolated spikes and pits were kept" in run.err
    assert run.json["spikes"] == 1
    assert run.json["taken"] == run.json["points"] == len(xyz)
    dsm, ground = read_dsm(out), read_dsm(tmp_path / "dsm-ground.tif")
    assert dsm.vertical_datum == ground.vertical_datum == "EGM96 height"
    assert dsm.resolution_m == 0.5
    assert np.nanmax(dsm.elevation_m) >= CORNER[2] + 30
    assert np.nanmax(ground.elevation_m) < CORNER[2] + 1
    again = hedgehop("cloud", cloud, "--out", out, "--cell", 0.5, "--remove-spikes")
    assert again.code == 0, again.err
    assert "nobody said" not in again.out
    assert np.nanmax(read_dsm(out).elevation_m) < CORNER[2] + 1


def test_wrong_input_leaves_nothing_behind(tmp_path: Path) -> None:
    cloud = write_las(tmp_path / "a.laz", *some_points(0, 100), crs=None)
    before = contents(tmp_path)
    for arguments, words in (
        (("--out", tmp_path / "dsm.tif"), "--crs EPSG:32633"),
        (("--out", tmp_path / "dsm.ply"), ".tif"),
        (("--out", tmp_path / "dsm.tif", "--cell", -1), "--cell-m: The cell size must be greater than 0, got -1."),
        (("--out", tmp_path / "dsm.tif", "--z-scale", 0), "--z-scale: The height scale must be greater than 0"),
    ):
        run = hedgehop("cloud", cloud, *arguments)
        assert run.code == 2, run.out
        assert words in run.err
    assert contents(tmp_path) == before
