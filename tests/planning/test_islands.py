"""Roofs and crowns told from ground: by what is lower around them, whatever stands on them or leans against them."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.traversability import traversability_map
from planning.ground.islands import Islands
from planning.ground.traversable import traversable_ground
from planning.terrain.geotiff import read_dsm

CELL_M = 0.5
MIDDLE = (120, 120)


def grid_m() -> tuple[np.ndarray, np.ndarray]:
    """South and east of the middle of 120 m of ground."""
    down, right = (np.indices((240, 240)) - 120) * CELL_M
    return down, right


def block(half_m: float, turn_rad: float = 0.0) -> np.ndarray:
    down, right = grid_m()
    across = np.abs(down * math.cos(turn_rad) - right * math.sin(turn_rad))
    along = np.abs(down * math.sin(turn_rad) + right * math.cos(turn_rad))
    return (across <= half_m) & (along <= half_m)


def islands(elevation_m: np.ndarray, cell_m: float = CELL_M) -> Islands:
    return Islands(traversability_map(elevation_m.astype(np.float32), cell_m))


@settings(max_examples=20, deadline=None)
@given(st.floats(4, 40), st.floats(0, math.pi / 2), st.floats(2, 30), st.floats(0, 8), st.integers(0, 1000))
def test_a_roof_is_one_however_it_is_turned_and_the_ground_slopes(
    half_m: float, turn_rad: float, high_m: float, slope_deg: float, seed: int
) -> None:
    down, _ = grid_m()
    elevation_m = np.random.default_rng(seed).normal(0, 0.01, down.shape) + down * math.tan(math.radians(slope_deg))
    elevation_m[block(half_m, turn_rad)] += high_m + 1.5
    found = islands(elevation_m)
    assert found.stands_high(*MIDDLE)
    assert not found.stands_high(5, 5)


def test_chimneys_and_a_higher_house_next_door_do_not_hide_a_roof() -> None:
    elevation_m = np.zeros((240, 240))
    elevation_m[100:140, 100:140] = 6.0
    elevation_m[104:138:8, 104:138:8] = 8.0
    elevation_m[100:140, 140:180] = 15.0
    found = islands(elevation_m)
    assert found.stands_high(110, 110)
    assert found.stands_high(120, 160)


def test_one_cell_of_noise_is_no_path_and_a_broad_one_is() -> None:
    elevation_m = np.where(block(15), 3.0, 0.0)
    elevation_m[120, 150:180] = np.linspace(3.0, 0.0, 30)
    assert islands(elevation_m).stands_high(*MIDDLE)
    elevation_m[110:131, 150:180] = np.linspace(3.0, 0.0, 30)
    assert not islands(elevation_m).stands_high(*MIDDLE)


def test_what_is_ground_although_it_is_fenced() -> None:
    down, _ = grid_m()
    hedged = np.where(block(15), 2.0, 0.0) * ~block(13) + down * math.tan(math.radians(8))
    terraces = -2.0 * np.floor(down / 12 + 0.5)
    on_a_knoll = np.hypot(*grid_m()) * -math.tan(math.radians(9)) + np.where(block(15) & ~block(13), 1.5, 0.0)
    for elevation_m in (hedged, terraces, on_a_knoll):
        assert not islands(elevation_m).stands_high(*MIDDLE)


def test_an_isle_is_no_roof_and_neither_is_what_the_map_cuts_off() -> None:
    isle = np.where(block(52), 2.0, 0.0)
    assert not islands(isle).stands_high(*MIDDLE)
    cliff = np.where(np.arange(240) < 60, 30.0, 0.0) * np.ones((240, 1))
    assert not islands(cliff).stands_high(120, 30)
    alone = np.where(block(10), 5.0, np.nan)
    assert not islands(alone).stands_high(*MIDDLE)


def test_a_spot_too_small_for_a_region_is_not_trusted() -> None:
    elevation_m = np.random.default_rng(3).normal(0, 1.0, (240, 240))
    assert islands(elevation_m).stands_high(*MIDDLE)


@pytest.mark.parametrize("resolution_m", [1.0, 2.0])
def test_roofs_of_a_campus(shared_data: Path, resolution_m: float) -> None:
    ground = traversable_ground(read_dsm(shared_data / "dsm" / "campus" / "dsm.tif"), resolution_m)
    found = Islands(ground.map)

    def high(row_m: float, col_m: float) -> bool:
        return found.stands_high(int(row_m / resolution_m), int(col_m / resolution_m))

    roofs = [(76, 116), (70, 155), (92, 132)]
    lawns = [(45, 68), (70, 62), (140, 90), (150, 90)]
    assert [high(*place) for place in roofs] == [True] * 3
    assert [high(*place) for place in lawns] == [False] * 4
