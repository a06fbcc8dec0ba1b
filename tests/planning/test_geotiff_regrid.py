"""Resampling to north-up squares: no height is lost, whatever the shape of the cells."""

from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS, Transformer

from mapping.geometry.arrays import F32
from planning.terrain.cells.cells import place_cells
from planning.terrain.cells.squares import square_grid, squares
from planning.terrain.geotiff import read_dsm, read_dsm_reported
from planning.terrain.rasters.mapping import Mapping, extent_of, source_mapping
from tests.planning.geotiff_samples import hill, write_raster

UTM = CRS.from_epsg(32633)
WGS84 = CRS.from_epsg(4326)


def height_at(target: F32, transform: Affine, x: float, y: float) -> float:
    column, row = ~transform @ (x, y)
    inside = 0 <= row < target.shape[0] and 0 <= column < target.shape[1]
    return float(target[int(row), int(column)]) if inside else np.nan


def squared(source: F32, affine: Affine, crs: CRS) -> tuple[F32, Affine, Mapping]:
    """The squares over a raster, their transform, and where its pixels lie."""
    forward, to_source = source_mapping(affine, crs, UTM)
    cells = place_cells(source.shape, forward).cells(source)
    transform, shape = square_grid(cells.layout, extent_of(forward, source.shape))
    return squares(cells, transform, shape), transform, to_source


def assert_nothing_lost(source: F32, affine: Affine, crs: CRS, seed: int) -> None:
    """Slow check of every source cell: its area is nowhere lower, or unknown, and no height is invented."""
    target, transform, to_source = squared(source, affine, crs)
    to_utm = Transformer.from_crs(crs, UTM, always_xy=True)
    places = np.random.default_rng(seed).random((6, 2))
    for (row, column), height in np.ndenumerate(source):
        for dx, dy in places:
            x, y = to_utm.transform(*(affine @ (column + dx, row + dy)))
            square = height_at(target, transform, x, y)
            assert np.isnan(square) if np.isnan(height) else not square < height
    rows, columns = np.mgrid[: target.shape[0], : target.shape[1]]
    share = np.linspace(0.003, 0.997, 4)
    for value, row, column in zip(target.ravel(), rows.ravel(), columns.ravel(), strict=True):
        u, v = np.meshgrid(column + share, row + share)
        place = to_source(*(np.asarray(k) for k in transform @ (u.ravel(), v.ravel())))
        touched_column, touched_row = (np.floor(k).astype(int) for k in place)
        inside = (touched_row >= 0) & (touched_row < source.shape[0])
        inside &= (touched_column >= 0) & (touched_column < source.shape[1])
        touched = source[touched_row[inside], touched_column[inside]]
        if not inside.all() or np.isnan(touched).any():
            assert np.isnan(value), "a square that touches unknown ground is unknown"
        elif not np.isnan(value):
            r, c = int(np.median(touched_row)), int(np.median(touched_column))
            around = source[max(0, r - 1) : r + 2, max(0, c - 1) : c + 2]
            assert touched.max() <= value <= np.nanmax(around)


@settings(max_examples=40, deadline=None)
@given(
    angle=st.floats(-180, 180),
    oblong=st.floats(0.3, 3.0),
    shear=st.floats(-20, 20),
    shape=st.tuples(st.integers(1, 12), st.integers(1, 12)),
    seed=st.integers(0, 2**32 - 1),
)
def test_rotated_oblong_and_sheared_cells(
    angle: float, oblong: float, shear: float, shape: tuple[int, int], seed: int
) -> None:
    random = np.random.default_rng(seed)
    source = random.normal(100.0, 20.0, shape).astype(np.float32)
    source[random.random(shape) < 0.2] = np.nan
    turned = (
        Affine.translation(5e5, 4.17e6) @ Affine.rotation(angle) @ Affine.shear(shear, 0) @ Affine.scale(oblong, -1.0)
    )
    assert_nothing_lost(source, turned, UTM, seed)


