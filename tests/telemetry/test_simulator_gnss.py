"""Errors of the simulated vehicle's position estimate."""

import numpy as np
import pytest

from telemetry.simulation.simulator.airframe.gnss import RECEIVERS, Gnss, GnssKind


def errors(kind: GnssKind, seed: int, samples: int, every_s: float) -> np.ndarray:
    gnss = Gnss(kind, np.random.default_rng(seed))
    out = []
    for _ in range(samples):
        for _ in range(10):
            gnss.step(every_s / 10)
        out.append(gnss.error_neu)
    return np.array(out)


def test_half_of_standalone_fixes_are_within_two_and_a_half_metres() -> None:
    error = errors("standalone", 0, 4000, 60.0)
    assert np.median(np.hypot(error[:, 0], error[:, 1])) == pytest.approx(2.5, rel=0.15)


def test_rtk_is_good_to_centimetres() -> None:
    error = errors("rtk", 1, 3000, 20.0)
    assert error.std(axis=0) == pytest.approx([0.035, 0.035, 0.05], rel=0.2)
    assert np.abs(error).max() < 0.3


def test_perfect_is() -> None:
    assert not errors("perfect", 2, 10, 1.0).any()


def test_errors_drift_instead_of_jumping() -> None:
    error = errors("standalone", 3, 2000, 0.2)
    steps = np.linalg.norm(np.diff(error, axis=0), axis=1) / 0.2
    assert steps.max() < 0.5


@pytest.mark.parametrize("kind", list(RECEIVERS))
def test_the_same_seed_gives_the_same_errors(kind: GnssKind) -> None:
    assert np.array_equal(errors(kind, 4, 20, 1.0), errors(kind, 4, 20, 1.0))


def test_what_a_receiver_claims_goes_with_how_good_it_is() -> None:
    assert RECEIVERS["rtk"].h_acc_m < RECEIVERS["standalone"].h_acc_m
    assert RECEIVERS["rtk"].satellites > RECEIVERS["standalone"].satellites
