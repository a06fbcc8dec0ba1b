"""Reading and writing surface models: units, datums, unknown cells, georeference."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.errors import (
    MissingCrsError,
    NoElevationError,
    ParameterError,
    RasterError,
    RasterFormatError,
    RasterTooLargeError,
)
from planning.ground.demo_hillside import demo_dsm
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import RasterLimits, read_dsm, read_dsm_reported, write_dsm
from tests.planning.geotiff_samples import HALF_METRE, UTM, hill, write_raster


def test_heights_grid_and_digest(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill())
    stages: list[tuple[str, float]] = []
    dsm, _ = read_dsm_reported(path, progress=lambda stage, share: stages.append((stage, share)))
    np.testing.assert_array_equal(dsm.elevation_m, hill())
    assert dsm.transform == HALF_METRE
    assert dsm.crs == CRS.from_user_input(UTM)
    assert dsm.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert not dsm.elevation_m.flags.writeable
    assert ("decode", 1.0) in stages
    assert stages[-1] == ("spikes", 1.0)


@pytest.mark.parametrize("tile", [(2048, 2048), (4096, 256), (256, 4096)])
def test_tall_and_wide_tiles_are_read_in_parts(tmp_path: Path, tile: tuple[int, int]) -> None:
    heights = np.arange(2100 * 4300, dtype=np.float32).reshape(2100, 4300) % 1000
    layout = {"tiled": True, "blockysize": tile[0], "blockxsize": tile[1], "compress": "deflate", "zlevel": 1}
    dsm = read_dsm(write_raster(tmp_path / "x.tif", heights, **layout))
    np.testing.assert_array_equal(dsm.elevation_m, heights)


def test_unknown_cells_are_masked_and_undeclared_ones_named(tmp_path: Path) -> None:
    heights = hill()
    heights[0, :4] = np.nan, np.inf, -np.inf, -3.4028235e38
    heights[1, :3] = -9999.0, -32767.0, -9999.0
    dsm, report = read_dsm_reported(write_raster(tmp_path / "x.tif", heights))
    expected = hill()
    expected[0, :4] = expected[1, :3] = np.nan
    np.testing.assert_array_equal(dsm.elevation_m, expected)
    assert "2 cells of -9999" in " ".join(report.warnings)
    assert "3 cells with infinite or absurd" in " ".join(report.warnings)


def test_a_sentinel_near_other_heights_stays(tmp_path: Path) -> None:
    trench = np.full((8, 8), -10500.0, dtype=np.float32)
    trench[2, 2] = -9999.0
    dsm = read_dsm(write_raster(tmp_path / "x.tif", trench))
    assert dsm.elevation_m[2, 2] == -9999.0


def test_only_undeclared_nodata_is_no_elevation(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", np.full((8, 8), -9999.0, dtype=np.float32))
    with pytest.raises(NoElevationError):
        read_dsm(path)


def test_alpha_band_masks(tmp_path: Path) -> None:
    heights = np.stack([hill(), np.full(hill().shape, 255.0, dtype=np.float32)])
    heights[1, 3, 3] = 0.0
    dsm = read_dsm(write_raster(tmp_path / "x.tif", heights, ALPHA="YES"))
    assert np.isnan(dsm.elevation_m[3, 3])
    assert np.count_nonzero(np.isnan(dsm.elevation_m)) == 1


@pytest.mark.parametrize(
    ("crs", "unit", "factor"),
    [
        ("EPSG:32633", None, 1.0),
        ("EPSG:32633", "ft", 0.3048),
        ("EPSG:32633+5773", None, 1.0),
        ("EPSG:26910+6360", None, 1200 / 3937),
        ("EPSG:26910+8228", None, 0.3048),
    ],
)
def test_height_units(tmp_path: Path, crs: str, unit: str | None, factor: float) -> None:
    dsm, report = read_dsm_reported(write_raster(tmp_path / "x.tif", hill(), crs=crs, unit=unit))
    assert report.height_scale == pytest.approx(factor)
    np.testing.assert_allclose(dsm.elevation_m, hill() * factor, rtol=1e-6)
    assert bool(report.warnings) == (factor != 1.0)


def test_band_scale_is_applied_and_z_scale_overrides_it(tmp_path: Path) -> None:
    stored = (hill() * 100).astype(np.int16)
    path = write_raster(tmp_path / "x.tif", stored, scale=(0.01, 5.0))
    applied, report = read_dsm_reported(path)
    np.testing.assert_allclose(applied.elevation_m, stored * 0.01 + 5.0, rtol=1e-5)
    assert any("stored * 0.01 + 5" in warning for warning in report.warnings)
    np.testing.assert_allclose(read_dsm(path, z_scale=0.1).elevation_m, stored * 0.1, rtol=1e-5)


@pytest.mark.parametrize("z_scale", [0.0, -1.0, float("nan"), float("inf")])
def test_impossible_z_scale(tmp_path: Path, z_scale: float) -> None:
    with pytest.raises(ParameterError, match="greater than 0"):
        read_dsm(tmp_path / "x.tif", z_scale=z_scale)


@pytest.mark.parametrize(
    ("crs", "declared", "datum"),
    [
        ("EPSG:32633", None, None),
        ("EPSG:32633+5773", None, "EGM96 height"),
        ("EPSG:32633+3855", None, "EGM2008 height"),
        ("EPSG:32633", "ellipsoid", "ellipsoid"),
        ("EPSG:32633+5773", "EGM2008 height", "EGM2008 height"),
        ("EPSG:26910+6360", None, "NAVD88 height"),
    ],
)
def test_vertical_datum(tmp_path: Path, crs: str, declared: str | None, datum: str | None) -> None:
    dsm, report = read_dsm_reported(write_raster(tmp_path / "x.tif", hill(), crs=crs), vertical_datum=declared)
    assert dsm.vertical_datum == report.vertical_datum == datum
    assert not dsm.crs.is_compound
    assert any("vertical datum" in warning for warning in report.warnings) == ("+5773" in crs and declared is not None)


def test_declared_horizontal_system_keeps_the_datum_of_the_file(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), crs="EPSG:32633+5773")
    assert read_dsm(path, crs="EPSG:32633").vertical_datum == "EGM96 height"


def test_declared_system_wins_and_is_reported(tmp_path: Path) -> None:
    dsm, report = read_dsm_reported(write_raster(tmp_path / "x.tif", hill()), crs="EPSG:32632")
    assert dsm.crs.to_epsg() == 32632
    assert any("declared" in warning for warning in report.warnings)


def test_missing_wrong_and_impossible_systems(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), crs=None)
    with pytest.raises(MissingCrsError, match=r"x\.tif.*--crs"):
        read_dsm(path)
    with pytest.raises(MissingCrsError, match="no known"):
        read_dsm(path, crs="EPSG:99999999")
    with pytest.raises(RasterFormatError, match="outside WGS 84"):
        read_dsm(path, crs="EPSG:4326")


@pytest.mark.filterwarnings("ignore::rasterio.errors.NotGeoreferencedWarning")
def test_ungeoreferenced_and_control_points_only(tmp_path: Path) -> None:
    from rasterio.control import GroundControlPoint

    plain = write_raster(tmp_path / "plain.tif", hill(), transform=Affine.identity())
    with pytest.raises(RasterFormatError, match="not georeferenced"):
        read_dsm(plain)
    corners = [(0, 0), (0, 50), (40, 0), (40, 50)]
    points = [GroundControlPoint(row, col, 5e5 + col, 4.17e6 - row) for row, col in corners]
    path = write_raster(tmp_path / "gcp.tif", hill(), transform=Affine.identity(), gcps=points)
    with pytest.raises(RasterFormatError, match="ground control points only"):
        read_dsm(path)


@pytest.mark.parametrize(("bands", "dtype"), [(3, "uint8"), (4, "uint8")])
def test_photos_are_named(tmp_path: Path, bands: int, dtype: str) -> None:
    path = write_raster(tmp_path / "x.tif", np.ones((bands, 9, 9), dtype=dtype))
    with pytest.raises(RasterFormatError, match="orthomosaic or photo"):
        read_dsm(path)


def test_several_bands_of_heights(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", np.ones((2, 9, 9), dtype=np.float32))
    with pytest.raises(RasterFormatError, match="2 bands"):
        read_dsm(path)


def test_spikes_are_reported_and_removed_only_on_request(tmp_path: Path) -> None:
    heights = hill()
    heights[10, 12], heights[30, 40] = 160.0, 40.0
    path = write_raster(tmp_path / "x.tif", heights)
    dsm, report = read_dsm_reported(path)
    np.testing.assert_array_equal(dsm.elevation_m, heights)
    assert [spike.kind for spike in report.spikes] == ["spike", "pit"]
    assert not report.spikes_removed
    cleaned, cleaned_report = read_dsm_reported(path, remove_spikes=True)
    assert cleaned_report.spikes_removed
    np.testing.assert_allclose(cleaned.elevation_m, hill(), atol=1.5)
    np.testing.assert_array_equal(read_dsm(path, remove_spikes=True).elevation_m, cleaned.elevation_m)


def test_resampled_size_counts_against_the_limit(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), transform=HALF_METRE @ Affine.rotation(45))
    with pytest.raises(RasterTooLargeError, match="north-up squares"):
        read_dsm(path, limits=RasterLimits(max_px=2500))


@pytest.mark.parametrize("datum", [None, "EGM2008 height", "EGM96 height", "ellipsoid", "Site datum 3"])
def test_written_models_are_read_back(tmp_path: Path, datum: str | None) -> None:
    heights = hill(300, 270)
    heights[5, 5] = np.nan
    dsm = Dsm(heights, HALF_METRE, CRS.from_epsg(32633), datum, "")
    write_dsm(tmp_path / "x.tif", dsm)
    back, report = read_dsm_reported(tmp_path / "x.tif")
    np.testing.assert_array_equal(back.elevation_m, heights)
    assert (back.crs, back.transform, back.vertical_datum) == (dsm.crs, dsm.transform, datum)
    assert report.warnings == ()
    assert [path.name for path in tmp_path.iterdir()] == ["x.tif"]


def test_demo_survives_a_round_trip(tmp_path: Path) -> None:
    write_dsm(tmp_path / "demo.tif", demo_dsm())
    back = read_dsm(tmp_path / "demo.tif")
    np.testing.assert_array_equal(back.elevation_m, demo_dsm().elevation_m)
    assert back.vertical_datum == "EGM2008 height"


def test_writing_where_nothing_can_be_written(tmp_path: Path) -> None:
    dsm = Dsm(hill(), HALF_METRE, CRS.from_epsg(32633), None, "")
    with pytest.raises(RasterError, match="cannot be written"):
        write_dsm(tmp_path / "missing" / "x.tif", dsm)


@pytest.mark.parametrize(("crs", "said"), [("EPSG:32610+5715", "depths"), ("EPSG:4978", "neither a map projection")])
def test_depths_and_geocentric_systems_are_refused(tmp_path: Path, crs: str, said: str) -> None:
    with pytest.raises(RasterFormatError, match=said):
        read_dsm(write_raster(tmp_path / "a.tif", hill(), crs=crs))


def test_a_survey_foot_is_known_and_an_unknown_unit_is_said(tmp_path: Path) -> None:
    feet, _ = read_dsm_reported(write_raster(tmp_path / "a.tif", hill(), unit="sfoot"))
    assert feet.elevation_m.max() == pytest.approx(hill().max() * 1200 / 3937, rel=1e-6)
    _, report = read_dsm_reported(write_raster(tmp_path / "b.tif", hill(), unit="furlong"))
    assert any("furlong" in warning for warning in report.warnings)
    _, plain = read_dsm_reported(write_raster(tmp_path / "c.tif", hill(), unit="metre"))
    assert plain.warnings == ()
