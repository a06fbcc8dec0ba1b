"""The two stages beside the slow rule, and their false alarms and detections on a million cells of noise."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from mapping.errors import ParameterError
from mapping.radar.cfar import Cfar, Stage, doppler_stage, peaks, range_stage
from mapping.radar.fft import Window, doppler_fft, range_fft, window, windowed
from tests.mapping.radar.cfar_maps import ca_along_doppler, caso_along_range
from tests.mapping.radar.echoes import noise
from tests.reference import cfar as slow

SET = 1e-3
SINGLE = 1e-5
"""More than sums in single precision are wrong by."""
RANGE = range_stage(Cfar(4, 8, SET), name="rectangular", samples=1000, padding=1, looks=1)
DOPPLER = doppler_stage(Cfar(2, 4, SET), name="rectangular", chirps=1000, padding=1, looks=1)


def maps(rows: int, cols: int) -> st.SearchStrategy[np.ndarray]:
    return arrays.arrays(np.float32, (rows, cols), elements=st.floats(0.0, 100.0, width=32))


def ones_but(cell: int) -> np.ndarray:
    power = np.ones((1, 40), np.float32)
    power[0, cell] = 0.0
    return power


@settings(max_examples=40, deadline=None)
@given(maps(3, 40), st.integers(0, 2), st.integers(1, 3), st.integers(1, 2))
@example(ones_but(1), 0, 1, 2)
@example(ones_but(2), 0, 1, 2)
def test_smallest_of_is_the_slow_rule(power: np.ndarray, guard: int, training: int, stride: int) -> None:
    stage = Stage(guard, training, stride, 2.0)

    def slowly(factor: float) -> np.ndarray:
        return np.array([slow.caso([float(x) for x in row], guard, training, stride, factor) for row in power])

    assert_alike(caso_along_range(power, stage), slowly)


@settings(max_examples=40, deadline=None)
@given(maps(20, 2), st.integers(0, 2), st.integers(1, 3), st.integers(1, 2))
def test_cell_averaging_is_the_slow_rule(power: np.ndarray, guard: int, training: int, stride: int) -> None:
    stage = Stage(guard, training, stride, 2.0)

    def slowly(factor: float) -> np.ndarray:
        return np.array([slow.ca([float(x) for x in row], guard, training, stride, factor) for row in power.T]).T

    assert_alike(ca_along_doppler(power, stage), slowly)


def assert_alike(ours: np.ndarray, slowly: Callable[[float], np.ndarray]) -> None:
    """But for cells at the threshold itself, where single and double precision may differ."""
    beyond_doubt, perhaps = slowly(2.0 * (1 + SINGLE)), slowly(2.0 * (1 - SINGLE))
    assert not (beyond_doubt & ~ours).any()
    assert not (ours & ~perhaps).any()


def test_false_alarms_of_each_stage_alone_over_a_million_cells() -> None:
    power = np.random.default_rng(5).exponential(size=(1000, 1000)).astype(np.float32)
    assert caso_along_range(power, RANGE).mean() == pytest.approx(SET, rel=0.2)
    assert ca_along_doppler(power, DOPPLER).mean() == pytest.approx(SET, rel=0.2)


@pytest.mark.parametrize(("name", "looks"), [("rectangular", 1), ("hann", 2), ("hann", 12)])
def test_false_alarms_at_both_ends_of_the_range_are_as_set(name: Window, looks: int) -> None:
    """Of cells 0 to 16, whose nearer side begins beyond zero, and of as many at the far end."""
    stage = range_stage(Cfar(4, 8, 1e-2), name=name, samples=64, padding=2, looks=looks)
    near, far, blocks = 0.0, 0.0, 3
    for seed in range(blocks):
        white = noise((40_000 // looks, looks, 64), seed)
        bins = range_fft(windowed(white, window(name, 64), np.ones(len(white), np.float32)), 128)
        above = caso_along_range(np.mean(np.abs(bins) ** 2, axis=1).astype(np.float32), stage)
        near, far = near + above[:, :34].mean() / blocks, far + above[:, -34:].mean() / blocks
    assert near == pytest.approx(1e-2, rel=0.1)
    assert far == pytest.approx(1e-2, rel=0.1)


@pytest.mark.parametrize("cell", range(7, 15))
def test_the_direct_coupling_is_in_nobodys_neighbourhood(cell: int) -> None:
    power = np.ones((1, 60), np.float32)
    power[0, [0, 1, 2, 3, 57, 58, 59]] = 1e6
    power[0, cell + 5 : cell + 12] = 1e4
    power[0, cell] = 30.0
    assert caso_along_range(power, RANGE)[0, cell]


@pytest.mark.parametrize("snr_db", [0.0, 10.0, 20.0])
def test_detections_are_as_likely_as_the_closed_form_says(snr_db: float) -> None:
    rng, snr = np.random.default_rng(7), 10 ** (snr_db / 10)
    power = rng.exponential(size=(13, 20_000)).astype(np.float32)
    power[6] *= 1.0 + snr
    assert ca_along_doppler(power, DOPPLER)[6].mean() == pytest.approx(
        slow.ca_detection(8, DOPPLER.factor, snr), abs=0.015
    )


def test_the_smaller_side_keeps_a_target_beside_clutter() -> None:
    power = np.ones((1, 60), np.float32)
    power[0, 30:] = 1000.0
    power[0, 24] = 100.0
    assert caso_along_range(power, RANGE)[0, 24]
    assert not ca_along_doppler(power.T, DOPPLER)[24, 0], "averaging over both sides would lose it"


@settings(max_examples=40, deadline=None)
@given(maps(12, 26), st.integers(0, 25), st.integers(0, 26))
def test_peaks_are_those_of_both_maps(power: np.ndarray, first: int, last: int) -> None:
    along, across = Stage(1, 3, 1, 1.5), Stage(1, 2, 1, 1.4)
    cells, noise = peaks(power, along, across, first, last)
    above = caso_along_range(power, along) & ca_along_doppler(power, across)
    found = {(int(d), int(c)) for d, c in cells}
    assert all(above[d, c] and first <= c < last for d, c in found)
    assert len(noise) == len(found)
    padded = np.pad(np.pad(power, ((1, 1), (0, 0)), mode="wrap"), ((0, 0), (1, 1)), constant_values=-1.0)
    around = np.max(
        [np.roll(padded, (i, j), (0, 1)) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0)], axis=0
    )[1:-1, 1:-1]
    strictly = {(int(d), int(c)) for d, c in np.argwhere(above & (power > around)) if first <= c < last}
    assert strictly <= found
    assert all(power[d, c] >= around[d, c] for d, c in found)


def test_of_two_equal_neighbours_one_is_the_peak() -> None:
    power = np.full((16, 40), 0.01, np.float32)
    power[3, 20] = power[3, 21] = power[15, 5] = power[0, 5] = 50.0
    cells, _ = peaks(power, RANGE, doppler_stage(Cfar(2, 4), name="hann", chirps=16, padding=1, looks=1), 0, 40)
    assert sorted(map(tuple, cells.tolist())) in ([(3, 20), (15, 5)], [(0, 5), (3, 20)])


@pytest.mark.parametrize("looks", [1, 12])
@pytest.mark.parametrize("name", ["rectangular", "hann"])
def test_windows_and_padding_leave_the_false_alarms_as_set(name: Window, looks: int) -> None:
    w = window(name, 64), window(name, 32)
    counts = np.zeros(2)
    frames = 60
    along = range_stage(Cfar(4, 8, 1e-2), name=name, samples=64, padding=2, looks=looks)
    across = doppler_stage(Cfar(2, 4, 1e-2), name=name, chirps=32, padding=2, looks=looks)
    for seed in range(frames):
        bins = doppler_fft(range_fft(windowed(noise((32, looks, 64), seed), *w), 128), 64)
        power = np.mean(np.abs(bins) ** 2, axis=1).astype(np.float32)
        counts += caso_along_range(power, along).mean(), ca_along_doppler(power, across).mean()
    np.testing.assert_allclose(counts / frames, 1e-2, rtol=0.1)


@pytest.mark.parametrize(("guard", "training"), [(-1, 4), (2, 0), (20, 20)])
def test_too_few_cells_are_named(guard: int, training: int) -> None:
    with pytest.raises(ParameterError, match="CFAR along range"):
        range_stage(Cfar(guard, training), name="hann", samples=64, padding=1, looks=1)
    with pytest.raises(ParameterError, match="CFAR along Doppler"):
        doppler_stage(Cfar(guard, training), name="hann", chirps=64, padding=1, looks=1)
