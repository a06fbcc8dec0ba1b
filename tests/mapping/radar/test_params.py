"""What follows from a radar's waveform and antennas; the two sensors of the papers as printed."""

from dataclasses import replace

import numpy as np
import pytest

from mapping.errors import ParameterError
from mapping.radar.radar_params import AWR1843, LIGHT_M_S, POSITION2GO, FmcwParams
from tests.reference.fmcw import phase_eq3, range_eq1


def test_the_awr1843_as_printed() -> None:
    assert AWR1843.range_resolution_m == pytest.approx(0.5)
    assert AWR1843.max_range_m >= 120.0
    assert AWR1843.max_velocity_m_s == pytest.approx(10.4, abs=0.01)
    assert AWR1843.velocity_resolution_m_s == pytest.approx(0.31, abs=0.02)
    assert AWR1843.shape == (64, 12, 256)
    assert AWR1843.start_frequency_hz == 77e9
    assert AWR1843.bandwidth_hz < 4e9, "the whole bandwidth was not used"


def test_the_awr1843s_antennas_are_those_of_its_drawing() -> None:
    transmitters = [(0.0, 0.0), (2.0, 0.0), (1.0, 0.5)]
    receivers = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.5, 0.0)]
    virtual = [(tx + rx, tz + rz) for tx, tz in transmitters for rx, rz in receivers]
    np.testing.assert_allclose(AWR1843.position_wavelengths, virtual)
    np.testing.assert_allclose(AWR1843.offset_s[[0, 4, 8]], np.arange(3) * AWR1843.chirp_interval_s / 3)


def test_the_position2go_as_printed() -> None:
    assert POSITION2GO.range_resolution_m == pytest.approx(0.75, abs=0.001)
    assert POSITION2GO.range_resolution_m * 64 / 256 == pytest.approx(0.187, abs=0.001)
    assert POSITION2GO.wavelength_m == pytest.approx(0.0124, abs=0.0001)
    assert POSITION2GO.turns == 1
    np.testing.assert_array_equal(POSITION2GO.offset_s, 0.0)


@pytest.mark.parametrize("params", [AWR1843, POSITION2GO])
def test_limits_follow_from_the_equations(params: FmcwParams) -> None:
    highest_hz = params.sample_rate_hz
    assert range_eq1(highest_hz, params.slope_hz_per_s) == pytest.approx(params.max_range_m)
    half_a_turn = phase_eq3(params.max_velocity_m_s, params.wavelength_m, params.chirp_interval_s)
    assert half_a_turn == pytest.approx(np.pi)
    doppler_hz = 2 / params.wavelength_m
    assert range_eq1(doppler_hz, params.slope_hz_per_s) == pytest.approx(params.coupling_m_per_m_s)
    assert LIGHT_M_S / params.wavelength_m > params.start_frequency_hz


@pytest.mark.parametrize("name", ["start_frequency_hz", "slope_hz_per_s", "sample_rate_hz", "chirp_interval_s"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_absurd_numbers_are_named(name: str, value: float) -> None:
    with pytest.raises(ParameterError, match=name):
        replace(AWR1843, **{name: value})


@pytest.mark.parametrize(
    "change",
    [
        {"samples": 1},
        {"chirps": 0},
        {"antennas": (), "tdm_order": ()},
        {"tdm_order": (0, 1)},
        {"tdm_order": (0,) * 11 + (-1,)},
    ],
)
def test_frames_without_sense(change: dict[str, object]) -> None:
    with pytest.raises(ParameterError):
        replace(AWR1843, **change)  # type: ignore[arg-type]
