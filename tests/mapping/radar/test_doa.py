"""Directions of plane waves on both sensors' antennas, and what a wrong Doppler does to them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.errors import ParameterError
from mapping.radar import doa
from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
from tests.reference.fmcw import bearing_eq2, phase_eq3, transform

ROWS = doa.rows_of(AWR1843)


def wave(params: FmcwParams, azimuth_rad: float, elevation_rad: float = 0.0, doppler_hz: float = 0.0) -> doa.C64:
    """(1, antennas) of a far target: nearer antennas lag, later transmitters see it moved."""
    towards = np.array([math.cos(elevation_rad) * math.sin(azimuth_rad), math.sin(elevation_rad)])
    cycles = -params.position_wavelengths @ towards + doppler_hz * params.offset_s
    return np.exp(2j * np.pi * cycles)[None, :].astype(np.complex64)


def test_the_rows_of_the_awr1843() -> None:
    np.testing.assert_array_equal(ROWS.row, range(8))
    np.testing.assert_array_equal(ROWS.slots, range(8))
    np.testing.assert_array_equal(ROWS.other, range(8, 12))
    assert ROWS.spacing == pytest.approx(0.5)
    assert ROWS.lift == pytest.approx(0.5)


def test_the_spectrum_is_the_slow_transform() -> None:
    rng = np.random.default_rng(8)
    snapshot = (rng.normal(size=(1, 12)) + 1j * rng.normal(size=(1, 12))).astype(np.complex64)
    slow = 64 * np.abs(transform(list(snapshot[0, :8].conj()), 16)) ** 2
    np.testing.assert_allclose(doa.azimuth_spectrum(snapshot, ROWS, 16)[0], np.fft.fftshift(slow), rtol=1e-4)


@settings(max_examples=60, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-0.5, 0.5))
def test_azimuth_and_elevation_of_one_target(azimuth: float, elevation: float) -> None:
    snapshot = wave(AWR1843, azimuth, elevation)
    which, right = doa.directions(doa.azimuth_spectrum(snapshot, ROWS, 64), ROWS, 0.5, np.zeros(1))
    np.testing.assert_array_equal(which, [0])
    assert right[0] == pytest.approx(math.cos(elevation) * math.sin(azimuth), abs=0.003)
    assert doa.elevation_sine(snapshot, right, ROWS)[0] == pytest.approx(math.sin(elevation), abs=0.01)


def test_two_targets_in_one_cell() -> None:
    both = (wave(AWR1843, 0.5) + 0.9 * wave(AWR1843, -0.3)).astype(np.complex64)
    which, right = doa.directions(doa.azimuth_spectrum(both, ROWS, 64), ROWS, 0.5, np.zeros(1))
    np.testing.assert_array_equal(which, [0, 0])
    np.testing.assert_allclose(right, [math.sin(-0.3), math.sin(0.5)], atol=0.03)
    alone, _ = doa.directions(doa.azimuth_spectrum(both, ROWS, 64), ROWS, 0.5, np.full(1, 1e9))
    assert len(alone) == 1, "the strongest is kept even where the noise would hide another"


@given(st.floats(-1.5, 1.5))
def test_two_antennas_are_equation_2(azimuth: float) -> None:
    rows = doa.rows_of(POSITION2GO)
    snapshot = wave(POSITION2GO, azimuth)
    phase = float(np.angle(snapshot[0, 0] * snapshot[0, 1].conj()))
    wavelength_m = POSITION2GO.wavelength_m
    assert bearing_eq2(phase, wavelength_m, wavelength_m / 2) == pytest.approx(azimuth, abs=1e-3)
    assert math.asin(doa.phase_direction(snapshot, rows)[0]) == pytest.approx(azimuth, abs=1e-3)


@given(st.floats(-1.0, 1.0), st.floats(-10.0, 10.0))
def test_what_moved_between_transmitters_is_taken_out(azimuth: float, speed_m_s: float) -> None:
    cycles = phase_eq3(speed_m_s, AWR1843.wavelength_m, AWR1843.chirp_interval_s) / (2 * math.pi)
    doppler_hz = cycles / AWR1843.chirp_interval_s
    still = doa.without_doppler(wave(AWR1843, azimuth, 0.1, doppler_hz), np.array([doppler_hz]), AWR1843)
    np.testing.assert_allclose(still, wave(AWR1843, azimuth, 0.1), atol=1e-5)


def test_a_speed_beyond_the_limit_leaves_a_third_of_a_turn_between_transmitters() -> None:
    doppler_hz = 1.0 / AWR1843.chirp_interval_s  # comes out as none at all
    seen = doa.without_doppler(wave(AWR1843, 0.0, 0.0, doppler_hz), np.zeros(1), AWR1843)
    turns = np.angle(seen[0]) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.repeat([0.0, 1 / 3, -1 / 3], 4), atol=1e-5)


def test_rows_need_equal_spacings() -> None:
    for antennas in (((0.0, 0.0), (0.5, 0.0), (1.2, 0.0)), ((0.0, 0.0), (0.0, 0.0), (1.0, 0.0))):
        with pytest.raises(ParameterError, match="one grid"):
            doa.rows_of(replace(POSITION2GO, antennas=antennas, tdm_order=()))


def test_a_row_with_a_gap_and_one_antenna_alone() -> None:
    gap = replace(POSITION2GO, antennas=((1.5, 0.0), (0.0, 0.0), (0.5, 0.0)), tdm_order=())
    rows = doa.rows_of(gap)
    np.testing.assert_array_equal(rows.slots, [0, 1, 3])
    _, right = doa.directions(doa.azimuth_spectrum(wave(gap, 0.4), rows, 64), rows, 0.9, np.zeros(1))
    assert right[0] == pytest.approx(math.sin(0.4), abs=0.005)
    alone = doa.rows_of(replace(POSITION2GO, antennas=((0.0, 0.0),), tdm_order=()))
    np.testing.assert_array_equal(alone.row, [0])
    np.testing.assert_array_equal(doa.elevation_sine(np.ones((2, 1), np.complex64), np.zeros(2), alone), [0.0, 0.0])


@given(st.floats(-0.49, 0.49), st.floats(-5.0, -0.1), st.floats(-3.0, 3.0))
def test_the_top_of_a_parabola(top: float, bend: float, height: float) -> None:
    low, here, up = (np.array([height + bend * (x - top) ** 2]) for x in (-1.0, 0.0, 1.0))
    assert doa.vertex(low, here, up)[0] == pytest.approx(top, abs=1e-6)
    assert doa.vertex(here, here, here)[0] == 0.0
