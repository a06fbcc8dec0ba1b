"""Tiles that change while they are read, later looks into them, and the time that a look is given."""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path

import numpy as np
import pytest
import rasterio
import rasterio.errors
from affine import Affine
from rasterio.windows import Window

from planning.errors import RasterError, RasterFormatError
from planning.terrain.geotiff import open_dsm
from planning.terrain.rasters import dataset, dsm_file, reading
from planning.terrain.rasters.dataset import opened_grid
from planning.terrain.rasters.header import RasterHeader, RasterLimits
from planning.terrain.rasters.http_ranges import REQUEST_S
from planning.terrain.rasters.reading import Declared, Pixels, all_of, read_surface
from tests.planning.geotiff_samples import HALF_METRE, hill, write_raster
from tests.planning.tile_samples import cut, heights_of


def test_a_tile_that_comes_or_changes_meanwhile_is_noticed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    write_raster(tmp_path / "a.tif", hill())
    model = open_dsm(tmp_path)
    write_raster(tmp_path / "b.tif", hill(), transform=HALF_METRE @ Affine.translation(50, 0))
    with pytest.raises(RasterError, match="changed"):
        model.window(0, 0, 5, 5)


def test_a_tile_that_is_written_while_it_is_read_is_noticed(tmp_path: Path) -> None:
    """Otherwise new heights would go by the digest of the old ones."""
    tile = write_raster(tmp_path / "tile.tif", hill())
    declared = Declared(None, None, None, RasterLimits())

    def written(header: RasterHeader) -> Pixels:
        with rasterio.open(tile, "r+") as file:
            file.write(hill() + 50, 1)
        return all_of(header)

    for source in (tile, tmp_path):
        with pytest.raises(RasterError, match="changed while it was read"):
            read_surface(source, declared, written, first=None)


def test_a_tile_that_became_another_is_not_read(tmp_path: Path) -> None:
    paths = [write_raster(tmp_path / "a.tif", hill()), tmp_path / "b.tif"]
    beside = HALF_METRE @ Affine.translation(50, 0)
    write_raster(paths[1], hill(), transform=beside)
    job = {"tiles": [{"name": path.name, "source": str(path), "driver": "GTiff"} for path in paths]}
    for change in ({"transform": beside @ Affine.translation(1, 0)}, {"scale": (2.0, 0.0)}, {"crs": "EPSG:32634"}):
        write_raster(paths[1], hill(), transform=beside)
        with opened_grid(job) as grid:
            write_raster(paths[1], hill(), **{"transform": beside, **change})
            assert np.isfinite(grid.heights(Window(0, 0, 50, 40))).all()  # pyright: ignore[reportCallIssue]
            with pytest.raises(RasterFormatError, match=r"b\.tif was changed"):
                grid.heights(Window(50, 0, 50, 40))  # pyright: ignore[reportCallIssue]


def test_a_later_look_opens_only_the_tiles_that_it_needs(tmp_path: Path) -> None:
    folder = cut(tmp_path / "tiles", heights_of(), "metres", ([30, 60], [50, 90], 4))
    tiles = [{"name": path.name, "source": str(path), "driver": "GTiff"} for path in sorted(folder.iterdir())]
    box = Window(60, 35, 20, 10)  # pyright: ignore[reportCallIssue]
    with opened_grid({"tiles": tiles}) as grid:
        first, header, layout = grid.heights(box), grid.header, json.loads(json.dumps(grid.layout()))
    for path in folder.iterdir():
        if path.name != "30_50.tif":
            path.unlink()
    with opened_grid({"tiles": tiles, "layout": layout}) as grid:
        assert grid.header == header
        np.testing.assert_array_equal(grid.heights(box), first)


def test_a_sample_finds_what_little_is_known(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file.DsmFile, "_can_be_whole", False)
    for number, known in enumerate((slice(0, 0), slice(150, 166), slice(0, 0))):
        heights = np.full((200, 200), -9999.0, np.float32)
        heights[known] = 100.0
        at = HALF_METRE @ Affine.translation(90_000 * number, 80_000 * number)
        write_raster(tmp_path / f"{number}.tif", heights, transform=at, nodata=-9999.0, blockysize=16)
    assert open_dsm(tmp_path).warnings == ()


def test_a_first_look_has_time_to_read_all_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    large = tmp_path / "large"
    large.touch()
    os.truncate(large, 10**11)
    tiles, limits = {"tiles": [{"source": str(large)}] * 2}, RasterLimits()
    assert reading._with_time_for(tiles, limits, first_look=True).decode_s > limits.decode_s + 3600
    assert reading._with_time_for(tiles, limits, first_look=False).decode_s == limits.decode_s
    assert reading._with_time_for({"pipe": (0, 1)}, limits, first_look=True).header_s > 2 * REQUEST_S
    monkeypatch.setattr(dataset, "_DIGEST_BYTES", 10)
    monkeypatch.setattr(dataset, "_TOLD_BYTES", 20)
    files = [tmp_path / "a", tmp_path / "b"]
    for file in files:
        file.write_bytes(b"0" * 50)
    shares: list[float] = []
    assert dataset.digests_of(files, shares.append) == [hashlib.sha256(b"0" * 50).hexdigest()] * 2
    assert shares == [0.2, 0.4, 0.6, 0.8, 1.0]
