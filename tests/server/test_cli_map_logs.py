"""``hedgehop map`` of logs, as it is typed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import rasterio

from tests.server.cli_runs import hedgehop
from tests.telemetry.range_logs import HOME, Flight, dataflash_of, ulog_of, with_finder, with_single


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("log") / "flight.ulg"
    path.write_bytes(with_single(ulog_of(Flight()), Flight(), 0))
    return path


def test_the_wall_stands_on_earth(log: Path, tmp_path: Path) -> None:
    out = tmp_path / "wall.tif"
    run = hedgehop("map", log, "--sensor", "ranges", "--out", out, "--json")
    assert run.code == 0
    assert (run.json["frames"], run.json["dropped"]) == (43, 0)
    assert "The map counts from home: 47.0000000°, 8.0000000°, 500.00 m above sea level" in " ".join(run.err.split())
    with rasterio.open(out) as raster:
        heights_m = raster.read(1, masked=True)
        assert np.abs(heights_m.compressed() - HOME.alt_m - 10.0).max() <= 0.5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--sensor", "radar"), "flight.ulg: A log of this kind holds single distances, and nothing of a radar. Give"),
        (("--sensor", "ranges", "--points", "/a"), "--points only means something for a bag of ROS."),
    ],
)
def test_what_a_log_has_not_is_refused(log: Path, tmp_path: Path, options: tuple[str, ...], words: str) -> None:
    run = hedgehop("map", log, *options, "--out", tmp_path / "a.ply")
    assert run.code == 2
    assert words in " ".join(run.err.split())
    assert list(tmp_path.iterdir()) == []


def test_a_flight_in_which_nothing_was_hit_is_no_map(tmp_path: Path) -> None:
    log = tmp_path / "flight.bin"
    log.write_bytes(with_finder(dataflash_of(Flight()), Flight(), 0, status=3))
    run = hedgehop("map", log, "--sensor", "ranges", "--out", tmp_path / "a.ply")
    assert run.code == 1
    assert "flight.bin: The map is empty: 43 frames with 0 points" in " ".join(run.err.split())
