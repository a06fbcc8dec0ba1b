"""A file's own cells, whatever their shape: certificate, holes, spikes and seen columns act on them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from affine import Affine

from mapping.geometry.arrays import F32, F64
from planning.certificate.around import cells_around
from planning.certificate.line_heights import height_range
from planning.certificate.nearest import nearest_distances
from planning.certificate.pyramid import MaxPyramid, cells_pyramid
from planning.certificate.returns import return_altitude
from planning.evading.seen import Columns, burn
from planning.terrain.cells.cells import Cells, ringed, square_cells
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm, read_dsm_reported
from planning.terrain.holes import fill_holes
from server.library.terrains import load_terrain, store_terrain
from tests.planning.geotiff_samples import hill, write_raster

TURNED = Affine.translation(5e5, 4.17e6) @ Affine.rotation(31.0) @ Affine.scale(1.0, -1.0)
DEGREES = Affine(1e-5, 0, 14.99, 0, -1e-5, 37.73)


def rough(seed: int, holes: int = 0) -> F32:
    random = np.random.default_rng(seed)
    elevation_m = random.normal(0.0, 2.0, (45, 38))
    elevation_m[random.random(elevation_m.shape) < 0.02] += 12.0
    elevation_m.ravel()[random.integers(0, elevation_m.size, holes)] = np.nan
    return elevation_m.astype(np.float32)


def rectangles(elevation_m: F32) -> tuple[MaxPyramid, MaxPyramid]:
    """The pyramid over squares of 0.7 m, and over the same squares as quadrilaterals of a lattice bent by nothing."""
    squares = square_cells(ringed(elevation_m), 0.7, (0.0, 0.0))
    layout = squares.layout
    unbent = layout.lattice._replace(bend_m=np.zeros((12, 12, 2)), node_px=8)
    as_quads = Cells(squares.elevation_m, type(layout)(unbent, layout.origin_xy_m, layout.turn, layout.shape))
    return cells_pyramid(squares), cells_pyramid(as_quads)


@pytest.mark.parametrize("holes", [0, 5])
@pytest.mark.parametrize("seed", range(4))
def test_squares_as_quadrilaterals_are_judged_as_squares(seed: int, holes: int) -> None:
    squares, quads = rectangles(rough(seed, holes))
    random = np.random.default_rng(seed)
    low, high = [1.5, 1.5, -2.0], [25.0, 30.0, 18.0]
    start_m, end_m = random.uniform(low, high, (60, 3)), random.uniform(low, high, (60, 3))
    distance_m, _ = nearest_distances(squares, start_m, end_m)
    as_quads_m, _ = nearest_distances(quads, start_m, end_m)
    np.testing.assert_allclose(as_quads_m, distance_m, atol=1e-9)
    for ours, theirs in zip(height_range(quads, start_m, end_m), height_range(squares, start_m, end_m), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9)
    for clearance_m in (0.3, 2.0):
        expected = return_altitude(squares, start_m[:6], end_m[0, :2], clearance_m)
        assert return_altitude(quads, start_m[:6], end_m[0, :2], clearance_m) == pytest.approx(expected, abs=1e-9)


def test_a_line_that_leaves_the_model_touches_the_outside() -> None:
    _, quads = rectangles(rough(0))
    start_m, end_m = np.array([[10.0, 10.0, 90.0]] * 2), np.array([[10.0, 0.2, 90.0], [10.0, -40.0, 90.0]])
    assert nearest_distances(quads, start_m, end_m)[0].tolist() == [0.0, 0.0]
    assert height_range(quads, start_m, end_m)[0].tolist() == [-np.inf, -np.inf]


@pytest.mark.parametrize(("crs", "transform"), [("EPSG:32633", TURNED), ("EPSG:4326", DEGREES)])
def test_heights_are_those_of_the_files_cells(tmp_path: Path, crs: str, transform: Affine) -> None:
    path = write_raster(tmp_path / "x.tif", hill(), crs=crs, transform=transform)
    dsm = read_dsm(path)
    assert dsm.source is not None
    at = place(dsm, crs, transform, 20.9, 25.1)
    assert dsm.elevation_at(at)[0] == hill()[20, 25]
    row, column = dsm.source.layout.places(at)[0] - 1.0  # a ring of unknown cells lies around
    assert (row, column) == pytest.approx((20.9, 25.1), abs=1e-3)
    assert np.isnan(dsm.elevation_at(place(dsm, crs, transform, -0.2, 25.0)))[0]


def place(dsm: Dsm, crs: str, transform: Affine, row: float, column: float) -> F64:
    """Projected place of a row and column of the file."""
    x, y = transform @ (column, row)
    return np.array([[x, y]]) if crs != "EPSG:4326" else dsm.xy_from_lat_lon(np.array([[y, x]]))


def test_small_holes_are_filled_in_the_files_cells_and_the_grid_follows(tmp_path: Path) -> None:
    heights = hill()
    heights[10, 12] = heights[30:33, 30:34] = np.nan
    heights[10, 13] = 140.0
    dsm = read_dsm(write_raster(tmp_path / "x.tif", heights, transform=TURNED, nodata=np.nan))
    hole, large = place(dsm, "", TURNED, 10.5, 12.5), place(dsm, "", TURNED, 31.5, 32.0)
    filled, report = fill_holes(dsm)
    assert (report.count, report.area_m2) == (1, pytest.approx(1.0))
    assert np.isnan(dsm.elevation_at(hole))[0]
    assert filled.elevation_at(hole)[0] == 140.0
    assert np.isnan(filled.elevation_at(large))[0]
    assert filled.as_grid().elevation_at(hole)[0] == 140.0
    assert np.isnan(filled.as_grid().elevation_at(large))[0]


def test_spikes_are_removed_from_the_files_cells(tmp_path: Path) -> None:
    heights = hill()
    heights[21, 17] = 150.0
    path = write_raster(tmp_path / "x.tif", heights, transform=TURNED)
    at = place(read_dsm(path), "", TURNED, 21.5, 17.5)
    assert read_dsm(path).elevation_at(at)[0] == 150.0
    without, report = read_dsm_reported(path, remove_spikes=True)
    assert len(report.spikes) == 1
    assert without.elevation_at(at)[0] < 110.0
    assert without.as_grid().elevation_at(at)[0] < 110.0
    assert without.source is not None
    same = np.isclose(without.source.elevation_m[1:-1, 1:-1], heights)
    assert np.argwhere(~same).tolist() == [[21, 17]]


@pytest.mark.parametrize(("crs", "transform"), [("EPSG:32633", TURNED), ("EPSG:4326", DEGREES)])
def test_what_was_seen_raises_every_cell_of_the_file_that_it_touches(
    tmp_path: Path, crs: str, transform: Affine
) -> None:
    dsm = read_dsm(write_raster(tmp_path / "x.tif", hill(), crs=crs, transform=transform))
    middle = place(dsm, crs, transform, 20.98, 17.02)
    raised = burn(dsm, Columns(middle, np.array([131.0]), 0.5))
    assert raised.source is not None
    offsets = np.stack(np.meshgrid(np.linspace(-0.499, 0.499, 9), np.linspace(-0.499, 0.499, 9)), axis=2).reshape(-1, 2)
    for model in (raised, raised.as_grid()):
        assert (model.elevation_at(middle + offsets) >= 131.25).all()
    assert 4 <= np.count_nonzero(raised.source.elevation_m > 120.0) <= 9


def test_a_window_keeps_the_files_cells(tmp_path: Path) -> None:
    dsm = read_dsm(write_raster(tmp_path / "x.tif", hill(), crs="EPSG:4326", transform=DEGREES))
    part = dsm.window(10, 12, 14, 15)
    inside = np.random.default_rng(1).uniform(part.bounds_m[:2], part.bounds_m[2:], (200, 2))
    np.testing.assert_array_equal(part.elevation_at(inside), dsm.elevation_at(inside))
    assert part.source is not None
    assert part.source.elevation_m.size < 500


def test_cells_around_a_place_are_near_and_far_as_their_corners_say() -> None:
    around = cells_around(square_cells(rough(3), 1.0, (0.0, 45.0)), (10.3, 40.6), 1.0)
    assert around.inside
    reached = around.near_m <= 1.0
    assert np.count_nonzero(reached) == 9
    assert np.sort(around.near_m.ravel())[:3] == pytest.approx([0.0, 0.3, 0.4])
    assert around.far_m[reached].max() == pytest.approx(np.hypot(1.7, 1.6))


def test_the_library_keeps_the_files_cells(tmp_path: Path) -> None:
    dsm = read_dsm(write_raster(tmp_path / "x.tif", hill(), crs="EPSG:4326", transform=DEGREES))
    (tmp_path / "terrains").mkdir()
    doc = store_terrain(tmp_path, dsm, name="x")
    again = load_terrain(tmp_path / "terrains" / doc.id)
    assert again.source is not None
    assert dsm.source is not None
    np.testing.assert_array_equal(again.source.elevation_m, dsm.source.elevation_m)
    places = np.random.default_rng(1).uniform(dsm.bounds_m[:2], dsm.bounds_m[2:], (200, 2))
    np.testing.assert_array_equal(again.source.layout.places(places), dsm.source.layout.places(places))
