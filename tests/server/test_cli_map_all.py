"""``hedgehop map --all``: every recording of a folder, here and by workers."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import distributed
import pytest

from tests.server.test_cli_map import flown, run

pytestmark = pytest.mark.xdist_group("cluster")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two flights, one of them in a folder of its own, and a file that is none."""
    folder = tmp_path_factory.mktemp("flights")
    (folder / "day 2").mkdir()
    flown(folder / "a.mcap")
    shutil.copy(folder / "a.mcap", folder / "day 2" / "b.mcap")
    (folder / "spoilt.mcap").write_bytes(b"no recording at all")
    (folder / "notes.txt").write_text("x", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    running = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0", silence_logs=50
    )
    try:
        yield running.scheduler_address
    finally:
        running.close()


def test_each_has_a_map_and_one_that_cannot_keeps_none_from_theirs(
    folder: Path, scheduler: str, tmp_path: Path
) -> None:
    alone = tmp_path / "alone.ply"
    assert run(folder / "a.mcap", "--sensor", "radar", "--out", alone)[0] == 0
    for out, how in ((tmp_path / "here", ()), (tmp_path / "there", ("--cluster", scheduler))):
        code, found = run(folder, "--all", "--sensor", "radar", "--out", out, *how)
        assert code == 1
        entries = found["maps"]
        assert isinstance(entries, list)
        assert [entry["recording"] for entry in entries] == ["a.mcap", "day 2/b.mcap", "spoilt.mcap"]
        assert [entry.get("voxels_occupied", 0) > 10 for entry in entries] == [True, True, False]
        assert entries[2]["error"]["where"] == "spoilt.mcap"
        assert (out / "a.ply").read_bytes() == (out / "day 2" / "b.ply").read_bytes() == alone.read_bytes()
        assert not (out / "spoilt.ply").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("a.mcap", "--all", "--out", "maps"), "no folder"),
        (("empty", "--all", "--out", "maps"), "no recording"),
        ((".", "--all", "--out", "maps", "--format", "xyz"), "xyz is no format of maps"),
        ((".", "--all", "--out", "maps", "--points", "/radar"), "--points only means something for a bag"),
        ((".", "--all", "--out", "maps", "--cluster", "tcp://10.0.0.5:8786"), "anyone in that network"),
        (("a.mcap", "--out", "a.ply", "--format", "ply"), "with --all only"),
        (("a.mcap", "--out", "a.ply", "--cluster", "local"), "with --all only"),
    ],
)
def test_what_cannot_be_done_is_said(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], words: str
) -> None:
    monkeypatch.chdir(folder)
    (folder / "empty").mkdir(exist_ok=True)
    code, found = run(arguments[0], "--sensor", "radar", *arguments[1:])
    assert code == 2
    error = found["error"]
    assert isinstance(error, dict)
    assert words in error["what"]
