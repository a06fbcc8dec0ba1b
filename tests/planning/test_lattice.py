"""Boxes around bent and sheared cells: they hold what they are meant to hold, and hardly more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.certificate.around import cells_around
from planning.certificate.home_ground import home_ground
from planning.certificate.nearest import nearest_distances
from planning.certificate.pyramid import LEAF_PX, cells_pyramid
from planning.certificate.quads import quad_distance_sq
from planning.terrain.cells.cells import Cells, Layout, place_cells, ringed, square_cells
from planning.terrain.cells.lattice import Lattice, bend_at, bend_range, corner, quad_of, straight
from planning.terrain.rasters.mapping import source_mapping
from tests.planning.test_clearance import NORTH, WEST, dsm_of
from tests.reference import proof
from tests.seeds import seeds

ROWS, COLUMNS = 43, 50


def bent(seed: int, *, shear_m: float = 0.0, first: tuple[int, int] = (0, 0), node_px: int = 8) -> Lattice:
    """Oblong cells, their corners off by some centimetres, as a part of a larger lattice."""
    nodes = (-(-(ROWS + first[0]) // node_px) + 1, -(-(COLUMNS + first[1]) // node_px) + 1, 2)
    bend_m = np.random.default_rng(seed).uniform(-0.1, 0.1, nodes)
    return straight(0.7, 1.1, shear_m)._replace(
        bend_m=bend_m, node_px=node_px, first_row=first[0], first_column=first[1]
    )


@given(
    seed=st.integers(0, 1000),
    first=st.tuples(st.integers(0, 20), st.integers(0, 20)),
    row=st.integers(0, ROWS - 1),
    column=st.integers(0, COLUMNS - 1),
    rows=st.integers(1, 20),
    columns=st.integers(1, 20),
)
@settings(max_examples=80, deadline=None, derandomize=True)
def test_the_bend_of_a_block_is_between_its_extremes(
    seed: int, first: tuple[int, int], row: int, column: int, rows: int, columns: int
) -> None:
    lattice = bent(seed, first=first)
    row1, column1 = min(ROWS, row + rows), min(COLUMNS, column + columns)
    places = [bend_at(lattice, r, c) for r in range(row, row1 + 1) for c in range(column, column1 + 1)]
    x0, y0, x1, y1 = bend_range(lattice, row, column, row1, column1)
    assert (x0, y0) == pytest.approx(np.min(places, axis=0), abs=2e-9)
    assert (x1, y1) == pytest.approx(np.max(places, axis=0), abs=2e-9)
    assert (np.min(places, axis=0) >= (x0, y0)).all()
    assert (np.max(places, axis=0) <= (x1, y1)).all()


@pytest.mark.parametrize("first", [(0, 0), (5, 3)])
@pytest.mark.parametrize("shear_m", [0.0, -0.4])
def test_every_box_of_the_pyramid_holds_its_cells(shear_m: float, first: tuple[int, int]) -> None:
    lattice = bent(3, shear_m=shear_m, first=first)
    shape = (ROWS, COLUMNS)
    pyramid = cells_pyramid(Cells(np.zeros(shape, np.float32), Layout(lattice, (0.0, 0.0), np.eye(2), shape)))
    assert len(pyramid.boxes_m) == len(pyramid.maxima_m)
    for level, (offset, rows, columns) in enumerate(pyramid.layout):
        side = LEAF_PX * 2**level
        for i, j in np.ndindex(int(rows), int(columns)):
            block = range(i * side, min(ROWS, (i + 1) * side)), range(j * side, min(COLUMNS, (j + 1) * side))
            corners = np.array([quad_of(lattice, r, c) for r in block[0] for c in block[1]]).reshape(-1, 2)
            x0, y0, x1, y1 = pyramid.boxes_m[offset + i * columns + j]
            slack_m = corners.min(axis=0) - (x0, y0), (x1, y1) - corners.max(axis=0)
            assert np.min(slack_m) >= 0.0
            assert np.max(slack_m) < 0.25  # the bend changes by so much within a block


@pytest.mark.parametrize("shear_m", [0.0, 0.4])
@seeds(3)
def test_skipping_by_boxes_loses_no_cell(seed: int, shear_m: float) -> None:
    random = np.random.default_rng(seed)
    lattice, shape = bent(seed, shear_m=shear_m, first=(3, 5)), (ROWS, COLUMNS)
    elevation_m = random.normal(0.0, 2.0, shape).astype(np.float32)
    pyramid = cells_pyramid(Cells(elevation_m, Layout(lattice, (0.0, 0.0), np.eye(2), shape)))
    # Well inside: beyond the cells lies the outside, which this test leaves out.
    start_m, end_m = random.uniform([14, 12, 3], [22, 34, 9], (2, 25, 3))
    found_m, _ = nearest_distances(pyramid, start_m, end_m)
    for a, b, distance_m in zip(start_m, end_m, found_m, strict=True):
        move: tuple[float, float, float, float, float, float] = (*a.tolist(), *(b - a).tolist())
        every = [
            quad_distance_sq(*move, quad_of(lattice, r, c), float(elevation_m[r, c]))[0] for r, c in np.ndindex(shape)
        ]
        assert distance_m == pytest.approx(np.sqrt(min(every)), abs=1e-9)


@given(
    seed=st.integers(0, 1000),
    res=st.sampled_from([0.01, 0.1, 0.5, 1.524]),
    x=st.floats(0.2, 0.8),
    y=st.floats(0.2, 0.8),
    centre_m=st.floats(0.0, 1.5),
)
@settings(max_examples=60, deadline=None, derandomize=True)
def test_rectangles_around_a_place_are_as_near_as_quadrilaterals(
    seed: int, res: float, x: float, y: float, centre_m: float
) -> None:
    cells = np.random.default_rng(seed).uniform(0.0, 1.4, (40, 44)).astype(np.float32)
    squares = square_cells(cells, res, (WEST, NORTH))
    place = WEST + x * 44 * res, NORTH - y * 40 * res
    layout = squares.layout
    unbent = Layout(
        layout.lattice._replace(bend_m=np.zeros((7, 7, 2)), node_px=8), layout.origin_xy_m, layout.turn, layout.shape
    )
    reach_m = min(0.3 * 40 * res, centre_m + 0.35)
    ours, theirs = cells_around(squares, place, reach_m), cells_around(Cells(cells, unbent), place, reach_m)
    np.testing.assert_allclose(ours.near_m, theirs.near_m, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(ours.far_m, theirs.far_m)
    np.testing.assert_array_equal(ours.height_m, theirs.height_m)
    dsm = dsm_of(cells, res=res)
    as_quads = replace(dsm, source=Cells(cells, unbent))
    stands = [home_ground(model, place, centre_m=reach_m - 0.02, radius_m=0.02) for model in (dsm, as_quads)]
    assert repr(stands[0]) == repr(stands[1])


def test_a_vehicle_is_not_set_down_between_leaning_cells_that_differ_too_much() -> None:
    """Four rows down and four columns back lie 0.3 m away, where every row is moved by a cell."""
    cells = np.full((40, 40), 0.5, np.float32)
    cells[18, 22], cells[22, 18] = 1.05, 0.0
    lattice = straight(0.1, 0.1, 0.1)
    leaning = Cells(cells, Layout(lattice, (WEST, NORTH), np.array([[1.0, 0.0], [0.0, -1.0]]), cells.shape))
    dsm = replace(dsm_of(np.zeros((40, 80)), res=0.1), source=leaning)
    place = leaning.layout.xy_of(20.5, 20.5)
    assert home_ground(dsm, place, centre_m=0.35, radius_m=0.35).obstacle is not None
    assert home_ground(dsm, place, centre_m=0.35, radius_m=0.25).obstacle is None


@pytest.mark.parametrize("cell_m", [0.01, 1.0, 10.0, 30.0, 90.0])
@pytest.mark.parametrize("lat_deg", [37.7, 60.0])
def test_corners_lie_where_the_projection_puts_them(cell_m: float, lat_deg: float) -> None:
    """To the millimetre, also where cells are as large as those of a satellite's model."""
    step_deg = cell_m / 111_000
    degrees = Affine(step_deg / np.cos(np.radians(lat_deg)), 0, 10.4, 0, -step_deg, lat_deg)
    forward, _ = source_mapping(degrees, CRS.from_epsg(4326), CRS.from_epsg(32632))
    shape = (200, 260)
    layout = place_cells(shape, forward).layout
    rows, columns = (grid.ravel() for grid in np.mgrid[0 : shape[0] + 1, 0 : shape[1] + 1].astype(np.float64))
    placed = np.array([corner(layout.lattice, row + 1, column + 1) for row, column in zip(rows, columns, strict=True)])
    off_m = placed - layout.in_frame(np.column_stack(forward(columns, rows)))
    assert np.hypot(*off_m.T).max() < 1e-3


