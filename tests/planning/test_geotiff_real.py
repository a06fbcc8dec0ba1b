"""The readers on recorded surface models and on files that have gone wrong elsewhere."""

from pathlib import Path

import numpy as np
import pytest
import rasterio
from pyproj import CRS

from planning.errors import MissingCrsError, NoElevationError, RasterError, RasterFormatError
from planning.terrain.geotiff import read_dsm, read_dsm_reported, read_orthophoto
from tests.planning.geotiff_samples import write_raster

AS_THEY_ARE = [
    # file, rows, columns, cell in m, EPSG, unknown share, lowest, highest
    ("brighton/brighton_dsm_010.tif", 977, 1064, 0.1, 32615, 0.6324841658906735, 156.13, 168.92),
    ("brighton/brighton_dsm_020.tif", 489, 533, 0.2, 32615, 0.6244815586428635, 156.13, 168.92),
    ("coromandel/coromandel_dsm_050.tif", 252, 290, 0.5, 2193, 0.0019978106185002736, 766.175, 849.053),
    ("campus/dsm.tif", 175, 223, 1.0, 8353, 0.026521460602178092, 987.2667, 1026.1981),
    ("rolling_terrain/dem.tif", 400, 400, 1.0, 26915, 0.0, 379.65933, 410.75867),
    ("crop_rows/dsm.tif", 640, 957, 0.009791382, 32616, 0.0, 187.98137, 188.31497),
]


@pytest.mark.parametrize(("name", "rows", "columns", "cell_m", "epsg", "unknown", "low", "high"), AS_THEY_ARE)
def test_projected_metres_stay_as_they_are(
    shared_data: Path,
    name: str,
    rows: int,
    columns: int,
    cell_m: float,
    epsg: int,
    unknown: float,
    low: float,
    high: float,
) -> None:
    path = shared_data / "dsm" / name
    dsm, report = read_dsm_reported(path)
    assert dsm.elevation_m.shape == (rows, columns)
    assert dsm.resolution_m == pytest.approx(cell_m, rel=1e-6)
    assert dsm.crs.to_epsg() == epsg
    assert float(np.nanmin(dsm.elevation_m)) == np.float32(low)
    assert float(np.nanmax(dsm.elevation_m)) == np.float32(high)
    assert np.isnan(dsm.elevation_m).mean() == pytest.approx(unknown)
    assert dsm.vertical_datum is None
    assert dsm.source is None
    assert report.warnings == ()
    with rasterio.open(path) as source:
        stored = source.read(1, masked=True).filled(np.nan)
        assert dsm.transform.c == source.transform.c
        assert dsm.transform.f == source.transform.f
    np.testing.assert_array_equal(dsm.elevation_m, stored)


def test_digest_is_that_of_the_file(shared_data: Path) -> None:
    dsm = read_dsm(shared_data / "dsm/crop_rows/dsm.tif")
    assert dsm.sha256 == "869bc451e2cccb593ae0ce50b1424233d2f3cf494fa95f0b779d07cefcaa95ed"


def test_a_grid_in_feet_is_measured_in_metres_and_keeps_its_cells(shared_data: Path) -> None:
    path = shared_data / "dsm/autzen_feet/autzen_dsm_5ft.tif"
    dsm, report = read_dsm_reported(path)
    assert dsm.crs.to_epsg() == 2993  # the same projection, its axes in metres
    assert dsm.resolution_m == pytest.approx(5 * 0.3048, rel=1e-9)
    assert dsm.source is None
    with rasterio.open(path) as source:
        stored = source.read(1, masked=True).filled(np.nan)
        assert (dsm.transform.c, dsm.transform.f) == pytest.approx(
            (source.transform.c * 0.3048, source.transform.f * 0.3048), abs=1e-6
        )
    np.testing.assert_allclose(dsm.elevation_m, stored * 0.3048, rtol=1e-6)
    assert report.height_scale == pytest.approx(0.3048)
    assert float(np.nanmax(dsm.elevation_m)) == pytest.approx(520.51 * 0.3048, abs=1e-4)
    assert float(np.nanmin(dsm.elevation_m)) >= 406.56 * 0.3048 - 1e-4
    assert any("taken as foot" in warning for warning in report.warnings)
    center = dsm.lat_lon_from_xy(np.array([np.mean(np.reshape(dsm.bounds_m, (2, 2)), axis=0)]))[0]
    assert center == pytest.approx([44.05, -123.07], abs=0.01)


def test_feet_grid_with_declared_metre_heights(shared_data: Path) -> None:
    dsm, report = read_dsm_reported(shared_data / "dsm/autzen_feet/autzen_dsm_5ft.tif", z_scale=1.0)
    assert float(np.nanmax(dsm.elevation_m)) == np.float32(520.51)
    assert not any("converted" in warning for warning in report.warnings)


def test_integer_centimetres_are_doubted_then_scaled(shared_data: Path) -> None:
    path = shared_data / "dsm/uint16_centimetres/small_dem_3m_merged.tif"
    raw, doubted = read_dsm_reported(path)
    assert raw.elevation_m.shape == (245, 574)
    assert np.isnan(raw.elevation_m).mean() == pytest.approx(0.3706108227263031)
    assert any("centimetres" in warning and "--z-scale 0.01" in warning for warning in doubted.warnings)
    metres, report = read_dsm_reported(path, z_scale=0.01)
    assert (float(np.nanmin(metres.elevation_m)), float(np.nanmax(metres.elevation_m))) == pytest.approx(
        (293.32, 310.0)
    )
    assert report.warnings == ()


