"""A GeoTIFF that is written as its rows come: the same bytes however they come, and nothing but a whole file."""

from __future__ import annotations

import resource
from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS

from mapping.geometry.arrays import F32
from planning.errors import RasterError
from planning.terrain.dsm import Dsm
from planning.terrain.geotiff import read_dsm, write_dsm
from planning.terrain.grid_file import GridPlace, rows_written
from tests.planning.geotiff_samples import HALF_METRE

ROWS, COLUMNS = 531, 290
PLACE = GridPlace(HALF_METRE, CRS.from_epsg(32633), "EGM2008 height", (ROWS, COLUMNS))


@pytest.fixture(scope="module")
def heights() -> F32:
    random = np.random.default_rng(5)
    heights = random.uniform(0.0, 30.0, (ROWS, COLUMNS)).astype(np.float32)
    heights[random.random(heights.shape) < 0.1] = np.nan
    return heights


@pytest.mark.parametrize("at_once", [1, 100, 256, ROWS])
def test_the_same_bytes_however_the_rows_come(tmp_path: Path, heights: F32, at_once: int) -> None:
    write_dsm(tmp_path / "whole.tif", Dsm(heights, PLACE.transform, PLACE.crs, PLACE.vertical_datum, ""))
    with rows_written(tmp_path / "rows.tif", PLACE) as put:
        for row in range(0, ROWS, at_once):
            put(heights[row : row + at_once])
        assert not (tmp_path / "rows.tif").exists()
    assert (tmp_path / "rows.tif").read_bytes() == (tmp_path / "whole.tif").read_bytes()
    back = read_dsm(tmp_path / "rows.tif")
    np.testing.assert_array_equal(back.elevation_m, heights)
    assert (back.transform, back.crs, back.vertical_datum) == (PLACE.transform, PLACE.crs, PLACE.vertical_datum)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["rows.tif", "whole.tif"]


@pytest.mark.parametrize("stop", [KeyboardInterrupt, ValueError])
def test_what_is_broken_off_leaves_nothing(tmp_path: Path, heights: F32, stop: type[BaseException]) -> None:
    with pytest.raises(stop), rows_written(tmp_path / "rows.tif", PLACE) as put:  # noqa: PT012
        put(heights[:300])
        raise stop
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (ROWS - 1, "its rows end too early"),
        (ROWS + 1, "more rows than it has"),
        (ROWS + 60, "more rows than it has"),
        (100 * ROWS, "more rows than it has"),
    ],
)
def test_rows_that_are_missing_or_too_many_are_said(tmp_path: Path, rows: int, said: str) -> None:
    with pytest.raises(RasterError, match=said), rows_written(tmp_path / "rows.tif", PLACE) as put:
        put(np.zeros((rows, COLUMNS), np.float32))
    assert list(tmp_path.iterdir()) == []


def test_where_nothing_can_be_written_is_said_before_the_first_row_is_asked_for(tmp_path: Path) -> None:
    asked = False
    with pytest.raises(RasterError, match="cannot be written"), rows_written(tmp_path / "none" / "rows.tif", PLACE):
        asked = True
    assert not asked


def test_rows_of_another_width_are_refused(tmp_path: Path) -> None:
    with pytest.raises(RasterError, match="290 cells, not 531"), rows_written(tmp_path / "rows.tif", PLACE) as put:
        put(np.zeros((COLUMNS, ROWS), np.float32))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("short", [1, 100, 5000])
def test_a_file_that_is_cut_short_as_it_is_closed_replaces_no_other(tmp_path: Path, heights: F32, short: int) -> None:
    with rows_written(tmp_path / "rows.tif", PLACE) as put:
        put(heights)
    size = (tmp_path / "rows.tif").stat().st_size
    (tmp_path / "rows.tif").write_bytes(b"the one before")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size - short, before[1]))
    try:
        with pytest.raises(RasterError), rows_written(tmp_path / "rows.tif", PLACE) as put:
            put(heights)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (tmp_path / "rows.tif").read_bytes() == b"the one before"
    assert [path.name for path in tmp_path.iterdir()] == ["rows.tif"]


def test_a_new_file_replaces_none_that_came_meanwhile(tmp_path: Path, heights: F32) -> None:
    with (  # noqa: PT012
        pytest.raises(RasterError, match="made meanwhile"),
        rows_written(tmp_path / "rows.tif", PLACE, is_new=True) as put,
    ):
        put(heights)
        (tmp_path / "rows.tif").write_bytes(b"mine")
    assert (tmp_path / "rows.tif").read_bytes() == b"mine"
    with rows_written(tmp_path / "new.tif", PLACE, is_new=True) as put:
        put(heights)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new.tif", "rows.tif"]