@pytest.mark.parametrize("shear_m", [0.0, 0.4])
def test_places_are_the_same_whatever_metre_they_are_measured_in(shear_m: float) -> None:
    turn = np.array([[0.6, 0.8], [0.8, -0.6]])
    layout = Layout(bent(1, shear_m=shear_m), (WEST, NORTH), turn, (ROWS, COLUMNS))
    longer = layout.measured_in(1.004)
    for row, column in ((0.0, 0.0), (7.3, 31.8)):
        assert longer.xy_of(row, column) == pytest.approx(layout.xy_of(row, column), abs=1e-8)
        assert longer.places(np.array([layout.xy_of(row, column)]))[0] == pytest.approx((row, column), abs=1e-6)
    part = longer.part(5, 9, (10, 10))
    assert part.xy_of(2.0, 3.0) == pytest.approx(layout.xy_of(7.0, 12.0), abs=1e-8)
    apart_m = longer.in_frame(np.array([[WEST, NORTH], [WEST + 10.04, NORTH]]))
    assert np.linalg.norm(apart_m[1] - apart_m[0]) == pytest.approx(10.0)


def odd_cells(random: np.random.Generator) -> Cells:
    """A few cells, often one, with spikes and unknown rims, square, oblong, leaning or bent, of 1 cm or of 90 m."""
    shape = random.integers(1, 14, 2)
    elevation_m = random.normal(0.0, 1.0, shape).astype(np.float32)
    elevation_m[random.random(shape) < 0.1] += 30.0
    elevation_m[random.random(shape) < 0.05] = np.nan
    if random.random() < 0.3:
        elevation_m[0], elevation_m[:, -1] = np.nan, np.nan
    side_m = random.choice([0.01, 1.0, 10.0, 90.0])
    lattice = straight(side_m, side_m * random.choice([0.6, 1.0, 1.7]), side_m * random.choice([0.0, 0.5, -1.3]))
    inner = ringed(elevation_m)
    if random.random() < 0.5:
        nodes = (-(-inner.shape[0] // 4) + 1, -(-inner.shape[1] // 4) + 1, 2)
        lattice = lattice._replace(bend_m=random.uniform(-0.1, 0.1, nodes) * side_m, node_px=4)
    return Cells(inner, Layout(lattice, (0.0, 0.0), np.eye(2), inner.shape))


@seeds(60)
def test_odd_models_are_judged_as_by_brute_force(seed: int) -> None:
    random = np.random.default_rng(seed)
    cells = odd_cells(random)
    lattice, (rows, columns) = cells.layout.lattice, cells.elevation_m.shape
    pyramid = cells_pyramid(cells)
    inside = random.uniform([1.02, 1.02], [rows - 1.02, columns - 1.02], (6, 2))
    on_corner = corner(lattice, 1.0, 1.0)
    ends = np.array([[*corner(lattice, row, column), random.uniform(-1, 25)] for row, column in inside])
    ends[0, :2], ends[4, :2] = on_corner, ends[1, :2]  # from a corner of cells, and straight up
    start_m, end_m = ends[:3], ends[3:]
    found_m, _ = nearest_distances(pyramid, start_m, end_m)
    tops = np.where(np.isfinite(cells.elevation_m), cells.elevation_m, np.inf).astype(np.float64)
    for a, b, distance_m in zip(start_m, end_m, found_m, strict=True):
        every = [
            proof.least_sq(a, b, np.array(quad_of(lattice, r, c)).reshape(4, 2), tops[r, c])
            for r, c in np.ndindex(rows, columns)
        ]
        assert distance_m == pytest.approx(np.sqrt(min(every)), abs=1e-8)
