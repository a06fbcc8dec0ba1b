"""Known ground around home: where cells come to lie, what is lost, what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyproj import CRS, Transformer

from mapping.geometry.frames import LocalFrame
from telemetry.perception.known_ground import GroundError, ground_around
from telemetry.topics.obstacles import GroundNotice, MapOrigin

UTM = CRS.from_epsg(32633)
LAT_DEG, LON_DEG = 47.0, 13.5
X_M, Y_M = Transformer.from_crs(4326, 32633, always_xy=True).transform(LON_DEG, LAT_DEG)
HOME = MapOrigin(LAT_DEG, LON_DEG, 700.0)


def notice(path: Path, heights: np.ndarray, cell_m: float) -> GroundNotice:
    """A model with home in its middle."""
    np.save(path, heights.astype(np.float32))
    rows, cols = heights.shape
    return GroundNotice(
        "t", "Model", str(path), UTM.to_wkt(), X_M - cols / 2 * cell_m, Y_M + rows / 2 * cell_m, cell_m, "a" * 64
    )


def at(lat_lon: tuple[float, float]) -> np.ndarray:
    return LocalFrame(LAT_DEG, LON_DEG, 700.0).to_enu(*lat_lon, 700.0)[0]


def test_a_mast_stands_where_it_is_and_home_at_zero(tmp_path: Path) -> None:
    heights = np.full((400, 400), 812.5)
    heights[40, 300] = 842.5
    grid = ground_around(notice(tmp_path / "a.npy", heights, 0.5), HOME)
    x, y = X_M + 100.5 * 0.5, Y_M + 159.5 * 0.5
    lon, lat = Transformer.from_crs(32633, 4326, always_xy=True).transform(x, y)
    place = at((lat, lon))
    assert grid.up(np.array([place[:2], [0.0, 0.0]])) == pytest.approx([30.0, 0.0], abs=1e-3)
    assert np.isnan(grid.up([[150.0, 0.0]])).all()


@pytest.mark.parametrize("cell_m", [0.05, 0.1, 0.12])
def test_of_fine_cells_the_highest_stays(tmp_path: Path, cell_m: float) -> None:
    rng = np.random.default_rng(3)
    heights = rng.uniform(100, 103, (600, 600))
    heights[298:303, 298:303] = 100.0
    heights[123, 456] = 140.0
    grid = ground_around(notice(tmp_path / "a.npy", heights, cell_m), HOME)
    assert grid.cell_m <= 0.25 + 1e-6
    assert np.nanmax(grid.up_m) == pytest.approx(40.0, abs=0.01)
    assert grid.up_m.size < heights.size / 3


def test_only_a_window_around_home_is_taken(tmp_path: Path) -> None:
    """In degrees of convergence, too: the grid of the projection is turned against north."""
    grid = ground_around(notice(tmp_path / "a.npy", np.full((1500, 1500), 5.0), 4.0), HOME)
    assert grid.up_m.size < 540**2
    assert grid.up([[990.0, 990.0], [-990.0, -990.0]]) == pytest.approx([0.0, 0.0])
    assert np.isnan(grid.up([[1100.0, 0.0]])).all()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"elevation_npy": "/nowhere/a.npy"}, "cannot be read"),
        ({"crs_wkt": "nonsense"}, "reference system"),
        ({"resolution_m": 0.0}, "are none"),
        ({"west_m": float("nan")}, "are none"),
        ({"west_m": X_M + 1000.0}, "Home does not lie"),
    ],
)
def test_what_is_no_ground_is_said(tmp_path: Path, changes: dict[str, object], words: str) -> None:
    good = notice(tmp_path / "a.npy", np.zeros((20, 20)), 1.0)
    with pytest.raises(GroundError, match=words):
        ground_around(replace(good, **changes), HOME)


def test_unknown_ground_under_home_and_foreign_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(GroundError, match="Home does not lie"):
        ground_around(notice(tmp_path / "a.npy", np.full((20, 20), np.nan), 1.0), HOME)
    bad = notice(tmp_path / "b.npy", np.zeros((20, 20)), 1.0)
    np.save(bad.elevation_npy, np.zeros(20))
    with pytest.raises(GroundError, match="float64"):
        ground_around(bad, HOME)
    Path(bad.elevation_npy).write_text("hello")
    with pytest.raises(GroundError, match="cannot be read"):
        ground_around(bad, HOME)
