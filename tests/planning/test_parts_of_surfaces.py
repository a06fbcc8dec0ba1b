"""A dilated surface and a traversability map, cut into boxes: those of the whole model, bit for bit."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from mapping.geometry.arrays import F32
from planning.errors import ParameterError
from planning.ground.traversable import map_cells, traversable_ground, traversable_part
from planning.safe_surface.surface import dilate, dilate_part
from planning.safe_surface.window import Box
from planning.terrain.dsm import Dsm, SurfaceModel
from planning.terrain.geotiff import open_dsm, read_dsm
from planning.terrain.rasters import dsm_file
from tests.planning.geotiff_samples import HALF_METRE, write_raster

GRIDS = {
    "metres": ("EPSG:32633", HALF_METRE),
    "degrees": ("EPSG:4326", Affine(5e-6, 0.0, 14.99, 0.0, -4e-6, 37.73)),
    "turned": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(23.0) @ Affine.scale(0.5, -0.5)),
}


def holed(rows: int, columns: int, seed: int) -> F32:
    """Steps and cells of noise high above the sea, single holes and a large one."""
    random = np.random.default_rng(seed)
    heights = random.uniform(0.0, 0.3, (rows, columns)) + 4000.0 + 5.0 * (random.random((rows, columns)) < 0.02)
    heights[random.random(heights.shape) < 0.1] = np.nan
    heights[rows // 3 : rows // 2, columns // 4 : columns // 2] = np.nan
    return heights.astype(np.float32)


def in_boxes(shape: tuple[int, int], down: int, across: int) -> list[Box]:
    return [
        Box(row, column, min(shape[0], row + down), min(shape[1], column + across))
        for row in range(0, shape[0], down)
        for column in range(0, shape[1], across)
    ]


def dilated_in_boxes(model: SurfaceModel, radius_m: float, height_m: float, down: int, across: int) -> bytes:
    made = np.empty((model.height_px, model.width_px), np.float32)
    for box in in_boxes(made.shape, down, across):
        made[box.slices] = dilate_part(model, box, radius_m=radius_m, height_m=height_m)
    return made.tobytes()


def map_in_boxes(model: SurfaceModel, resolution_m: float | None, down: int, across: int) -> list[bytes]:
    cells = map_cells(model, resolution_m)
    made = [np.empty(cells.shape, np.float32) for _ in range(4)]
    for box in in_boxes(cells.shape, down, across):
        part = traversable_part(model, cells, box)
        for layer, values in zip(made, (part.slope_rad, part.roughness_m, part.value, part.elevation_m), strict=True):
            layer[box.slices] = values
    return [layer.tobytes() for layer in made]


def whole_map(dsm: Dsm, resolution_m: float | None) -> list[bytes]:
    found = traversable_ground(dsm, resolution_m)
    assert found.dsm.transform == map_cells(dsm, resolution_m).transform
    layers = found.map.slope_rad, found.map.roughness_m, found.map.value, found.map.elevation_m
    return [layer.tobytes() for layer in layers]


@settings(max_examples=20, deadline=None)
@given(
    shape=st.tuples(st.integers(11, 61), st.integers(11, 61)),
    cell_m=st.sampled_from([0.1, 0.5, 0.7]),
    reach_px=st.floats(0.3, 9.0),
    box=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    seed=st.integers(0, 1000),
)
def test_any_boxes_make_the_dilated_model(
    shape: tuple[int, int], cell_m: float, reach_px: float, box: tuple[int, int], seed: int
) -> None:
    dsm = Dsm(holed(*shape, seed), HALF_METRE @ Affine.scale(2 * cell_m), CRS.from_epsg(32633), None, "")
    radius_m = reach_px * dsm.resolution_m
    whole = dilate(dsm, radius_m=radius_m, height_m=2.0).elevation_m
    assert dilated_in_boxes(dsm, radius_m, 2.0, *box) == whole.tobytes()


@settings(max_examples=20, deadline=None)
@given(
    shape=st.tuples(st.integers(11, 61), st.integers(11, 61)),
    cell_m=st.sampled_from([0.05, 0.1, 0.5]),
    together=st.sampled_from([1, 2, 3, 7]),
    box=st.tuples(st.integers(1, 30), st.integers(1, 30)),
    seed=st.integers(0, 1000),
)
def test_any_boxes_make_the_map(
    shape: tuple[int, int], cell_m: float, together: int, box: tuple[int, int], seed: int
) -> None:
    dsm = Dsm(holed(*shape, seed), HALF_METRE @ Affine.scale(2 * cell_m), CRS.from_epsg(32633), None, "")
    resolution_m = together * dsm.resolution_m
    assert map_in_boxes(dsm, resolution_m, *box) == whole_map(dsm, resolution_m)


@pytest.mark.parametrize("kind", list(GRIDS))
def test_so_do_boxes_that_are_read_from_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    monkeypatch.setattr(dsm_file, "LARGE_PX", 0)
    monkeypatch.setattr(dsm_file, "AHEAD_PX", 3)
    crs, transform = GRIDS[kind]
    heights = np.where(np.isnan(found := holed(83, 71, 3)), np.float32(-9999.0), found)
    path = write_raster(tmp_path / "model.tif", heights, crs=crs, transform=transform, nodata=-9999.0)
    whole, file = read_dsm(path), open_dsm(path)
    dilated = dilate(whole.as_grid(), radius_m=3.1, height_m=2.0).elevation_m
    assert dilated_in_boxes(file, 3.1, 2.0, 40, 47) == dilated.tobytes()
    assert map_in_boxes(file, 1.0, 25, 22) == whole_map(whole, 1.0)


def test_without_a_resolution_a_model_of_too_many_cells_gets_coarser_ones() -> None:
    none_m = np.broadcast_to(np.float32(0.0), (30_000, 70_001))
    large = Dsm(none_m, HALF_METRE @ Affine.scale(0.2), CRS.from_epsg(32633), None, "")
    cells = map_cells(large, None)
    assert cells.together == 8
    assert cells.shape == (math.ceil(30_000 / 8), math.ceil(70_001 / 8))
    assert map_cells(large, 0.3).together == 3
    with pytest.raises(ParameterError, match="makes no sense"):
        map_cells(large, 0.0)
