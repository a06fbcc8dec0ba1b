"""Folders of tiles: the model of one merged GeoTIFF."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from rasterio.windows import Window

from planning.basics.plan_model import Poi, SurfaceParams, VehicleProfile
from planning.errors import RasterError, RasterFormatError
from planning.planner import part
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.report.exports import export_file
from planning.terrain.dsm import SurfaceModel
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.rasters import dsm_file
from planning.terrain.rasters.dataset import opened_grid
from planning.terrain.rasters.header import RasterHeader
from planning.terrain.rasters.mosaic import mosaic_of
from tests.planning.geotiff_samples import HALF_METRE, hill, write_raster
from tests.planning.tile_samples import COLUMNS, KINDS, ROWS, Cuts, cut, heights_of, vrt


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from(list(KINDS)),
    st.tuples(
        st.lists(st.integers(1, ROWS - 1), max_size=3),
        st.lists(st.integers(1, COLUMNS - 1), max_size=3),
        st.integers(0, 7),
    ),
    st.tuples(st.integers(0, ROWS - 1), st.integers(0, COLUMNS - 1), st.integers(1, ROWS), st.integers(1, COLUMNS)),
)
def test_tiles_that_are_cut_anyhow_hold_the_numbers_of_one_file(
    kind: str, cuts: Cuts, box: tuple[int, int, int, int]
) -> None:
    heights = heights_of()
    with tempfile.TemporaryDirectory() as name:
        tiles = cut(Path(name, "tiles"), heights, kind, cuts, tiled=True, blockxsize=16, blockysize=32)
        found = sorted(tiles.iterdir())
        order = [*found[1::2], *found[::2]]
        job = {"tiles": [{"name": path.name, "source": str(path), "driver": "GTiff"} for path in order]}
        row, column, rows, columns = box
        rows, columns = min(rows, ROWS - row), min(columns, COLUMNS - column)
        with opened_grid(job) as grid:
            header = grid.header
            part = grid.heights(Window(column, row, columns, rows))  # pyright: ignore[reportCallIssue]
    assert (header.height_px, header.width_px) == (ROWS, COLUMNS)
    assert header.transform == pytest.approx(tuple(KINDS[kind][1])[:6], rel=1e-14, abs=1e-9)
    meant = heights[row : row + rows, column : column + columns]
    np.testing.assert_array_equal(part, np.where(meant == -9999.0, np.nan, meant))


@pytest.mark.parametrize("kind", ["metres", "degrees"])
def test_tiles_make_the_model_of_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    heights, (crs, transform) = heights_of(), KINDS[kind]
    merged = read_dsm(write_raster(tmp_path / "merged.tif", heights, crs=crs, transform=transform, nodata=-9999.0))
    tiles = cut(tmp_path / "tiles", heights, kind, ([20, 50], [33, 90], 2))
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 2)
    parts = open_dsm(tiles)
    assert parts.bounds_m == pytest.approx(merged.bounds_m, abs=1e-6)
    for one, other in ((parts.window(11, 17, 40, 60), merged.window(11, 17, 40, 60)), (parts.whole(), merged)):
        np.testing.assert_array_equal(one.elevation_m, other.elevation_m)
        assert (one.source is None) == (other.source is None)
        if one.source is not None and other.source is not None:
            np.testing.assert_array_equal(one.source.elevation_m, other.source.elevation_m)


def test_a_plan_over_tiles_is_the_one_over_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(part, "LARGE_PX", 1000)
    monkeypatch.setattr(dsm_file, "LARGE_PX", 1000)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 16)
    y, x = np.mgrid[:500, :600] * 0.5
    heights = (100 + 5 * np.sin(x / 40) + 4 * np.cos(y / 31)).astype(np.float32)
    heights[200:206, 300:304] += 12.0
    merged = write_raster(tmp_path / "zz-one.tif", heights, nodata=-9999.0)
    tiles = cut(tmp_path / "zz-tiles", heights, "metres", ([130, 203], [302, 450], 3))
    listed = vrt(tmp_path / "zz-list.vrt", [path.relative_to(tmp_path).as_posix() for path in sorted(tiles.iterdir())])
    files = []
    for model in (open_dsm(merged), open_dsm(tiles), open_dsm(listed, virtual=True)):
        plan = plan_mission(model, request(model))
        assert plan.certificate.certified
        written = [export_file(name, plan, model, title="t", created_utc="", seconds={}) for name in NAMES]
        files.append([text.replace(model.sha256, "SHA").replace(model.name, "NAME") for text in written])
    assert files[0] == files[1] == files[2]


NAMES = ("mission.waypoints", "trajectory.csv", "certificate.json")


def request(model: SurfaceModel) -> PlanRequest:
    west, south, _, _ = model.bounds_m
    places = model.lat_lon_from_xy(np.array([(west + 100, south + 90), (west + 190, south + 170)]))
    profile = VehicleProfile("test", position_error_m=0.1, rtl_height_m=60.0)
    return PlanRequest(
        pois=tuple(Poi(lat, lon) for lat, lon in places.tolist()),
        profile=profile,
        surface=SurfaceParams(radius_m=5.0),
    )


def test_where_tiles_overlap_the_highest_counts(tmp_path: Path) -> None:
    low, high = np.full((20, 20), 50.0, np.float32), np.full((20, 20), 50.0, np.float32)
    low[5, 15], high[8, 2], high[9, 3] = 80.0, 90.0, -9999.0
    write_raster(tmp_path / "a.tif", low, nodata=-9999.0)
    write_raster(tmp_path / "b.tif", high, nodata=-9999.0, transform=HALF_METRE @ Affine.translation(12, 0))
    dsm = read_dsm(tmp_path)
    assert (dsm.elevation_m[5, 15], dsm.elevation_m[8, 14], dsm.elevation_m[9, 15]) == (80.0, 90.0, 50.0)


def test_between_tiles_nothing_is_known(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill(20, 20))
    write_raster(tmp_path / "b.TIFF", hill(20, 20), transform=HALF_METRE @ Affine.translation(30, 10))
    dsm = read_dsm(tmp_path)
    assert dsm.elevation_m.shape == (30, 50)
    assert np.isnan(dsm.elevation_m[:, 20:30]).all()
    assert np.isfinite(dsm.elevation_m).sum() == 800


def test_the_digest_is_of_the_tiles_whatever_they_are_called(tmp_path: Path) -> None:
    tiles = cut(tmp_path / "one", heights_of(), "metres", ([40], [50], 0))
    other = tmp_path / "two" / "deep"
    other.mkdir(parents=True)
    for number, tile in enumerate(sorted(tiles.iterdir(), reverse=True)):
        shutil.copy(tile, other / f"{number}.tif")
    assert read_dsm(tiles).sha256 == read_dsm(tmp_path / "two").sha256
    write_raster(tiles / "0_0.tif", heights_of()[:40, :50] + 1, nodata=-9999.0)
    assert read_dsm(tiles).sha256 != read_dsm(tmp_path / "two").sha256


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"transform": Affine(0.4, 0, 5e5, 0, -0.4, 4.17e6)}, "other cells"),
        ({"transform": HALF_METRE @ Affine.translation(10.3, 0)}, "between the cells"),
        ({"transform": HALF_METRE @ Affine.rotation(5)}, "turned"),
        ({"crs": "EPSG:32634"}, "reference system"),
        ({"unit": "ft"}, "unit of height"),
        ({"scale": (0.1, 0.0)}, "scale or offset"),
        ({"tags": {"HEDGEHOP_VERTICAL_DATUM": "ellipsoid"}}, "vertical datum"),
    ],
)
def test_a_tile_that_does_not_fit_is_named(tmp_path: Path, change: dict[str, Any], match: str) -> None:
    write_raster(tmp_path / "a.tif", hill())
    write_raster(tmp_path / "b.tif", hill(), **change)
    job = {"tiles": [{"name": n, "source": str(tmp_path / n), "driver": "GTiff"} for n in ("a.tif", "b.tif")]}
    with pytest.raises(RasterFormatError, match=rf"b\.tif has .*{match}"), opened_grid(job):
        pass


def test_a_picture_among_the_tiles_is_named(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill())
    write_raster(tmp_path / "photo.tif", np.zeros((3, 40, 50), np.uint8), photometric="RGB")
    with pytest.raises(RasterFormatError, match="orthomosaic"):
        read_dsm(tmp_path)


def test_a_broken_tile_is_an_error(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill())
    (tmp_path / "b.tif").write_bytes((tmp_path / "a.tif").read_bytes()[:300])
    with pytest.raises(RasterError):
        read_dsm(tmp_path)


def test_a_folder_without_tiles_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("none")
    with pytest.raises(RasterFormatError, match="no GeoTIFF"):
        read_dsm(tmp_path)


def test_the_origin_of_a_mosaic_is_the_tiles_own(tmp_path: Path) -> None:
    del tmp_path
    base = {
        "driver": "GTiff", "dtypes": ("float32",), "colours": ("gray",), "crs_wkt": None, "has_gcps": False,
        "block_bytes": 4, "unit": None, "scale": 1.0, "offset": 0.0, "vertical_datum": None,
    }  # fmt: skip
    east = RasterHeader(**base, width_px=3, height_px=2, transform=(0.1, 0, 5.3, 0, -0.1, 9.0))
    west = RasterHeader(**base, width_px=3, height_px=4, transform=(0.1, 0, 5.0, 0, -0.1, 8.9))
    mosaic = mosaic_of([("east", east), ("west", west)])
    assert mosaic.header.transform == (0.1, 0, 5.0, 0, -0.1, 9.0)
    assert (mosaic.header.height_px, mosaic.header.width_px) == (5, 6)
    assert [(spot.row0, spot.column0) for spot in mosaic.spots] == [(0, 3), (1, 0)]
