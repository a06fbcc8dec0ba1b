"""Folders of tiles and virtual rasters: the model of one merged GeoTIFF, and nothing that a file names outside."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
import rasterio.errors
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
from planning.terrain.geotiff import open_dsm, read_dsm, read_dsm_reported
from planning.terrain.rasters import dataset, dsm_file, reading
from planning.terrain.rasters.dataset import opened_grid
from planning.terrain.rasters.header import RasterHeader, RasterLimits
from planning.terrain.rasters.http_ranges import REQUEST_S
from planning.terrain.rasters.mosaic import mosaic_of
from planning.terrain.rasters.reading import Declared, Pixels, all_of, read_surface
from tests.planning.geotiff_samples import HALF_METRE, hill, write_raster

ROWS, COLUMNS = 96, 120
KINDS: dict[str, tuple[str, Affine]] = {
    "metres": ("EPSG:32633", HALF_METRE),
    "south up": ("EPSG:32633", Affine(0.5, 0.0, 5e5, 0.0, 0.5, 4.17e6)),
    "degrees": ("EPSG:4326", Affine(2e-6, 0.0, 14.99, 0.0, -1.6e-6, 37.73)),
    "feet": ("EPSG:2994", Affine(1.0, 0.0, 7e5, 0.0, -1.0, 1e6)),
}
Cuts = tuple[list[int], list[int], int]
"""Rows and columns to cut at, and by how much tiles overlap."""


def heights_of(seed: int = 3) -> np.ndarray:
    random = np.random.default_rng(seed)
    heights = random.uniform(0.0, 30.0, (ROWS, COLUMNS)).astype(np.float32)
    heights[random.random(heights.shape) < 0.02] = -9999.0
    return heights


def cut(folder: Path, heights: np.ndarray, kind: str, cuts: Cuts, **profile: Any) -> Path:
    """A folder of tiles, each a little larger than its share."""
    folder.mkdir(parents=True)
    crs, transform = KINDS[kind]
    rows, columns, over = sorted({0, *cuts[0]}), sorted({0, *cuts[1]}), cuts[2]
    for row, row_end in zip(rows, [*rows[1:], heights.shape[0]], strict=True):
        for column, column_end in zip(columns, [*columns[1:], heights.shape[1]], strict=True):
            tile = heights[row : row_end + over, column : column_end + over]
            at = transform @ Affine.translation(column, row)
            path = folder / f"{row}_{column}.tif"
            write_raster(path, tile, crs=crs, transform=at, nodata=-9999.0, **profile)
    return folder


def vrt(
    path: Path,
    named: list[str],
    *,
    source: str = "SimpleSource",
    more: str = "",
    band: str = "",
    dataset: str = "",
    attributes: str = "",
    changed: dict[str, str] | None = None,
    relative: int = 1,
) -> Path:
    """A list of tiles as gdalbuildvrt writes it; ``changed`` are parts of its text that are put otherwise."""
    headers = [h for h in (_header(path.parent / name) for name in named) if h is not None]
    first = headers[0] if headers else {"transform": HALF_METRE, "width": 9, "height": 9, "dtype": "float32"}
    places = [~first["transform"] @ h["transform"] for h in headers]
    left, top = min([0.0, *(at.c for at in places)]), min([0.0, *(at.f for at in places)])
    width = max([9.0, *(at.c - left + h["width"] for at, h in zip(places, headers, strict=True))])
    height = max([9.0, *(at.f - top + h["height"] for at, h in zip(places, headers, strict=True))])
    origin = first["transform"] @ Affine.translation(round(left), round(top))
    sources = []
    for name in named:
        header = _header(path.parent / name) or first
        at = ~origin @ header["transform"]
        size = f'xSize="{header["width"]}" ySize="{header["height"]}"'
        sources.append(
            f'<{source}><SourceFilename relativeToVRT="{relative}">{name}</SourceFilename>'
            f'<SourceBand>1</SourceBand><SrcRect xOff="0" yOff="0" {size} />'
            f'<DstRect xOff="{round(at.c)}" yOff="{round(at.f)}" {size} />{more}</{source}>'
        )
    numbers = ", ".join(repr(value) for value in origin.to_gdal())
    dtype = {"float32": "Float32", "int16": "Int16", "uint8": "Byte"}[first["dtype"]]
    text = (
        f'<VRTDataset rasterXSize="{round(width)}" rasterYSize="{round(height)}"{attributes}>'
        f"<GeoTransform>{numbers}</GeoTransform>{dataset}"
        f'<VRTRasterBand dataType="{dtype}" band="1">{band}{"".join(sources)}</VRTRasterBand></VRTDataset>'
    )
    for old, new in (changed or {}).items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def _header(tile: Path) -> Any:
    try:
        with rasterio.open(tile) as source:
            return source.profile
    except (rasterio.errors.RasterioIOError, ValueError):
        return None


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


@pytest.mark.parametrize(
    ("named", "match"),
    [
        ("../secret.tif", "outside its folder"),
        ("/etc/passwd", "outside its folder"),
        ("link.tif", "outside its folder"),
        ("/vsicurl/http://127.0.0.1/x.tif", "no file of its folder"),
        ("http://127.0.0.1/x.tif", "no file of its folder"),
        ("GTIFF_DIR:1:http://127.0.0.1/x.tif", "no file of its folder"),
        ("missing.tif", "no such file"),
    ],
)
def test_a_virtual_raster_reaches_nothing_but_its_folder(tmp_path: Path, named: str, match: str) -> None:
    folder = tmp_path / "here"
    folder.mkdir()
    write_raster(tmp_path / "secret.tif", hill())
    (folder / "link.tif").symlink_to(tmp_path / "secret.tif")
    with pytest.raises(RasterError, match=match):
        read_dsm(vrt(folder / "x.vrt", [named]), virtual=True)


@pytest.mark.parametrize(
    "how",
    [
        {"source": "ComplexSource", "more": "<ScaleRatio>0.5</ScaleRatio>"},
        {"source": "ComplexSource", "more": "<ScaleOffset>5</ScaleOffset>"},
        {"source": "ComplexSource", "more": "<LUT>0:5,9:7</LUT>"},
        {"source": "ComplexSource", "more": "<UseMaskBand>true</UseMaskBand>"},
        {"more": '<OpenOptions><OOI key="OVERVIEW_LEVEL">0</OOI></OpenOptions>'},
        {"source": "AveragedSource"},
        {"band": "<Scale>2</Scale><Offset>30</Offset>"},
        {"band": "<Offset>30</Offset>"},
        {"band": "<Scale>nonsense</Scale>"},
        {"band": "<scale>2</scale>"},
        {"band": "<UnitType>ft</UnitType>"},
        {"band": "<HideNoDataValue>1</HideNoDataValue>"},
        {"band": "<NoDataValue>none</NoDataValue>"},
        {"band": "<ColorTable/>"},
        {"band": "<MaskBand/>"},
        {"dataset": "<MaskBand/>"},
        {"dataset": "<GCPList/>"},
        {"dataset": "<SRS>EPSG:32634</SRS>"},
        {"dataset": "<SRS>EPSG:32633+5773</SRS>"},
        {"dataset": "<SRS>nowhere</SRS>"},
        {"dataset": '<Metadata><MDI key="HEDGEHOP_VERTICAL_DATUM">ellipsoid</MDI></Metadata>'},
        {"attributes": ' subClass="VRTWarpedDataset"'},
        {"attributes": ' strange="1"'},
        {"changed": {'dataType="Float32"': 'dataType="Byte"'}},
        {"changed": {' dataType="Float32"': ""}},
        {"changed": {'<SrcRect xOff="0"': '<SrcRect xOff="5"'}},
        {"changed": {'xSize="50"': 'xSize="40"'}},
        {"changed": {'<DstRect xOff="0"': '<DstRect xOff="2"'}},
        {"changed": {'<DstRect xOff="0" yOff="0" xSize="50"': '<DstRect xOff="0" yOff="0" xSize="25"'}},
        {"changed": {'rasterXSize="50"': 'rasterXSize="30"'}},
        {"changed": {"<SrcRect": "<Nothing"}},
        {"changed": {"500000.0, 0.5": "500001.0, 0.5"}},
        {"changed": {"500000.0, 0.5": "500000.0, 0.51"}},
        {"changed": {"<GeoTransform>": "<GeoTransform>1,"}},
        {"changed": {"<SourceBand>1": "<SourceBand>mask,1"}},
    ],
)
def test_a_virtual_raster_that_says_more_than_its_tiles_is_refused(tmp_path: Path, how: dict[str, Any]) -> None:
    write_raster(tmp_path / "a.tif", hill())
    with pytest.raises(RasterFormatError, match="more than a list of tiles"):
        read_dsm(vrt(tmp_path / "x.vrt", ["a.tif"], **how), virtual=True)


def test_a_hostile_virtual_raster_is_refused(tmp_path: Path) -> None:
    bomb = '<!DOCTYPE a [<!ENTITY b "c">]><VRTDataset>&b;</VRTDataset>'
    (tmp_path / "bomb.vrt").write_text(f'<?xml version="1.0"?>{bomb}')
    with pytest.raises(RasterFormatError, match="cannot be read"):
        read_dsm(tmp_path / "bomb.vrt", virtual=True)


def test_what_a_virtual_raster_says_as_its_tiles_do_is_let_pass(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill(), unit="m", scale=(0.5, 3.0), nodata=-9999.0)
    listed = vrt(
        tmp_path / "x.vrt",
        ["a.tif"],
        dataset='<SRS dataAxisToSRSAxisMapping="1,2">EPSG:32633</SRS><OverviewList>2</OverviewList>',
        band="<Scale>0.5</Scale><Offset>3</Offset><UnitType>m</UnitType><NoDataValue>-9999</NoDataValue>"
        "<ColorInterp>Gray</ColorInterp>",
        source="ComplexSource",
        more="<NODATA>-9999</NODATA>",
    )
    as_list, as_folder = read_dsm(listed, virtual=True), read_dsm(tmp_path)
    np.testing.assert_array_equal(as_list.elevation_m, as_folder.elevation_m)
    assert as_list.sha256 == as_folder.sha256


VALUES = (0.0, -9999.0, 7.0, 120.5)


@settings(max_examples=12, deadline=None)
@given(
    st.sampled_from(["float32", "int16"]),
    st.sampled_from([None, *VALUES[:3]]),
    st.sampled_from([None, *VALUES]),
    st.sampled_from([None, *VALUES]),
    st.integers(0, 2**32 - 1),
)
def test_what_a_virtual_raster_calls_unknown_is_unknown(
    dtype: str, own: float | None, in_band: float | None, in_source: float | None, seed: int
) -> None:
    """No cell is known that the list, or its tile, calls unknown; all others are those of one merged file."""
    heights = np.random.default_rng(seed).choice([*VALUES, 100.0, 101.0, 102.0], (30, 40)).astype(dtype)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for column in (0, 15):
            at = HALF_METRE @ Affine.translation(column, 0)
            tile = heights[:, column : column + (15 if column == 0 else 25)]
            write_raster(folder / f"{column}.tif", tile, transform=at, nodata=own)
        listed = vrt(
            folder / "x.vrt",
            ["0.tif", "15.tif"],
            band="" if in_band is None else f"<NoDataValue>{in_band}</NoDataValue>",
            source="SimpleSource" if in_source is None else "ComplexSource",
            more="" if in_source is None else f"<NODATA>{in_source}</NODATA>",
        )
        model = read_dsm(listed, virtual=True)
        others = {in_band, in_source} - {None, own}
        assert (model.sha256 == read_dsm(folder).sha256) == (not others)
    unknown = [value for value in (own, *others, -9999.0) if value is not None]
    np.testing.assert_array_equal(model.elevation_m, np.where(np.isin(heights, unknown), np.nan, heights))


def test_a_list_that_calls_other_numbers_unknown_meanwhile_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    write_raster(tmp_path / "a.tif", hill())
    listed = vrt(tmp_path / "x.vrt", ["a.tif"])
    model = open_dsm(listed, virtual=True)
    vrt(listed, ["a.tif"], band="<NoDataValue>100</NoDataValue>")
    with pytest.raises(RasterError, match="changed"):
        model.window(0, 0, 5, 5)


def test_without_being_told_so_a_virtual_raster_is_none(tmp_path: Path) -> None:
    write_raster(tmp_path / "a.tif", hill())
    listed = vrt(tmp_path / "x.vrt", ["a.tif"])
    with pytest.raises(RasterFormatError, match="VRT"):
        read_dsm(listed)
    dsm, report = read_dsm_reported(listed, virtual=True)
    np.testing.assert_array_equal(dsm.elevation_m, hill())
    assert report.warnings == ()


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
