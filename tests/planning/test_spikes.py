"""Isolated spikes and pits: found where planted, nowhere else, and removed without touching the rest."""

import numpy as np
import pytest
from affine import Affine
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import CRS

from mapping.geometry.arrays import F32
from planning.errors import ParameterError
from planning.terrain.dsm import Dsm
from planning.terrain.spikes import find_spikes, remove_spikes

UTM = CRS.from_epsg(32633)


def model(elevation: F32, cell_m: float = 0.5) -> Dsm:
    return Dsm(elevation, Affine(cell_m, 0, 5e5, 0, -cell_m, 4.17e6), UTM, None, "")


def slope(rows: int = 120, columns: int = 140, gradient: float = 0.2) -> F32:
    y, x = np.mgrid[:rows, :columns]
    return (100.0 + gradient * 0.5 * x + np.sin(y / 9.0)).astype(np.float32)


def test_spike_and_pit_with_place_size_and_height() -> None:
    heights = slope()
    heights[40:42, 50] = 150.0
    heights[80, 90] = 60.0
    dsm = model(heights)
    spike, pit = find_spikes(dsm)
    assert (spike.kind, spike.window, spike.size_m) == ("spike", (40, 50, 2, 1), 1.0)
    assert spike.alt_dsm_m == 150.0
    assert spike.height_m == pytest.approx(150.0 - spike.rim_alt_dsm_m)
    assert spike.rim_alt_dsm_m == np.delete(heights[37:45, 47:54].ravel(), [24, 31]).max()
    assert (pit.kind, pit.window, pit.size_m) == ("pit", (80, 90, 1, 1), 0.5)
    place = dsm.xy_from_lat_lon(np.array([[pit.lat_deg, pit.lon_deg]]))
    assert dsm.elevation_at(place)[0] == 60.0


@settings(max_examples=30, deadline=None)
@given(
    row=st.integers(8, 110),
    column=st.integers(8, 130),
    height=st.floats(12.0, 500.0),
    seed=st.integers(0, 2**32 - 1),
)
def test_planted_spikes_are_found_and_removal_is_final(row: int, column: int, height: float, seed: int) -> None:
    heights = slope() + np.random.default_rng(seed).uniform(0, 0.3, (120, 140)).astype(np.float32)
    clean = heights.copy()
    heights[row, column] += height
    dsm = model(heights)
    spikes = find_spikes(dsm)
    assert [spike.window for spike in spikes] == [(row, column, 1, 1)]
    removed = remove_spikes(dsm, spikes)
    assert find_spikes(removed) == ()
    others = np.arange(heights.size) != row * 140 + column
    np.testing.assert_array_equal(removed.elevation_m.ravel()[others], clean.ravel()[others])
    assert clean[row, column] <= removed.elevation_m[row, column] < clean[row, column] + height
    assert dsm.elevation_m[row, column] == heights[row, column]


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_pits_are_the_spikes_of_the_model_upside_down(seed: int) -> None:
    random = np.random.default_rng(seed)
    heights = slope()
    heights[random.integers(0, 120, 6), random.integers(0, 140, 6)] += random.choice([-40.0, 40.0], 6)
    above, below = find_spikes(model(heights)), find_spikes(model(-heights))
    assert sorted(s.window for s in above if s.kind == "spike") == sorted(s.window for s in below if s.kind == "pit")
    assert sorted(s.window for s in above if s.kind == "pit") == sorted(s.window for s in below if s.kind == "spike")


@pytest.mark.parametrize("shape", ["wall", "house", "step", "rough"])
def test_what_is_no_spike(shape: str) -> None:
    heights = slope()
    if shape == "wall":
        heights[60, 20:90] += 20.0
    elif shape == "house":
        heights[50:62, 50:66] += 15.0
    elif shape == "step":
        heights[:, 70:] += 30.0
    else:
        heights += np.random.default_rng(1).uniform(0, 12, heights.shape).astype(np.float32)
    assert find_spikes(model(heights)) == ()


def test_beside_unknown_cells_and_edges() -> None:
    heights = slope()
    heights[:, 60:] = np.nan
    heights[50, 40] = heights[0, 20] = heights[100, 57] = 200.0
    heights[10, 100] = 200.0
    found = {spike.window[:2] for spike in find_spikes(model(heights))}
    assert found == {(50, 40), (0, 20), (100, 57)}


@pytest.mark.parametrize("cell_m", [0.02, 0.1])
def test_fine_models_are_searched_coarsely_but_placed_exactly(cell_m: float) -> None:
    heights = slope(700, 600, gradient=0.02)
    side = round(0.3 / cell_m)
    heights[333 : 333 + side, 271 : 271 + side] += 9.0
    heights[335, 273] += 1.0
    dsm = model(heights, cell_m)
    (spike,) = find_spikes(dsm)
    assert spike.alt_dsm_m == heights.max()
    assert spike.height_m == pytest.approx(10.0, abs=2.1)
    assert spike.size_m <= 1.5
    place = dsm.xy_from_lat_lon(np.array([[spike.lat_deg, spike.lon_deg]]))
    assert dsm.elevation_at(place)[0] == heights.max()
    assert find_spikes(remove_spikes(dsm, (spike,))) == ()


def test_bands_of_rows_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    heights = slope(400, 60)
    for row in range(5, 400, 13):
        heights[row : row + 2, 30] += 50.0
    whole = find_spikes(model(heights))
    monkeypatch.setattr("planning.terrain.spikes._BAND_ROWS", 19)
    assert find_spikes(model(heights)) == whole
    assert len(whole) == len(range(5, 400, 13))


def test_nothing_to_remove_and_impossible_parameters() -> None:
    dsm = model(slope())
    assert remove_spikes(dsm, ()) is dsm
    with pytest.raises(ParameterError, match="greater than 0"):
        find_spikes(dsm, max_size_m=0.0)
    with pytest.raises(ParameterError, match="greater than 0"):
        find_spikes(dsm, min_height_m=float("nan"))
