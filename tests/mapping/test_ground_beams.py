"""Known ground as a radar sees it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.geometry.arrays import F64, Bools
from mapping.geometry.frames import attitude_rotation
from mapping.perceiving.ground import GroundGrid, ground_grid
from mapping.perceiving.ground_beams import BeamShape
from tests.reference.ground import flat_ground_area, flat_ground_gap

SHAPE = BeamShape()
TO_CELL = np.array([[0.0, -2.0, 200.0], [2.0, 0.0, 200.0]])
"""200 m x 200 m, the origin in the middle."""
LEVEL = np.eye(3)
slack_m = SHAPE.slack_cells * SHAPE.range_cell_m


def flat(up_m: float = 0.0) -> np.ndarray:
    return np.full((400, 400), up_m, np.float32)


def seen(
    grid: GroundGrid, azimuth: float, range_m: float, *, up: float = 0.0, R: np.ndarray = LEVEL
) -> tuple[float, float]:
    fan = grid.fan((0.0, 0.0, up), R, farthest_m=range_m)
    gaps, areas = fan.look(np.array([azimuth]), np.array([range_m]))
    return float(gaps[0]), float(areas[0])


def explains_beams(
    grid: GroundGrid, origin_enu: tuple[float, float, float], R_enu_body: F64, azimuth_rad: F64, range_m: F64
) -> Bools:
    """(N,) Whether each target's beam cell meets the surface."""
    fan = grid.fan(origin_enu, R_enu_body, farthest_m=float(range_m.max()))
    return fan.look(azimuth_rad, range_m)[0] <= 0.0


@given(st.floats(3, 12), st.floats(14, 80), st.floats(-0.7, 0.7))
def test_flat_ground(height_m: float, range_m: float, azimuth: float) -> None:
    gap, area = seen(ground_grid(flat(), TO_CELL), azimuth, range_m, up=height_m)
    expected = flat_ground_gap(height_m, range_m, slack_m, 0.0)
    one_cell = expected - flat_ground_gap(height_m, range_m + 2.0, slack_m, 0.0)
    assert gap == pytest.approx(expected, abs=one_cell + 0.01)
    cell = math.floor(range_m / 0.5) * 0.5
    half = SHAPE.beam_half_sine / math.cos(azimuth) + SHAPE.azimuth_error_rad
    per_cell = flat_ground_area(height_m, cell, cell + 0.5, 2 * half, SHAPE.down_6db_rad)
    assert 0.6 * per_cell < area < 2.5 * per_cell + 0.02, "cells are filled in steps, and the fullest neighbour counts"


def test_ground_that_is_nearer_than_the_height_is_no_ground() -> None:
    assert seen(ground_grid(flat(), TO_CELL), 0.0, 5.0, up=8.0) == (math.inf, 0.0)


def test_a_hillside_ahead_meets_the_gate() -> None:
    """27 degrees, 5 m below the radar: level with it 10 m ahead."""
    north = 100 - (np.arange(400) + 0.5) * 0.5
    up = np.broadcast_to((np.maximum(north, 0) * 0.5)[:, None], (400, 400)).astype(np.float32)
    grid = ground_grid(up, TO_CELL)
    met = explains_beams(grid, (0, 0, 5.0), LEVEL, np.zeros(4), np.array([6.0, 10.5, 14.0, 20.0]))
    np.testing.assert_array_equal(met, [False, True, True, True])
    behind = attitude_rotation(math.pi, 0, 0)
    assert not explains_beams(grid, (0, 0, 5.0), behind, np.zeros(1), np.array([20.0]))[0]


@pytest.mark.parametrize(("pitch_deg", "met"), [(0.0, False), (-12.0, True), (12.0, False)])
def test_the_gate_tilts_with_the_attitude(pitch_deg: float, met: bool) -> None:
    """Nose down by 12 degrees the gate looks at flat ground 5 m below from 24 m on."""
    grid = ground_grid(flat(), TO_CELL)
    R = attitude_rotation(0.0, math.radians(pitch_deg), 0.0)
    assert explains_beams(grid, (0, 0, 5.0), R, np.zeros(1), np.array([30.0]))[0] == met


def test_a_roll_lowers_the_gate_on_one_side() -> None:
    grid = ground_grid(flat(), TO_CELL)
    R = attitude_rotation(0.0, 0.0, math.radians(20.0))
    met = explains_beams(grid, (0, 0, 5.0), R, np.radians([-40.0, 40.0]), np.array([40.0, 40.0]))
    np.testing.assert_array_equal(met, [False, True])


def test_what_stands_behind_a_ridge_is_out_of_sight() -> None:
    up = flat()
    up[160:162, :] = 6.0  # 19 to 20 m north
    up[120, :] = 5.0  # 39.5 m north, lower as seen from 5 m
    grid = ground_grid(up, TO_CELL)
    assert seen(grid, 0.0, 19.2, up=5.0)[0] == 0.0
    assert seen(grid, 0.0, 39.7, up=5.0) == (math.inf, 0.0)


def test_unknown_ground_is_not_expected() -> None:
    assert seen(ground_grid(flat(math.nan), TO_CELL), 0.0, 20.0, up=5.0) == (math.inf, 0.0)


def test_a_known_wall_is_expected_with_its_area() -> None:
    up = flat()
    up[158:160, :] = 10.0  # from 20 m north on
    gap, area = seen(ground_grid(up, TO_CELL), 0.0, 20.2, up=5.0)
    assert gap == 0.0
    width = 2 * (SHAPE.beam_half_sine + SHAPE.azimuth_error_rad) * 20
    assert 3.0 * width < area < 10.0 * width
