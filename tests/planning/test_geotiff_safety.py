"""Hostile and broken raster files: refused in time, nothing read, nothing changed, no process left behind."""

import hashlib
import multiprocessing
import subprocess
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from affine import Affine
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.errors import PlanningError, RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import RasterLimits, read_dsm, read_dsm_reported, read_orthophoto
from planning.terrain.rasters import sandbox
from tests.planning.geotiff_samples import HALF_METRE, UTM, hill, write_raster

BOUNDS = (500_000.0, 4_169_980.0, 500_025.0, 4_170_000.0)


@pytest.fixture
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where private directories are made: must be empty in the end."""
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def workers(monkeypatch: pytest.MonkeyPatch) -> list[subprocess.Popen[bytes]]:
    """The worker processes that were started."""
    started: list[subprocess.Popen[bytes]] = []
    start = sandbox._start

    def recorded(*args: object) -> subprocess.Popen[bytes]:
        started.append(start(*args))  # pyright: ignore[reportArgumentType]
        return started[-1]

    monkeypatch.setattr(sandbox, "_start", recorded)
    return started


def sparse(path: Path, size: int, **profile: Any) -> Path:
    shape = {"width": size, "height": size, "count": 1, "dtype": "float32", "crs": UTM, "transform": HALF_METRE}
    with rasterio.open(path, "w", driver="GTiff", compress="deflate", SPARSE_OK=True, **shape, **profile):
        return path


def test_a_bomb_is_refused_by_its_header(tmp_path: Path, workers: list[subprocess.Popen[bytes]]) -> None:
    path = sparse(tmp_path / "bomb.tif", 100_000, tiled=True)
    with pytest.raises(RasterTooLargeError, match=r"bomb\.tif: 100000 x 100000 pixels.*Crop"):
        read_dsm(path)
    with pytest.raises(RasterTooLargeError, match="100000 x 100000"):
        read_orthophoto(path, bounds_m=BOUNDS, crs=CRS.from_user_input(UTM))
    assert [worker.returncode is not None for worker in workers] == [True, True]


def test_one_huge_block_is_refused_by_its_header(tmp_path: Path) -> None:
    path = sparse(tmp_path / "block.tif", 10_000, blockysize=10_000)
    with pytest.raises(RasterTooLargeError, match=r"381 MiB.*TILED=YES"):
        read_dsm(path)


def test_ascii_grid_that_announces_too_much(tmp_path: Path) -> None:
    path = tmp_path / "x.asc"
    path.write_text("ncols 100000\nnrows 100000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3\n")
    with pytest.raises(RasterTooLargeError, match="100000 x 100000"):
        read_dsm(path, crs=UTM)


def test_ten_thousand_squared_is_accepted(tmp_path: Path) -> None:
    path = sparse(tmp_path / "x.tif", 10_000, tiled=True)
    with rasterio.open(path, "r+") as file:
        file.write(hill(256, 256), 1, window=((5120, 5376), (5120, 5376)))
    assert float(np.nanmax(read_dsm(path).elevation_m)) == hill(256, 256).max()


def test_a_virtual_raster_in_disguise_reads_nothing(tmp_path: Path, workers: list[subprocess.Popen[bytes]]) -> None:
    secret = write_raster(tmp_path / "secret.tif", hill())
    source = f'<SourceFilename relativeToVRT="0">{secret}</SourceFilename>'
    band = f'<VRTRasterBand dataType="Float32" band="1"><SimpleSource>{source}</SimpleSource></VRTRasterBand>'
    path = tmp_path / "dsm.tif"
    path.write_text(f'<VRTDataset rasterXSize="50" rasterYSize="40">{band}</VRTDataset>')
    with pytest.raises(RasterFormatError, match="virtual raster"):
        read_dsm(path)
    assert workers == []


def test_files_beside_it_are_neither_read_nor_changed(tmp_path: Path) -> None:
    secret = write_raster(tmp_path / "secret.tif", hill() + 1000)
    path = write_raster(tmp_path / "dsm.tif", hill())
    source = f'<SourceFilename relativeToVRT="0">{secret}</SourceFilename>'
    overview = f'<VRTRasterBand dataType="Float32" band="1"><SimpleSource>{source}</SimpleSource></VRTRasterBand>'
    declared = "<PAMRasterBand band='1'><NoDataValue>100</NoDataValue></PAMRasterBand>"
    beside = {
        "dsm.tif.aux.xml": f"<PAMDataset>{declared}</PAMDataset>",
        "dsm.tif.ovr": f'<VRTDataset rasterXSize="50" rasterYSize="40">{overview}</VRTDataset>',
        "dsm.tif.msk": f'<VRTDataset rasterXSize="50" rasterYSize="40">{overview}</VRTDataset>',
        "dsm.tfw": "9\n0\n0\n-9\n1\n1\n",
        "dsm.prj": "nonsense",
    }
    for name, text in beside.items():
        (tmp_path / name).write_text(text)
    before = {item.name: item.read_bytes() for item in tmp_path.iterdir()}
    dsm, _ = read_dsm_reported(path)
    np.testing.assert_array_equal(dsm.elevation_m, hill())
    assert dsm.transform == HALF_METRE
    assert {item.name: item.read_bytes() for item in tmp_path.iterdir()} == before


@pytest.mark.parametrize(
    "content", [b"", b"II*\0", b"II+\0" + b"\xff" * 60, b"MM\0*" + b"\0" * 60, b"ncols 5\n", b"PK\3\4"]
)
def test_stumps(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.tif"
    path.write_bytes(content)
    with pytest.raises(RasterFormatError):
        read_dsm(path)


@pytest.mark.parametrize("name", ["missing.tif", "/vsicurl/http://127.0.0.1:1/x.tif"])
def test_paths_that_are_no_files(tmp_path: Path, name: str) -> None:
    with pytest.raises(RasterFormatError, match="no such file"):
        read_dsm(tmp_path / name)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(changes=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 255)), min_size=1, max_size=6))
def test_changed_bytes_give_a_model_or_an_error(tmp_path: Path, changes: list[tuple[float, int]]) -> None:
    path = tmp_path / "x.tif"
    path.unlink(missing_ok=True)
    write_raster(path, hill(), compress="deflate", nodata=-9999)
    content = bytearray(path.read_bytes())
    for place, value in changes:
        content[int(place**3 * (len(content) - 1))] = value
    path.write_bytes(content)
    outcome: Dsm | PlanningError
    try:
        outcome = read_dsm(path)
    except PlanningError as error:
        outcome = error
    assert isinstance(outcome, PlanningError) or outcome.sha256 == hashlib.sha256(content).hexdigest()


@pytest.mark.parametrize(
    ("start_s", "words"), [(120.0, "Decoding took more than 0 s"), (0.001, "did not start within 0 s: this computer")]
)
def test_too_slow_a_file_is_given_up_and_a_late_start_is_not_its_fault(
    tmp_path: Path,
    temporary: Path,
    workers: list[subprocess.Popen[bytes]],
    monkeypatch: pytest.MonkeyPatch,
    start_s: float,
    words: str,
) -> None:
    monkeypatch.setattr(sandbox, "_START_S", start_s)
    path = write_raster(tmp_path / "x.tif", hill())
    with pytest.raises(RasterError, match=words):
        read_dsm(path, limits=RasterLimits(header_s=0.0))
    assert workers[0].returncode is not None
    assert list(temporary.iterdir()) == []


def test_too_little_memory_is_an_error(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill())
    with pytest.raises(RasterError) as caught:
        read_dsm(path, limits=RasterLimits(max_memory_bytes=60 * 2**20))
    assert caught.value.where == "x.tif"
    assert caught.value.advice


@pytest.mark.parametrize(
    ("code", "text"), [("os.abort()", "SIGABRT"), ("os._exit(3)", "exit code 3"), ("print('{', end='')", "died of it")]
)
def test_a_decoder_that_dies_is_an_error(
    tmp_path: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch, code: str, text: str
) -> None:
    def start(directory: Path, stderr: object) -> subprocess.Popen[bytes]:
        del stderr
        command = [sys.executable, "-c", f"import os; {code}"]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    monkeypatch.setattr(sandbox, "_start", start)
    with pytest.raises(RasterFormatError, match=text):
        read_dsm(write_raster(tmp_path / "x.tif", hill()))
    assert list(temporary.iterdir()) == []


@pytest.mark.parametrize(
    ("refusing", "match"),
    [
        ("resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))", r"larger than is allowed.*ulimit"),
        ("fail = lambda *_: (_ for _ in ()).throw(OSError(28, 'full')); from planning.terrain.rasters import decode;"
         " decode.JOBS = dict.fromkeys(decode.JOBS, fail)", r"no room for the heights.*TMPDIR"),
    ],
    ids=["file size", "disk"],
)  # fmt: skip
def test_a_file_that_cannot_grow_is_named_and_leaves_nothing(
    tmp_path: Path, temporary: Path, monkeypatch: pytest.MonkeyPatch, refusing: str, match: str
) -> None:
    path = write_raster(tmp_path / "x.tif", hill())
    run = "import runpy; runpy.run_module('planning.terrain.rasters.worker', run_name='__main__')"
    monkeypatch.setattr(sandbox, "_COMMAND", [sys.executable, "-P", "-c", f"import resource; {refusing}; {run}"])
    with pytest.raises(RasterError, match=match):
        read_dsm(path)
    assert list(temporary.iterdir()) == []


def test_no_temporary_directory_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(RasterError, match="TMPDIR"):
        read_dsm(write_raster(tmp_path / "x.tif", hill()))


class CancelledError(Exception):
    pass


def test_cancelling_ends_the_worker(tmp_path: Path, temporary: Path, workers: list[subprocess.Popen[bytes]]) -> None:
    def cancel(stage: str, share: float) -> None:
        raise CancelledError(stage, share)

    with pytest.raises(CancelledError):
        read_dsm(write_raster(tmp_path / "x.tif", hill()), progress=cancel)
    assert workers[0].returncode is not None
    assert list(temporary.iterdir()) == []


def test_the_worker_ends_with_its_parent(tmp_path: Path) -> None:
    with (tmp_path / "stderr").open("w+b") as stderr, sandbox._start(tmp_path, stderr) as worker:
        assert worker.stdin is not None
        worker.stdin.close()
        assert worker.wait(120) == 0


def test_foreign_settings_do_not_reach_the_worker(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GDAL_SKIP", "")
    monkeypatch.setenv("GDAL_PAM_ENABLED", "YES")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "x")
    environment = sandbox._environment()
    assert "VRT" in environment["GDAL_SKIP"].split()
    assert environment["GDAL_PAM_ENABLED"] == "NO"
    assert environment["GDAL_DISABLE_READDIR_ON_OPEN"] == "EMPTY_DIR"
    assert "AWS_SECRET_ACCESS_KEY" not in environment


def test_from_threads_and_from_a_worker_process(tmp_path: Path, temporary: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), transform=HALF_METRE @ Affine.rotation(10))
    with ThreadPoolExecutor(2) as pool:
        models = list(pool.map(read_dsm, [path, path]))
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        models.append(pool.submit(read_dsm, path).result())
    for dsm in models:
        np.testing.assert_array_equal(dsm.elevation_m, models[0].elevation_m)
    assert list(temporary.iterdir()) == []
