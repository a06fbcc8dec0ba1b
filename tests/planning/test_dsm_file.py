"""A surface model that stays in its file: its parts are those of the model as a whole."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from affine import Affine
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rasterio.enums import Resampling

from planning.errors import NoElevationError, ParameterError, RasterError
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import DsmFile, open_dsm, read_dsm
from planning.terrain.rasters import decode, dsm_file
from planning.terrain.rasters.dataset import FileGrid
from planning.terrain.rasters.header import RasterLimits
from planning.terrain.rasters.heights import mask_and_scale
from planning.terrain.rasters.part_of import needed_pixels, part_of
from planning.terrain.rasters.reading import Declared, Read, all_of, read_surface
from tests.planning.geotiff_samples import HALF_METRE, write_raster

DEGREES = Affine(2e-6, 0.0, 14.99, 0.0, -1.6e-6, 37.73)
KINDS = {
    "metres": ("EPSG:32633", HALF_METRE),
    "south up": ("EPSG:32633", Affine(0.5, 0.0, 5e5, 0.0, 0.5, 4.17e6)),
    "degrees": ("EPSG:4326", DEGREES),
    "feet": ("EPSG:2994", Affine(1.0, 0.0, 7e5, 0.0, -1.0, 1e6)),
    "oblong": ("EPSG:32633", Affine(0.5, 0.0, 5e5, 0.0, -0.3, 4.17e6)),
    "nearly square": ("EPSG:32633", Affine(0.5, 0.0, 5e5, 0.0, -0.5001, 4.17e6)),
    "turned": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(23.0) @ Affine.scale(0.5, -0.5)),
    "turned and mirrored": (
        "EPSG:32633",
        Affine.translation(5e5, 4.17e6) @ Affine.rotation(-40.0) @ Affine.scale(-0.4, -0.5),
    ),
}
ROWS, COLUMNS = 90, 110


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("models")
    random = np.random.default_rng(8)
    heights = random.uniform(0.0, 30.0, (ROWS, COLUMNS)).astype(np.float32)
    heights[random.random(heights.shape) < 0.02] = -9999.0
    layouts: tuple[dict[str, Any], ...] = (
        {"tiled": True, "blockxsize": 32, "blockysize": 16, "compress": "deflate"},
        {"compress": "lzw"},
        {},
    )
    return {
        name: write_raster(
            folder / f"{name}.tif", heights, crs=crs, transform=transform, nodata=-9999.0, **layouts[number % 3]
        )
        for number, (name, (crs, transform)) in enumerate(KINDS.items())
    }


@pytest.fixture(autouse=True)
def everything_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 3)


def assert_same_part(one: Dsm, other: Dsm) -> None:
    assert one.transform == other.transform
    assert one.elevation_m.tobytes() == np.ascontiguousarray(other.elevation_m).tobytes()
    assert (one.crs, one.vertical_datum) == (other.crs, other.vertical_datum)
    assert (one.sha256, one.name) == (other.sha256, other.name)
    assert (one.source is None) == (other.source is None)
    if one.source is not None and other.source is not None:
        assert one.source.elevation_m.tobytes() == other.source.elevation_m.tobytes()
        mine, theirs = one.source.layout, other.source.layout
        assert (mine.origin_xy_m, mine.shape) == (theirs.origin_xy_m, theirs.shape)
        assert mine.turn.tobytes() == theirs.turn.tobytes()
        for a, b in zip(mine.lattice, theirs.lattice, strict=True):
            assert np.array_equal(a, b)


@pytest.fixture(scope="module")
def reads(files: dict[str, Path]) -> dict[str, tuple[Dsm, Read]]:
    """Each model as a whole, and its numbers in metres."""
    found = {}
    for kind, path in files.items():
        read = read_surface(path, Declared(None, None, None, RasterLimits()), all_of, first=None)
        assert read.stored is not None
        mask_and_scale(read.stored, sentinels=(), scale=read.plan.height_scale, offset=read.plan.height_offset)
        found[kind] = read_dsm(path), read
    return found


@pytest.mark.parametrize("kind", list(KINDS))
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.tuples(*[st.floats(0.0, 1.0)] * 4))
def test_any_part_is_the_one_of_the_whole_model(
    reads: dict[str, tuple[Dsm, Read]], kind: str, shares: tuple[float, ...]
) -> None:
    whole, read = reads[kind]
    assert read.stored is not None
    (row0, row1), (column0, column1) = (
        sorted(min(int(share * count), count - 1) for share in pair)
        for pair, count in ((shares[:2], whole.height_px), (shares[2:], whole.width_px))
    )
    part = slice(row0, row1 + 1), slice(column0, column1 + 1)
    pixels = needed_pixels(read.plan, part)
    cut = read.stored[pixels.row0 : pixels.row0 + pixels.rows, pixels.column0 : pixels.column0 + pixels.columns]
    made = part_of(read.plan, cut.copy(), pixels, part, sha256=read.sha256, name=whole.name)
    assert_same_part(made, whole.window(row0, column0, row1 + 1 - row0, column1 + 1 - column0))


@pytest.mark.parametrize("kind", ["south up", "degrees", "turned and mirrored"])
def test_parts_come_from_the_file_as_from_the_whole_model(files: dict[str, Path], kind: str) -> None:
    whole, parts = read_dsm(files[kind]), open_dsm(files[kind])
    assert (parts.height_px, parts.width_px) == whole.elevation_m.shape
    assert parts.bounds_m == whole.bounds_m
    for asked in ((40, 50, 30, 20), (42, 52, 10, 10), (-20, whole.width_px - 30, 60, 90)):
        assert_same_part(parts.window(*asked), whole.window(*asked))
    assert parts.report is None
    xy_m = np.array([whole.transform @ place for place in ((51.3, 43.6), (60.5, 47.2), (-500.0, 3.0))])
    np.testing.assert_array_equal(parts.elevation_at(xy_m), whole.elevation_at(xy_m))


def test_only_the_blocks_of_the_part_are_decoded(files: dict[str, Path]) -> None:
    with rasterio.open(files["metres"]) as source:
        windows = decode._windows(FileGrid(source, files["metres"]), 20, 40, 30, 60)
    covered = np.zeros((ROWS, COLUMNS), dtype=int)
    for window in windows:
        covered[window.row_off : window.row_off + window.height, window.col_off : window.col_off + window.width] += 1
    assert covered[20:50, 40:100].min() == covered.max() == 1
    assert covered.sum() == 30 * 60


def test_overviews_are_never_taken(tmp_path: Path) -> None:
    """Averages lie below what stands up: a mast of one cell is in no overview at its height."""
    heights = np.full((128, 128), 100.0, dtype=np.float32)
    heights[70, 75] = 125.0
    path = write_raster(tmp_path / "model.tif", heights, tiled=True, blockxsize=32, blockysize=32)
    with rasterio.open(path, "r+") as file:
        file.build_overviews([2, 4], Resampling.average)
    model = open_dsm(path)
    part = model.around(np.array([(500_037.75, 4_169_964.75)]), 3.0)
    assert model.report is None
    assert part.elevation_m.max() == 125.0
    assert_same_part(part, read_dsm(path).around(np.array([(500_037.75, 4_169_964.75)]), 3.0))


def test_windows_outside_are_refused(files: dict[str, Path]) -> None:
    with pytest.raises(ParameterError, match="outside"):
        open_dsm(files["metres"]).window(ROWS + 1, 0, 3, 3)


def test_a_small_file_is_read_at_once(files: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 10**6)
    model = open_dsm(files["degrees"])
    assert model.report is not None
    assert model.whole() is model.whole()


def test_an_undeclared_number_for_unknown_is_judged_by_the_whole_file(tmp_path: Path) -> None:
    """In a part alone -9999 lies far below all heights; in the whole file it may be one."""
    heights = np.full((60, 60), 100.0, dtype=np.float32)
    heights[40:44, 40:44] = -9999.0
    plain = write_raster(tmp_path / "plain.tif", heights)
    parts = open_dsm(plain)
    assert np.isfinite(parts.window(0, 0, 20, 20).elevation_m).all()
    assert parts.report is None
    assert np.isnan(parts.window(38, 38, 8, 8).elevation_m).sum() == 16
    assert parts.report is not None
    heights[0, 0] = 6000.0
    deep = write_raster(tmp_path / "deep.tif", heights)
    part = open_dsm(deep).window(38, 38, 8, 8)
    assert part.elevation_m.min() == -9999.0
    assert_same_part(part, read_dsm(deep).window(38, 38, 8, 8))


def test_a_file_without_heights_is_refused(tmp_path: Path) -> None:
    nothing = write_raster(tmp_path / "nothing.tif", np.full((40, 40), -9999.0, dtype=np.float32), nodata=-9999.0)
    with pytest.raises(NoElevationError):
        open_dsm(nothing)


def test_a_wrong_unit_is_noticed_in_a_sample(tmp_path: Path) -> None:
    centimetres = write_raster(tmp_path / "cm.tif", np.full((300, 300), 15_600.0, dtype=np.float32))
    assert any("centimetres" in warning for warning in open_dsm(centimetres).warnings)


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path: Path) -> None:
    """Otherwise heights would go by the digest of others."""
    path = write_raster(tmp_path / "model.tif", np.full((40, 40), 100.0, dtype=np.float32))
    model: DsmFile = open_dsm(path)
    write_raster(path, np.full((40, 40), 90.0, dtype=np.float32))
    os.utime(path, ns=(1, 1))
    with pytest.raises(RasterError, match="changed while"):
        model.window(0, 0, 10, 10)
