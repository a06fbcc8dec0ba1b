"""The two transforms beside the sum that defines them, and what windows do to echoes and noise."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.errors import ParameterError
from mapping.radar.fft import Window, doppler_fft, noise_correlation, range_fft, window, windowed
from tests.mapping.radar.echoes import noise
from tests.reference.fmcw import transform


def test_both_transforms_are_the_slow_sums() -> None:
    cube = noise((3, 2, 5), seed=2).astype(np.complex64)
    plain = windowed(cube, window("rectangular", 5), window("rectangular", 3))
    ours = doppler_fft(range_fft(plain, 8), 4)
    assert ours.shape == (4, 2, 8)
    assert ours.dtype == np.complex64
    for antenna in range(2):
        rows = np.array([transform(list(chirp), 8) for chirp in cube[:, antenna]])
        slow = np.array([transform(list(column), 4) for column in rows.T]).T
        np.testing.assert_allclose(ours[:, antenna], slow, atol=1e-6)


@settings(max_examples=30)
@given(st.sampled_from(["rectangular", "hann"]), st.integers(4, 40), st.integers(1, 3), st.data())
def test_a_unit_echo_is_1_whatever_window_and_padding(
    name: Window, count: int, padding: int, data: st.DataObject
) -> None:
    cell = data.draw(st.integers(0, count - 1))
    cube = np.exp(2j * np.pi * cell * np.arange(count) / count)[None, None, :]
    spectrum = np.abs(range_fft(windowed(cube, window(name, count), window(name, 1)), count * padding))
    assert spectrum[0, 0, cell * padding] == pytest.approx(1.0, abs=1e-5)
    assert spectrum.max() == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(("name", "least_db"), [("rectangular", 13.0), ("hann", 31.0)])
def test_side_lobes_are_as_far_down_as_they_should(name: Window, least_db: float) -> None:
    response_db = 20 * np.log10(np.abs(np.fft.fft(window(name, 64), 64 * 32)) + 1e-12)
    first_null = 32 * (1 if name == "rectangular" else 2)
    highest_db = response_db[first_null : 64 * 16].max()
    assert least_db <= -highest_db <= least_db + 1.0


def test_noise_is_as_alike_between_cells_as_foretold() -> None:
    spectra = range_fft(windowed(noise((20_000, 1, 32), seed=3), window("hann", 32), np.ones(20_000, np.float32)), 32)[
        :, 0
    ]
    foretold = noise_correlation("hann", 32)
    for lag in (0, 1, 2, 3):
        shared = np.mean(spectra[:, 10 + lag] * spectra[:, 10].conj())
        power = np.mean(np.abs(spectra[:, 10]) ** 2) * np.mean(np.abs(spectra[:, 10 + lag]) ** 2)
        assert shared / np.sqrt(power) == pytest.approx(foretold[lag], abs=0.02)
    np.testing.assert_allclose(noise_correlation("rectangular", 32)[1:], 0.0, atol=1e-12)


def test_an_unknown_window_is_named() -> None:
    with pytest.raises(ParameterError, match="kaiser"):
        window("kaiser", 8)  # type: ignore[arg-type]
