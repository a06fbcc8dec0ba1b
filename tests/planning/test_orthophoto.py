"""Orthomosaics on the surface model's grid."""

from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS, Transformer

from mapping.geometry.arrays import U8
from planning.errors import MissingCrsError, ParameterError, RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.geotiff import RasterLimits, read_orthophoto
from tests.planning.geotiff_samples import HALF_METRE, UTM, write_raster

CRS_UTM = CRS.from_user_input(UTM)
BOUNDS = (500_000.0, 4_169_980.0, 500_025.0, 4_170_000.0)


def colours(rows: int = 40, columns: int = 50) -> U8:
    """(3, rows, columns): red grows eastward, green southward."""
    y, x = np.mgrid[:rows, :columns]
    return np.stack([50 + x * 4, 50 + y * 4, np.full_like(x, 7)]).astype(np.uint8)


def test_same_grid_is_the_same_picture(tmp_path: Path) -> None:
    picture = read_orthophoto(write_raster(tmp_path / "x.tif", colours()), bounds_m=BOUNDS, crs=CRS_UTM)
    np.testing.assert_array_equal(picture.rgb, np.moveaxis(colours(), 0, -1))
    assert picture.known.all()
    assert picture.bounds_m == pytest.approx(BOUNDS)
    assert picture.crs == CRS_UTM
    assert not picture.rgb.flags.writeable


def test_only_the_part_over_the_model(tmp_path: Path) -> None:
    part = (500_005.0, 4_169_990.0, 500_600.0, 4_169_995.0)
    picture = read_orthophoto(write_raster(tmp_path / "x.tif", colours()), bounds_m=part, crs=CRS_UTM)
    assert picture.bounds_m == pytest.approx((500_005.0, 4_169_990.0, 500_025.0, 4_169_995.0))
    np.testing.assert_array_equal(picture.rgb, np.moveaxis(colours(), 0, -1)[10:20, 10:50])


def test_alpha_and_nodata_are_unknown(tmp_path: Path) -> None:
    alpha = np.full((1, 40, 50), 255, dtype=np.uint8)
    alpha[0, :10] = 0
    transparent = write_raster(tmp_path / "a.tif", np.concatenate([colours(), alpha]), photometric="RGB", alpha="YES")
    picture = read_orthophoto(transparent, bounds_m=BOUNDS, crs=CRS_UTM)
    np.testing.assert_array_equal(picture.known, alpha[0] > 0)
    assert not picture.rgb[:10].any()
    black = colours()
    black[:, 5, 5] = 0
    picture = read_orthophoto(write_raster(tmp_path / "n.tif", black, nodata=0), bounds_m=BOUNDS, crs=CRS_UTM)
    assert np.argwhere(~picture.known).tolist() == [[5, 5]]


def test_large_pictures_are_shrunk(tmp_path: Path) -> None:
    large = np.repeat(np.repeat(colours(), 10, axis=1), 10, axis=2)
    path = write_raster(tmp_path / "x.tif", large, transform=HALF_METRE @ Affine.scale(0.1))
    picture = read_orthophoto(path, bounds_m=BOUNDS, crs=CRS_UTM, max_px=50)
    np.testing.assert_array_equal(picture.rgb, np.moveaxis(colours(), 0, -1))


@pytest.mark.parametrize("how", ["rotated", "degrees", "web mercator"])
def test_other_grids_are_brought_to_the_model(tmp_path: Path, how: str) -> None:
    crs, transform = UTM, HALF_METRE @ Affine.rotation(12)
    if how == "degrees":
        crs, transform = "EPSG:4326", Affine(5e-6, 0, 15.00002, 0, -4.5e-6, 37.6774)
    elif how == "web mercator":
        crs, transform = "EPSG:3857", Affine(0.6, 0, 1_669_794.0, 0, -0.6, 4_533_021.0)
    there = Transformer.from_crs(crs, CRS_UTM, always_xy=True)
    x, y = there.transform(*(transform @ (25.5, 20.5)))
    bounds = (x - 30, y - 30, x + 30, y + 30)
    picture = read_orthophoto(
        write_raster(tmp_path / "x.tif", colours(), crs=crs, transform=transform), bounds_m=bounds, crs=CRS_UTM
    )
    west, _, east, north = picture.bounds_m
    pixel_m = (east - west) / picture.rgb.shape[1]
    centre = picture.rgb[int((north - y) / pixel_m), int((x - west) / pixel_m)]
    np.testing.assert_allclose(centre, colours()[:, 20, 25], atol=4)
    assert 0.4 < picture.known.mean() <= 1.0


def test_grey_pictures(tmp_path: Path) -> None:
    picture = read_orthophoto(write_raster(tmp_path / "x.tif", colours()[0]), bounds_m=BOUNDS, crs=CRS_UTM)
    np.testing.assert_array_equal(picture.rgb, np.repeat(colours()[0][..., None], 3, axis=2))


def test_what_cannot_be_draped(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", colours())
    with pytest.raises(RasterError, match="does not overlap"):
        read_orthophoto(path, bounds_m=(0.0, 0.0, 9.0, 9.0), crs=CRS_UTM)
    with pytest.raises(ParameterError, match="at least 1 pixel"):
        read_orthophoto(path, bounds_m=BOUNDS, crs=CRS_UTM, max_px=0)
    with pytest.raises(RasterTooLargeError):
        read_orthophoto(path, bounds_m=BOUNDS, crs=CRS_UTM, limits=RasterLimits(max_px=1999))
    heights = write_raster(tmp_path / "h.tif", colours()[0].astype(np.float32))
    with pytest.raises(RasterFormatError, match="no 8-bit colours"):
        read_orthophoto(heights, bounds_m=BOUNDS, crs=CRS_UTM)


def test_a_picture_without_a_system_needs_one(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", colours(), crs=None)
    with pytest.raises(MissingCrsError):
        read_orthophoto(path, bounds_m=BOUNDS, crs=CRS_UTM)
    assert read_orthophoto(path, bounds_m=BOUNDS, crs=CRS_UTM, declared_crs=UTM).known.all()
