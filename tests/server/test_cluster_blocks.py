"""A dilated surface and a traversability map worked out in blocks by two workers: the files of one process."""

from __future__ import annotations

import importlib
import math
import os
import signal
import time
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import distributed
import numpy as np
import pytest
from affine import Affine

from mapping.geometry.arrays import F32
from planning.errors import NoElevationError, RasterError
from planning.ground.traversable import map_cells, traversable_ground
from planning.safe_surface.surface import dilate
from planning.terrain.dsm import LARGE_PX
from planning.terrain.geotiff import read_dsm, write_dsm
from planning.terrain.grid_file import GridPlace, Put
from server.cli.shared import by_blocks
from server.cli.shared.by_blocks import Block, BlockOrder, blocks_of, write_by_blocks
from server.cli.shared.options import ModelOptions
from server.cli.terrain.dilate_command import Dilation
from server.cli.terrain.map_in_blocks import MapWork
from server.traversability.maps import Maps
from server.traversability.task import write_layer
from server.work import cluster
from server.work.clocks import StepTimer
from tests.planning.geotiff_samples import HALF_METRE, write_raster
from tests.server.cli_runs import hedgehop
from tests.server.running_workers import running_workers

pytestmark = pytest.mark.xdist_group("cluster")

RADIUS_M, HEIGHT_M = 3.1, 2.0
ROWS, COLUMNS = 40, 30
DEGREES = Affine(5e-6, 0.0, 14.99, 0.0, -4e-6, 37.73)
Told = Callable[[float], None]


@pytest.fixture(scope="module")
def scheduler() -> Iterator[str]:
    with running_workers() as address:
        yield address


