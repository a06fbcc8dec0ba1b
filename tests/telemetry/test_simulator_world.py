"""The ground of the simulated world."""

import numpy as np
import pytest
from affine import Affine
from pyproj import CRS

from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from telemetry.simulation.simulator.ground_below import FlatGround, SurfaceGround
from telemetry.simulation.simulator.neu_frame import NeuFrame

CELL_M = 2.0
HEIGHTS = np.arange(100 * 100, dtype=np.float32).reshape(100, 100) / 100


def model(elevation_m: np.ndarray) -> tuple[Dsm, NeuFrame]:
    """A grid and a frame in its middle, on cell (50, 50)."""
    transform = Affine(CELL_M, 0, 1_800_000, 0, -CELL_M, 5_900_000)
    dsm = Dsm(elevation_m, transform, CRS.from_epsg(2193), None, "")
    lat, lon = dsm.lat_lon_from_xy(np.array([[1_800_000 + 50.5 * CELL_M, 5_900_000 - 50.5 * CELL_M]]))[0]
    return dsm, NeuFrame(float(lat), float(lon), 800.0)


def test_flat_ground_is_at_the_origins_height_everywhere() -> None:
    assert FlatGround().up_m(1e4, -1e4) == 0


def test_the_surface_is_shifted_to_the_origins_height() -> None:
    ground = SurfaceGround(*model(HEIGHTS.copy()))
    assert ground.up_m(0, 0) == 0
    # One row further north is 100 cells less, 20 columns further east 20 more.
    assert ground.up_m(10 * CELL_M, 20 * CELL_M) == pytest.approx(-10 * 1.0 + 20 * 0.01, abs=0.02)


def test_where_nothing_is_known_the_ground_is_the_lowest() -> None:
    heights = HEIGHTS.copy()
    heights[40, 50] = np.nan
    ground = SurfaceGround(*model(heights))
    assert ground.up_m(10 * CELL_M, 0) == pytest.approx(-50.5)
    assert ground.up_m(5000, 0) == pytest.approx(-50.5)


def test_a_home_without_height_is_refused() -> None:
    heights = HEIGHTS.copy()
    heights[50, 50] = np.nan
    with pytest.raises(ParameterError, match="knows no height at"):
        SurfaceGround(*model(heights))
