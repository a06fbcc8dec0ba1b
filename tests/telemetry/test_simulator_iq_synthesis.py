"""Samples of a simulated FMCW radar against the slow sum, and what must hold of them."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
from telemetry.simulation.simulator.sensors.iq_synthesis import Returns, sampled, strongest
from tests.reference.iq_samples import Scatterer, samples

SMALL = dataclasses.replace(AWR1843, chirps=9, samples=32, sample_rate_hz=AWR1843.sample_rate_hz / 8)
"""The same waveform, taken less often: 16 m."""
PARAMS = {"awr1843": SMALL, "position2go": POSITION2GO}


def returns(scatterers: list[Scatterer]) -> Returns:
    columns = np.array(scatterers, complex).reshape(-1, 5).T
    return Returns(columns[0].real, columns[1].real, columns[2].real, columns[3].real, columns[4])


def drawn(params: FmcwParams, count: int, seed: int, fastest: float) -> list[Scatterer]:
    random = np.random.default_rng(seed)
    return [
        (
            random.uniform(0.05, 0.95) * params.max_range_m,
            random.uniform(-fastest, fastest),
            random.uniform(-1.0, 1.0),
            random.uniform(-0.5, 0.5),
            complex(*random.standard_normal(2)),
        )
        for _ in range(count)
    ]


@pytest.mark.parametrize("name", PARAMS)
@pytest.mark.parametrize(("fastest", "most"), [(0.0, 1e-4), (10.0, 1e-2)])
def test_samples_are_those_of_the_slow_sum(name: str, fastest: float, most: float) -> None:
    params = PARAMS[name]
    echoes = drawn(params, 4, 3, fastest)
    expected = samples(params, echoes)
    made = sampled(params, returns(echoes))
    assert made.shape == params.shape
    assert made.dtype == np.complex64
    assert np.abs(made - expected).max() < most * np.abs(expected).max()


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), factor=st.floats(0.1, 10.0), count=st.integers(0, 5))
def test_echoes_add_up(seed: int, factor: float, count: int) -> None:
    one, two = drawn(SMALL, count, seed, 9.0), drawn(SMALL, 3, seed + 1, 9.0)
    louder = [(*echo[:4], factor * echo[4]) for echo in one]
    together = sampled(SMALL, returns(louder + two))
    apart = factor * sampled(SMALL, returns(one)) + sampled(SMALL, returns(two))
    assert np.abs(together - apart).max() < 1e-4 * (1.0 + np.abs(apart).max())


def test_an_echo_from_beyond_the_ambiguity_does_not_come_back_nearer() -> None:
    far = [(SMALL.max_range_m * 1.1, 0.0, 0.0, 0.0, 1 + 0j)]
    assert not sampled(SMALL, returns(far)).any()
    assert np.abs(sampled(SMALL, returns([(5.0, 0.0, 0.0, 0.0, 1 + 0j)]))) == pytest.approx(1.0, abs=1e-4)


def test_the_strongest_are_kept() -> None:
    loud = returns([(float(k), 0.0, 0.0, 0.0, complex(0.0, strength)) for k, strength in enumerate((3, 1, 5, 2, 4))])
    assert strongest(loud, 5) is loud
    assert sorted(strongest(loud, 3).range_m.tolist()) == [0.0, 2.0, 4.0]
    assert len(strongest(returns([]), 3).range_m) == 0