@settings(max_examples=20, deadline=None)
@given(lat=st.floats(-70, 70), lon=st.floats(12.5, 17.5), cell=st.floats(1e-6, 1e-3), seed=st.integers(0, 2**32 - 1))
def test_cells_in_degrees(lat: float, lon: float, cell: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    source = random.normal(100.0, 20.0, (14, 11)).astype(np.float32)
    source[random.random(source.shape) < 0.2] = np.nan
    assert_nothing_lost(source, Affine(cell, 0, lon, 0, -cell, lat), WGS84, seed)


@pytest.mark.parametrize("angle", [0.0, 7.0, 30.0, 45.0])
def test_a_mast_of_one_cell_survives_a_large_rotated_model(angle: float) -> None:
    source = np.full((1500, 1300), 100.0, dtype=np.float32)
    source[777, 1234] = 130.0
    affine = Affine.translation(5e5, 4.17e6) @ Affine.rotation(angle) @ Affine.scale(0.5, -0.31)
    target, transform, _ = squared(source, affine, UTM)
    x, y = affine @ (1234.5, 777.5)
    assert height_at(target, transform, x, y) == 130.0
    assert 1 <= np.count_nonzero(target == 130.0) <= 16


def test_oblong_cells_that_lie_straight_are_only_divided(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), transform=Affine(0.5, 0, 5e5, 0, -1.0, 4.17e6))
    dsm = read_dsm(path)
    assert dsm.source is not None
    assert dsm.resolution_m == pytest.approx(0.5, rel=1e-9)
    np.testing.assert_array_equal(dsm.elevation_m, np.repeat(hill(), 2, axis=0))


def test_degrees_go_to_the_local_utm_zone(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), crs="EPSG:4326", transform=Affine(1e-5, 0, 14.99, 0, -1e-5, 37.73))
    dsm, report = read_dsm_reported(path)
    assert dsm.crs.to_epsg() == 32633
    assert dsm.resolution_m == pytest.approx(0.882 * 0.98, rel=0.01)
    assert float(np.nanmax(dsm.elevation_m)) == hill().max()
    place = dsm.xy_from_lat_lon(np.array([[37.73 - 20.5e-5, 14.99 + 25.5e-5]]))
    assert dsm.elevation_at(place)[0] >= hill()[20, 25]
    assert any("degrees" in warning for warning in report.warnings)


def test_the_southern_hemisphere_and_ellipsoidal_heights(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), crs="EPSG:4979", transform=Affine(1e-5, 0, 175.5, 0, -1e-5, -36.8))
    dsm = read_dsm(path)
    assert (dsm.crs.to_epsg(), dsm.vertical_datum) == (32760, "ellipsoid")


def test_metres_that_are_not_true_are_reprojected(tmp_path: Path) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), crs="EPSG:3857", transform=Affine(1, 0, 1.67e6, 0, -1, 4.54e6))
    dsm, report = read_dsm_reported(path)
    assert dsm.crs.to_epsg() == 32633
    assert 0.75 < dsm.resolution_m < 0.8
    assert any("off on the ground" in warning for warning in report.warnings)


def test_metres_too_untrue_to_be_certified_are_reprojected(tmp_path: Path) -> None:
    """Eleven degrees west of its zone's meridian a UTM metre is 1.2 % too long."""
    east_m = 500_000 - 1_000_000
    path = write_raster(tmp_path / "x.tif", hill(), crs="EPSG:32633", transform=Affine(1, 0, east_m, 0, -1, 4.17e6))
    dsm, report = read_dsm_reported(path)
    assert dsm.crs.to_epsg() == 32631
    assert any("1.2% off on the ground" in warning for warning in report.warnings), report.warnings


@pytest.mark.parametrize(
    ("west_deg", "lat_deg", "epsg"), [(179.9998, -17, 32701), (-180.0003, -17, 32760), (359.5, 51, 32630)]
)
def test_longitudes_may_cross_the_date_line_or_count_to_360(tmp_path: Path, west_deg: float, lat_deg: float, epsg: int):
    path = write_raster(
        tmp_path / "a.tif", hill(), crs="EPSG:4326", transform=Affine(1e-5, 0, west_deg, 0, -1e-5, lat_deg)
    )
    dsm = read_dsm(path)
    assert dsm.crs.to_epsg() == epsg
    assert np.nanmax(dsm.elevation_m) == hill().max()
    assert np.isfinite(dsm.elevation_m).mean() > 0.8
    top = np.argwhere(dsm.elevation_m == hill().max())[0]
    lat, lon = dsm.lat_lon_from_xy(np.array([dsm.transform @ (top[1] + 0.5, top[0] + 0.5)]))[0]
    assert lat == pytest.approx(lat_deg - 20.5e-5, abs=2e-5)
    assert (lon - west_deg - 25.5e-5 + 180) % 360 - 180 == pytest.approx(0, abs=2e-5)
