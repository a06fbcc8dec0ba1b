"""Rays of sight against the surface model, compared with asking every column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from planning.terrain.raycast import raycast
from tests.reference.raycast import first_touch

UTM = CRS.from_epsg(32633)


def model(elevation: np.ndarray, resolution_m: float = 0.5) -> Dsm:
    return Dsm(
        elevation_m=elevation.astype(np.float32),
        transform=Affine(resolution_m, 0, 500_000, 0, -resolution_m, 4_000_000),
        crs=UTM,
        vertical_datum=None,
        sha256="0" * 64,
    )


def at(east_m: float, north_m: float, alt_m: float) -> np.ndarray:
    return np.array([500_000 + east_m, 4_000_000 + north_m, alt_m])


STEPPED = model(np.array([[1, 2, 3, 4], [1, 9, np.nan, 4], [1, 2, 3, 4]]))


def test_straight_down_meets_the_top_of_the_cell_below() -> None:
    hit = raycast(STEPPED, at(0.75, -0.75, 50), np.array([0.0, 0.0, -2.0]), floor_alt_dsm_m=0.0)
    assert hit is not None
    assert hit.known
    assert (hit.x_m, hit.y_m, hit.alt_dsm_m) == pytest.approx((500_000.75, 3_999_999.25, 9.0))
    assert hit.distance == pytest.approx(20.5)


def test_a_hit_on_a_wall_lies_inside_the_cell_that_was_hit() -> None:
    hit = raycast(STEPPED, at(-5, -0.75, 6), np.array([1.0, 0.0, 0.0]), floor_alt_dsm_m=0.0)
    assert hit is not None
    assert hit.known
    assert hit.alt_dsm_m == pytest.approx(6.0)
    assert STEPPED.elevation_at(np.array([[hit.x_m, hit.y_m]]))[0] == 9.0
    assert hit.x_m == pytest.approx(500_000.5, abs=1e-3)


@pytest.mark.parametrize("east_m", [1.25, 40.0], ids=["unknown cell", "outside"])
def test_the_floor_stands_for_what_is_not_known(east_m: float) -> None:
    hit = raycast(STEPPED, at(east_m, -0.75, 50), np.array([0.0, 0.0, -1.0]), floor_alt_dsm_m=0.5)
    assert hit is not None
    assert not hit.known
    assert hit.alt_dsm_m == pytest.approx(0.5)


def test_a_look_into_the_sky_meets_nothing() -> None:
    assert raycast(STEPPED, at(1, -1, 50), np.array([0.3, 0.1, 0.2]), floor_alt_dsm_m=0.0) is None


@pytest.mark.parametrize(
    "direction", [[0.0, 0.0, 0.0], [np.nan, 0.0, 1.0], [np.inf, 0.0, 1.0]], ids=["none", "nan", "infinite"]
)
def test_a_ray_without_direction_is_refused(direction: list[float]) -> None:
    with pytest.raises(ParameterError, match="finite origin and direction"):
        raycast(STEPPED, at(0, 0, 0), np.array(direction), floor_alt_dsm_m=0.0)


@settings(max_examples=300, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), aligned=st.booleans())
def test_the_walk_finds_what_asking_every_column_finds(seed: int, aligned: bool) -> None:
    random = np.random.default_rng(seed)
    elevation = random.uniform(0, 6, (random.integers(1, 9), random.integers(1, 9)))
    elevation[random.random(elevation.shape) < 0.2] = np.nan
    dsm = model(elevation)
    origin = at(*random.uniform([-4, -8, -2], [8, 4, 12]))
    target = at(*random.uniform([0, -4, -1], [4, 0, 5]))
    direction = (target - origin) * random.uniform(0.1, 3)
    if aligned:
        direction[random.integers(0, 2)] = 0.0
    hit = raycast(dsm, origin, direction, floor_alt_dsm_m=-0.5)
    expected = first_touch(dsm, origin, direction, -0.5)
    if expected is None or hit is None:
        assert hit is None
        assert expected is None
        return
    assert hit.distance == pytest.approx(expected[0], abs=1e-6)
    assert hit.known == expected[1]
    place = origin + hit.distance * direction
    assert np.allclose([hit.x_m, hit.y_m, hit.alt_dsm_m], place, atol=2e-3 * dsm.resolution_m)


def test_a_model_on_disk_is_read_in_place(tmp_path: Path) -> None:
    height = np.arange(10_000, dtype=np.float32).reshape(100, 100) / 100
    np.save(tmp_path / "model.npy", height)
    dsm = model(np.zeros((1, 1)))
    mapped = Dsm(np.load(tmp_path / "model.npy", mmap_mode="r"), dsm.transform, UTM, None, "0" * 64)
    hit = raycast(mapped, at(25.25, -25.25, 500), np.array([0.0, 0.0, -1.0]), floor_alt_dsm_m=-1.0)
    assert hit is not None
    assert hit.alt_dsm_m == pytest.approx(height[50, 50])
