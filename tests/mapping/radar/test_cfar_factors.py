"""CFAR's factors beside the closed forms and beside simulated noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.errors import ParameterError
from mapping.radar.cfar_factors import ca_detection, ca_factor, caso_factor, caso_false_alarm, worth
from mapping.radar.fft import noise_correlation
from tests.reference import cfar as slow

cells = st.integers(1, 40)
probabilities = st.floats(1e-8, 0.5)


@given(cells, probabilities)
def test_cell_averaging_is_the_closed_form(n: int, p: float) -> None:
    assert slow.ca_false_alarm(n, ca_factor(n, p)) == pytest.approx(p, rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(cells, probabilities)
def test_smallest_of_is_the_closed_form(n: int, p: float) -> None:
    assert slow.caso_false_alarm(n, caso_factor(n, p)) == pytest.approx(p, rel=1e-4)


@settings(max_examples=25, deadline=None)
@given(cells, probabilities, st.integers(1, 12))
def test_the_smaller_side_asks_for_more_and_more_looks_for_less(n: int, p: float, looks: int) -> None:
    assert caso_factor(n, p, looks) >= ca_factor(n, p, looks)
    if p < 0.1:
        assert ca_factor(n, p, looks + 1) < ca_factor(n, p, looks)
        assert caso_factor(n, p, looks + 1) < caso_factor(n, p, looks)


@pytest.mark.parametrize("looks", [1, 2, 12])
def test_several_looks_beside_simulated_noise(looks: int) -> None:
    rng, tries, n = np.random.default_rng(4), 400_000, 6
    here = rng.gamma(looks, size=tries)
    sides = rng.gamma(looks * n, size=(2, tries)) / n
    smaller = np.mean(here > caso_factor(n, 1e-2, looks) * sides.min(axis=0))
    average = np.mean(here > ca_factor(2 * n, 1e-2, looks) * sides.mean(axis=0))
    assert smaller == pytest.approx(1e-2, rel=0.06)
    assert average == pytest.approx(1e-2, rel=0.06)


def test_certain_alarm_without_a_threshold() -> None:
    assert caso_false_alarm(8, 0.0, 3) == pytest.approx(1.0, rel=1e-6)
    assert ca_detection(16, 0.0, 5.0) == 1.0


def test_detection_begins_at_the_false_alarm_probability_and_grows() -> None:
    factor = ca_factor(16, 1e-3)
    seen = [ca_detection(16, factor, snr) for snr in (0.0, 1.0, 10.0, 100.0)]
    assert seen[0] == pytest.approx(1e-3)
    assert seen == sorted(seen)
    assert seen[-1] > 0.9


def test_cells_alike_are_worth_less() -> None:
    assert worth(noise_correlation("rectangular", 64, 8), 8) == pytest.approx(8.0)
    assert 4.0 < worth(noise_correlation("hann", 64, 8), 8) < 5.0
    assert worth(np.ones(7), 8) == pytest.approx(1.0)


@pytest.mark.parametrize(("n", "p", "looks"), [(0, 1e-3, 1), (8, 0.0, 1), (8, 1.0, 1), (8, -1.0, 1), (8, 1e-3, 0)])
def test_numbers_without_sense(n: int, p: float, looks: int) -> None:
    for factor in (ca_factor, caso_factor):
        with pytest.raises(ParameterError, match="false-alarm"):
            factor(n, p, looks)