def _heights(rows: int, columns: int) -> F32:
    random = np.random.default_rng(4)
    heights = random.uniform(0.0, 0.3, (rows, columns)) + 100.0 + 5.0 * (random.random((rows, columns)) < 0.02)
    heights[random.random(heights.shape) < 0.1] = -9999.0
    heights[rows // 3 : rows // 2, columns // 4 : columns // 2] = -9999.0
    return heights.astype(np.float32)


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The large one is read in parts."""
    folder = tmp_path_factory.mktemp("models")
    assert LARGE_PX < 2003 * 2011
    return {
        name: write_raster(folder / f"{name}.tif", _heights(*shape), crs=crs, transform=transform, nodata=-9999.0)
        for name, shape, crs, transform in (
            ("metres", (211, 173), "EPSG:32633+5773", HALF_METRE),
            ("degrees", (83, 71), "EPSG:4326", DEGREES),
            ("large", (2003, 2011), "EPSG:32633", HALF_METRE),
        )
    }


def _quiet(share: float) -> None:
    assert 0.0 <= share <= 1.0


def _dilated(order: BlockOrder, told: Told = _quiet) -> bytes:
    opened = order.open(StepTimer())
    model = opened.model
    place = GridPlace(model.transform, model.crs, model.vertical_datum, (model.height_px, model.width_px))
    write_by_blocks(order, opened, place, Dilation(RADIUS_M, HEIGHT_M), told)
    return order.out.read_bytes()


def _mapped(order: BlockOrder, resolution_m: float) -> tuple[bytes, tuple[int, ...]]:
    opened = order.open(StepTimer())
    cells = map_cells(opened.model, resolution_m)
    place = GridPlace(cells.transform, opened.model.crs, None, cells.shape)
    counts = write_by_blocks(order, opened, place, MapWork(cells), _quiet, together=cells.together)
    return order.out.read_bytes(), counts


@pytest.mark.parametrize(
    ("name", "most"), [("metres", (64, 50)), ("metres", (300, 300)), ("degrees", (41, 29)), ("large", (800, 1100))]
)
def test_the_files_are_those_of_one_process(
    scheduler: str, models: dict[str, Path], tmp_path: Path, name: str, most: tuple[int, int]
) -> None:
    dsm = read_dsm(models[name])
    write_dsm(tmp_path / "whole.tif", dilate(dsm.as_grid(), radius_m=RADIUS_M, height_m=HEIGHT_M))
    order = BlockOrder(models[name], ModelOptions(), tmp_path / "dilated.tif", scheduler, most)
    assert _dilated(order) == (tmp_path / "whole.tif").read_bytes()
    ground = traversable_ground(dsm, 1.0)
    write_layer(tmp_path / "map.tif", Maps(ground), "before")
    counts = int(ground.map.known.sum()), int(ground.map.untraversable.sum())
    made = _mapped(replace(order, out=tmp_path / "blocks.tif"), 1.0)
    assert made == ((tmp_path / "map.tif").read_bytes(), counts)
    assert 0 < counts[1] < counts[0]


def test_a_worker_that_dies_loses_nothing(models: dict[str, Path], tmp_path: Path) -> None:
    order = BlockOrder(models["metres"], ModelOptions(), tmp_path / "here.tif", None, (30, 30))
    here, killed = _dilated(order), []
    with running_workers() as mortal, distributed.Client(mortal, set_as_default=False) as client:
        pids: dict[str, int] = client.run(os.getpid)  # pyright: ignore[reportAssignmentType]

        def kill_one(share: float) -> None:
            if share > 0.1 and not killed:
                killed.append(min(pids.values()))
                os.kill(killed[0], signal.SIGKILL)

        assert _dilated(replace(order, out=tmp_path / "there.tif", cluster=mortal), kill_one) == here
        assert killed


def test_what_is_stopped_leaves_no_file(scheduler: str, models: dict[str, Path], tmp_path: Path) -> None:
    def stop(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    for where in (scheduler, None):
        with pytest.raises(KeyboardInterrupt):
            _dilated(BlockOrder(models["metres"], ModelOptions(), tmp_path / "none.tif", where, (30, 30)), stop)
        assert list(tmp_path.iterdir()) == []


def test_a_model_that_knows_nothing_is_said(tmp_path: Path) -> None:
    """Large, so that nobody has looked at all of it before."""
    none = np.full((2003, 2011), -9999.0, np.float32)
    path = write_raster(tmp_path / "model.tif", none, nodata=-9999.0, compress="deflate")
    order = BlockOrder(path, ModelOptions(), tmp_path / "out" / "dilated.tif", None)
    with pytest.raises(NoElevationError, match="Every cell is unknown"):
        _dilated(order)
    assert not order.out.exists()


@pytest.mark.parametrize("together", [1, 3, 40])
@pytest.mark.parametrize("shape", [(1, 1), (700, 500), (5000, 9000), (3000, 400_000)])
def test_blocks_cover_a_grid_once_and_few_rows_wait(shape: tuple[int, int], together: int) -> None:
    shape = math.ceil(shape[0] / together), math.ceil(shape[1] / together)
    boxes = blocks_of(shape, (2048, 4096), together)
    assert sum(box.shape[0] * box.shape[1] for box in boxes) == shape[0] * shape[1]
    firsts = [(box.row0, box.col0) for box in boxes]
    assert firsts == sorted(set(firsts))
    assert len(firsts) == len({row for row, _ in firsts}) * len({column for _, column in firsts})
    for box in boxes:
        assert 0 < box.shape[0] * together <= max(2048, together)
        assert 0 < box.shape[1] * together <= max(4096, together)
        assert box.shape[0] * shape[1] <= max(64_000_000, 256 * shape[1])


def test_the_commands_write_the_same_here_and_on_workers(
    scheduler: str, models: dict[str, Path], tmp_path: Path
) -> None:
    ball = "terrain", "dilate", models["metres"], "--radius-m", RADIUS_M, "--height-m", HEIGHT_M
    here = hedgehop(*ball, "--out", tmp_path / "a" / "dilated.tif")
    there = hedgehop(*ball, "--out", tmp_path / "b" / "dilated.tif", "--cluster", scheduler)
    assert (here.code, here.out) == (0, there.out), here.err + there.err
    assert here.out.startswith("dilated.tif: 173 x 211 cells of 0.50 m, dilated by R 3.1 m, H 2 m; ")
    assert (tmp_path / "a" / "dilated.tif").read_bytes() == (tmp_path / "b" / "dilated.tif").read_bytes()
    back = read_dsm(tmp_path / "a" / "dilated.tif")
    assert (back.crs.to_epsg(), back.vertical_datum) == (32633, "EGM96 height")
    ground = "traversability", models["metres"], "--resolution-m", 1
    here = hedgehop(*ground, "--out", tmp_path / "c" / "ground")
    there = hedgehop(*ground, "--out", tmp_path / "d" / "ground", "--cluster", scheduler)
    assert (here.code, here.out) == (0, there.out), here.err + there.err
    assert (tmp_path / "c/ground/before.tif").read_bytes() == (tmp_path / "d/ground/before.tif").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--radius-m", 200), "larger than the surface model's shorter side"),
        (("--radius-m", "nan"), "dilation radius is nan"),
        (("--height-m", 0), "dilation height is 0"),
        (("--out", "there.tif"), "There is such a file already"),
        (("--out", "there.tif/dilated.tif"), "This is a file, not a directory"),
        (("--out", "dilated.png"), "Give --out a name with .tif"),
        (("--cluster", "dask"), "names no cluster"),
        (("--cluster", "tcp://127.0.0.1:1"), "No Dask scheduler is reached"),
    ],
)
def test_what_cannot_be_dilated_is_said(
    models: dict[str, Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, object],
    words: str,
) -> None:
    monkeypatch.setattr(cluster, "_REACH_S", 1.0)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.tif").write_bytes(b"mine")
    run = hedgehop("terrain", "dilate", models["metres"], "--out", "dilated.tif", *arguments)
    assert run.code != 0
    assert words in run.err
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"mine"]


def test_models_that_cannot_be_dilated_are_said(tmp_path: Path) -> None:
    out = tmp_path / "out" / "dilated.tif"
    heights = _heights(90, 90)
    no_crs = write_raster(tmp_path / "no_crs.tif", heights, crs=None, nodata=-9999.0)
    assert "--crs" in (run := hedgehop("terrain", "dilate", no_crs, "--out", out)).err
    assert run.code == 2
    fine = write_raster(tmp_path / "fine.tif", _heights(1100, 1100), transform=HALF_METRE @ Affine.scale(0.02))
    assert "1,001 cells of this model" in hedgehop("terrain", "dilate", fine, "--radius-m", 10.01, "--out", out).err
    assert "not read from a server" in hedgehop("terrain", "dilate", "https://a.example/dsm.tif", "--out", out).err
    tiles = tmp_path / "tiles"
    tiles.mkdir()
    write_raster(tiles / "one.tif", heights, nodata=-9999.0)
    assert "would become a tile" in hedgehop("terrain", "dilate", tiles, "--out", tiles / "dilated.tif").err
    assert not out.exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--near", "37.7,14.9"), "--near needs the whole map"),
        (("--uwb", "drive.npz"), "--uwb needs the whole map"),
        (("--remove-spikes",), "not in blocks"),
        (("--catalogue",), "catalogue of several models"),
        (("--resolution-m", 1200), "2,400 x 2,400 of the model's become one"),
        (("--resolution-m", -1), "makes no sense"),
    ],
)
def test_what_cannot_be_mapped_in_blocks_is_said(
    models: dict[str, Path], tmp_path: Path, arguments: tuple[object, ...], words: str
) -> None:
    run = hedgehop("traversability", models["metres"], "--out", tmp_path / "a.tif", "--cluster", "local", *arguments)
    assert run.code == 2
    assert words in run.err
    assert list(tmp_path.iterdir()) == []


def test_without_dask_it_says_how_to_get_it(
    models: dict[str, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = importlib.import_module

    def absent(name: str, package: str | None = None) -> object:
        if name == "distributed":
            raise ModuleNotFoundError(f"No module named {name!r}")
        return found(name, package)

    monkeypatch.setattr(importlib, "import_module", absent)
    run = hedgehop("terrain", "dilate", models["metres"], "--out", tmp_path / "a.tif", "--cluster", "local")
    assert "pip install 'hedgehop[cluster]'" in run.err
    assert list(tmp_path.iterdir()) == []


def test_a_worker_of_several_threads_does_one_piece_at_a_time() -> None:
    """What it keeps of a model is shared by its threads."""
    at_once, most = [0], [0]

    def look(piece: int) -> int:
        at_once[0] += 1
        most[0] = max(most[0], at_once[0])
        time.sleep(0.01)
        at_once[0] -= 1
        return piece

    asked_with = cluster.installed()
    with ThreadPoolExecutor(4) as pool:
        answers = list(pool.map(lambda piece: cluster._answered(look, piece, asked_with), range(12)))
    assert answers == list(range(12))
    assert most == [1]


def test_what_breaks_off_while_blocks_come_ends_the_work_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A disk that is full: left to the collector, the cluster would be waited for when the command has ended."""
    ends: list[str] = []

    def answers(*_: object) -> Generator[Block]:
        try:
            while True:
                yield Block(np.zeros((ROWS, COLUMNS), np.float32), 1, (1,))
        finally:
            ends.append("closed")

    @contextmanager
    def full(*_: object, **__: object) -> Iterator[Put]:
        def put(rows: F32) -> NoReturn:
            raise RasterError("The disk is full.")

        yield put

    monkeypatch.setattr(by_blocks, "spread", answers)
    monkeypatch.setattr(by_blocks, "rows_written", full)
    write_raster(tmp_path / "dsm.tif", np.ones((ROWS, COLUMNS), np.float32))
    order = BlockOrder(tmp_path / "dsm.tif", ModelOptions(), tmp_path / "out.tif", "local:1")
    opened = order.open(StepTimer(lambda *_: None))
    place = GridPlace(opened.model.transform, opened.model.crs, opened.model.vertical_datum, (ROWS, COLUMNS))
    with pytest.raises(RasterError) as raised:
        write_by_blocks(order, opened, place, Dilation(RADIUS_M, HEIGHT_M), lambda _: None)
    assert raised.value.__traceback__ is not None, "which holds the frames"
    assert ends == ["closed"]