@pytest.mark.parametrize("name", ["pre_runout_DEM.asc", "DEM_of_Difference.asc", "landslide_depth.asc"])
def test_ascii_grid_needs_a_declared_crs(shared_data: Path, name: str) -> None:
    path = shared_data / "dsm/landslide" / name
    with pytest.raises(MissingCrsError, match="--crs"):
        read_dsm(path)
    dsm = read_dsm(path, crs="EPSG:32610", vertical_datum="NAVD88 height")
    assert dsm.elevation_m.shape == (122, 80)
    assert dsm.resolution_m == 10.0
    assert dsm.crs.to_epsg() == 32610
    assert dsm.vertical_datum == "NAVD88 height"


def test_ascii_grid_heights(shared_data: Path) -> None:
    dsm = read_dsm(shared_data / "dsm/landslide/pre_runout_DEM.asc", crs="EPSG:32610")
    assert float(np.nanmin(dsm.elevation_m)) == pytest.approx(189.0281, abs=1e-4)
    assert float(np.nanmax(dsm.elevation_m)) == pytest.approx(582.3846, abs=1e-4)
    assert np.isnan(dsm.elevation_m).mean() == pytest.approx(0.0125)


@pytest.mark.parametrize(
    ("name", "error", "text"),
    [
        ("all-nodata.tif", RasterFormatError, "4 bands"),
        ("cogeo.tif", RasterFormatError, "orthomosaic or photo"),
        ("corrupt.tif", RasterFormatError, "orthomosaic or photo"),
        ("RGB.byte.gcp.vrt", RasterFormatError, "virtual raster"),
        ("rotated.tif", MissingCrsError, "--crs"),
        ("float32.tif", MissingCrsError, "--crs"),
        ("float_nan.tif", MissingCrsError, "--crs"),
        ("LICENSE.txt", RasterFormatError, "not a GeoTIFF"),
    ],
)
def test_odd_files_are_refused_with_the_reason(
    shared_data: Path, name: str, error: type[RasterError], text: str
) -> None:
    with pytest.raises(error, match=text):
        read_dsm(shared_data / "odd_rasters" / name)


def test_every_cell_unknown(shared_data: Path, tmp_path: Path) -> None:
    with rasterio.open(shared_data / "odd_rasters/all-nodata.tif") as source:
        band, transform = source.read(1), source.transform
    path = write_raster(tmp_path / "x.tif", band, crs="EPSG:32628", transform=transform, nodata=0)
    with pytest.raises(NoElevationError, match="Every cell is unknown"):
        read_dsm(path)


def test_south_up_rows_are_turned(shared_data: Path) -> None:
    dsm = read_dsm(shared_data / "odd_rasters/float_nan.tif", crs="EPSG:32633")
    with rasterio.open(shared_data / "odd_rasters/float_nan.tif") as source:
        stored = source.read(1)
        x, y = source.transform @ (0.5, 0.5)
    np.testing.assert_array_equal(dsm.elevation_m, stored[::-1])
    assert dsm.elevation_at(np.array([[x, y]]))[0] == stored[0, 0]


def test_rotated_pixels_become_squares_and_keep_their_maximum(shared_data: Path) -> None:
    dsm, report = read_dsm_reported(shared_data / "odd_rasters/rotated.tif", crs="EPSG:32633")
    assert dsm.source is not None
    assert dsm.crs.to_epsg() == 32633
    assert float(np.nanmax(dsm.elevation_m)) == 149.0
    assert any("8-bit" in warning for warning in report.warnings)


def test_custom_wkt_and_bytes_are_read(shared_data: Path) -> None:
    albers = read_dsm(shared_data / "odd_rasters/test_esri_wkt.tif")
    assert sorted(albers.elevation_m.ravel().tolist()) == [1.0, 2.0, 3.0, 4.0]
    grey, report = read_dsm_reported(shared_data / "odd_rasters/byte.tif")
    assert grey.crs.to_epsg() == 26711
    assert any("8-bit" in warning for warning in report.warnings)


def test_real_orthophoto_and_its_corrupt_copy(shared_data: Path) -> None:
    with rasterio.open(shared_data / "odd_rasters/cogeo.tif") as source:
        bounds, crs = tuple(source.bounds), source.crs
    picture = read_orthophoto(
        shared_data / "odd_rasters/cogeo.tif", bounds_m=bounds, crs=CRS.from_wkt(crs.to_wkt()), max_px=256
    )
    assert picture.rgb.shape == (256, 256, 3)
    assert picture.known.any()
    with pytest.raises(RasterFormatError, match="corrupt"):
        read_orthophoto(shared_data / "odd_rasters/corrupt.tif", bounds_m=bounds, crs=CRS.from_wkt(crs.to_wkt()))


@pytest.mark.parametrize("share", [0.0, 0.001, 0.02, 0.5, 0.9])
@pytest.mark.parametrize(
    "name", ["campus/dsm.tif", "coromandel/coromandel_dsm_050.tif", "landslide/pre_runout_DEM.asc"]
)
def test_truncated_files_are_refused(shared_data: Path, tmp_path: Path, name: str, share: float) -> None:
    whole = (shared_data / "dsm" / name).read_bytes()
    path = tmp_path / "cut.tif"
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(RasterFormatError, match="corrupt, cut short" if share > 0.01 else None):
        read_dsm(path, crs="EPSG:32633")
