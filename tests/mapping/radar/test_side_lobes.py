"""Side lobes of strong peaks are dropped, neighbours of their own strength are not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.radar.fft import FINE, Window, envelope, own_peaks, window

RECTANGULAR, HANN = envelope("rectangular", 64), envelope("hann", 64)


@pytest.mark.parametrize("name", ["rectangular", "hann"])
def test_the_envelope_lies_on_the_response(name: Window) -> None:
    lobes = envelope(name, 64)
    response = np.abs(np.fft.fft(window(name, 64), 64 * FINE))[: 32 * FINE + 1] ** 2
    assert lobes[0] == pytest.approx(1.0, abs=1e-5)
    assert np.all(lobes >= response - 1e-7)
    assert np.all(np.diff(lobes) <= 0)
    assert 10 * np.log10(lobes[FINE * 2]) < (-13.0 if name == "rectangular" else -31.0)


@given(st.floats(0, 31), st.floats(0.1, 32), st.sampled_from([RECTANGULAR, HANN]))
def test_two_alike_are_both_kept(place: float, apart: float, lobes: np.ndarray) -> None:
    alike = own_peaks(np.array([1.0, 1.0]), np.zeros(2), np.array([place, place + apart]), HANN, lobes, 2.0)
    assert alike.all()
    nearly = own_peaks(np.array([1.0, 0.9]), np.zeros(2), np.array([0.0, 1.5]), HANN, RECTANGULAR, 2.0)
    assert nearly.all()


@given(st.floats(0, 63), st.floats(0.25, 63))
def test_a_side_lobe_is_dropped_and_a_weak_target_is_not(place: float, away: float) -> None:
    apart = min(away, 64 - away)
    level = RECTANGULAR[int(apart * FINE)]
    ranges = np.array([place, (place + away) % 64])
    assert not own_peaks(np.array([1.0, level]), np.zeros(2), ranges, HANN, RECTANGULAR, 2.0)[1]
    if 1e-9 < level < 0.2:  # at half the ring it is nothing at all
        assert own_peaks(np.array([1.0, 4.0 * level]), np.zeros(2), ranges, HANN, RECTANGULAR, 2.0)[1]


def test_side_lobes_along_one_axis_do_not_hide_what_is_off_both() -> None:
    power, doppler, ranges = np.array([1.0, 1e-3, 1e-3]), np.array([0.0, 0.0, 9.0]), np.array([20.0, 26.0, 26.0])
    np.testing.assert_array_equal(own_peaks(power, doppler, ranges, HANN, RECTANGULAR, 2.0), [True, False, True])


def test_no_peaks() -> None:
    none = np.empty(0)
    assert own_peaks(none, none, none, HANN, HANN, 2.0).shape == (0,)
