"""CFAR's factors beside the closed forms and beside simulated noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.errors import ParameterError
from mapping.radar.cfar_factors import (
    ca_factor,
    ca_false_alarm,
    caso_factor,
    caso_false_alarm,
    weights,
)
from mapping.radar.fft import noise_correlation
from tests.reference import cfar as slow
from tests.reference.cfar import ca_detection, independent

cells = st.integers(1, 40)
probabilities = st.floats(1e-8, 0.5)


@settings(max_examples=60, deadline=None)
@given(cells, probabilities)
def test_cell_averaging_is_the_closed_form(n: int, p: float) -> None:
    assert slow.ca_false_alarm(n, ca_factor(independent(n), p)) == pytest.approx(p, rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(cells, probabilities)
def test_smallest_of_is_the_closed_form(n: int, p: float) -> None:
    assert slow.caso_false_alarm(n, caso_factor(independent(n), p)) == pytest.approx(p, rel=1e-4)


@settings(max_examples=25, deadline=None)
@given(cells, probabilities, st.integers(1, 12))
def test_the_smaller_side_asks_for_more_and_more_looks_for_less(n: int, p: float, looks: int) -> None:
    w = independent(n)
    assert caso_factor(w, p, looks) >= ca_factor(w, p, looks)
    if p < 0.1:
        assert ca_factor(w, p, looks + 1) < ca_factor(w, p, looks)
        assert caso_factor(w, p, looks + 1) < caso_factor(w, p, looks)


@pytest.mark.parametrize("looks", [1, 2, 12])
def test_several_looks_beside_simulated_noise(looks: int) -> None:
    rng, tries, n = np.random.default_rng(4), 400_000, 6
    here = rng.gamma(looks, size=tries)
    sides = rng.gamma(looks * n, size=(2, tries)) / n
    smaller = np.mean(here > caso_factor(independent(n), 1e-2, looks) * sides.min(axis=0))
    average = np.mean(here > ca_factor(independent(2 * n), 1e-2, looks) * sides.mean(axis=0))
    assert smaller == pytest.approx(1e-2, rel=0.06)
    assert average == pytest.approx(1e-2, rel=0.06)


def test_certain_alarm_without_a_threshold() -> None:
    assert caso_false_alarm(independent(8), 0.0, 3) == pytest.approx(1.0, rel=1e-6)
    assert ca_detection(16, 0.0, 5.0) == 1.0


def test_detection_begins_at_the_false_alarm_probability_and_grows() -> None:
    factor = ca_factor(independent(16), 1e-3)
    seen = [ca_detection(16, factor, snr) for snr in (0.0, 1.0, 10.0, 100.0)]
    assert seen[0] == pytest.approx(1e-3)
    assert seen == sorted(seen)
    assert seen[-1] > 0.9


HANN = weights(noise_correlation("hann", 64), range(8))


def test_cells_alike_are_fewer() -> None:
    assert weights(noise_correlation("rectangular", 64), range(8)) == pytest.approx(independent(8))
    assert sum(HANN) == pytest.approx(8.0)
    assert 4.0 < 8.0**2 / sum(w * w for w in HANN) < 5.0, "they are worth as many independent ones"
    assert weights(np.ones(8, complex), range(8)) == pytest.approx((0.0,) * 7 + (8.0,), abs=1e-9)


@pytest.mark.parametrize("looks", [1, 2, 12])
@pytest.mark.parametrize("wanted", [1e-2, 1e-3])
def test_cells_alike_beside_simulated_noise(looks: int, wanted: float) -> None:
    rng, tries = np.random.default_rng(8), 1_000_000
    here = rng.gamma(looks, size=tries)
    sides = np.sum([w * rng.gamma(looks, size=(2, tries)) for w in HANN], axis=0) / 8
    smaller = np.mean(here > caso_factor(HANN, wanted, looks) * sides.min(axis=0))
    average = np.mean(here > ca_factor(HANN, wanted, looks) * sides[0])
    assert smaller == pytest.approx(wanted, rel=0.1)
    assert average == pytest.approx(wanted, rel=0.1)


def test_weights_almost_equal_are_as_good_as_equal() -> None:
    nearly = (0.999, 1.0, 1.0, 1.001, 1.0, 1.0)
    for looks in (1, 3):
        for of in (ca_false_alarm, caso_false_alarm):
            assert of(nearly, 9.0, looks) == pytest.approx(of(independent(6), 9.0, looks), rel=1e-3)


@pytest.mark.parametrize(("n", "p", "looks"), [(0, 1e-3, 1), (8, 0.0, 1), (8, 1.0, 1), (8, -1.0, 1), (8, 1e-3, 0)])
def test_numbers_without_sense(n: int, p: float, looks: int) -> None:
    for factor in (ca_factor, caso_factor):
        with pytest.raises(ParameterError, match="false-alarm"):
            factor(independent(n), p, looks)
