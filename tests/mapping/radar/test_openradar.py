"""Real frames of a TI radar: the detections are plausible, the same every time, and the unsigned numbers do show."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.arrays import C128
from mapping.radar import doa
from mapping.radar.chain import ChainSettings, RadarChain, Spectra
from mapping.radar.detections import Detections
from mapping.radar.radar_params import AWR1843

NAMES = ["simple_frame_1", "doppler_example", "doppler_example_1"]


def cube(folder: Path, name: str) -> C128:
    """(chirps, antennas, samples) as stored: two's complement taken for unsigned."""
    raw: C128 = np.load(folder / "radar" / "openradar" / f"{name}.npy")
    return raw if raw.ndim == 3 else raw[:, None, :]


def signed(raw: C128) -> C128:
    real, imaginary = (np.where(part > 32767, part - 65536, part) for part in (raw.real, raw.imag))
    return real + 1j * imaginary


def processed(samples: C128) -> tuple[RadarChain, Spectra, Detections]:
    """With the AWR1843's cells: the files do not say what their radar was set to."""
    chirps, antennas, count = samples.shape
    row = tuple((0.5 * k, 0.0) for k in range(antennas))
    params = replace(AWR1843, chirps=chirps, samples=count, antennas=row, tdm_order=())
    chain = RadarChain(params, ChainSettings())
    spectra = chain.spectra(samples)
    return chain, spectra, chain.detect(spectra)


@pytest.mark.parametrize("name", NAMES)
def test_a_few_clear_targets_far_above_the_noise(shared_data: Path, name: str) -> None:
    chain, spectra, found = processed(signed(cube(shared_data, name)))
    assert 3 <= len(found) <= 60
    assert np.sum(found.snr_db > 40.0) >= 2
    assert np.all(found.snr_db > 5.0)
    assert np.all((found.range_m > 0) & (found.range_m < chain.params.max_range_m))
    noise = np.median(spectra.power)
    assert np.all(spectra.power[found.cells[:, 0], found.cells[:, 1]] > 5 * noise)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_targets_every_time(shared_data: Path, name: str) -> None:
    samples = signed(cube(shared_data, name))
    _, _, first = processed(samples)
    _, _, again = processed(samples.copy())
    np.testing.assert_array_equal(first.xyz_m, again.xyz_m)
    np.testing.assert_array_equal(first.radial_speed_m_s, again.radial_speed_m_s)


@pytest.mark.parametrize("name", NAMES)
def test_strong_targets_stay_when_noise_is_added(shared_data: Path, name: str) -> None:
    samples = signed(cube(shared_data, name))
    rng = np.random.default_rng(10)
    worse = samples + 0.3 * np.std(samples) * rng.normal(size=samples.shape)
    chain, _, before = processed(samples)
    cell_m = chain.params.range_resolution_m
    _, _, after = processed(worse)
    strong = before.where(before.snr_db > 42.0)
    assert len(strong) >= 1
    for range_m, speed_m_s in zip(strong.range_m, strong.radial_speed_m_s, strict=True):
        away = np.hypot(after.range_m - range_m, after.radial_speed_m_s - speed_m_s)
        assert away.min() < 0.5 * cell_m


@pytest.mark.parametrize("name", NAMES)
def test_unsigned_samples_raise_the_floor_ten_thousandfold(shared_data: Path, name: str) -> None:
    raw = cube(shared_data, name)
    _, right, _ = processed(signed(raw))
    _, wrong, _ = processed(raw)
    assert np.median(wrong.power) > 1e4 * np.median(right.power)
    assert np.max(wrong.power) > 1e4 * np.max(right.power)


def test_moving_targets_are_plane_waves_over_the_antennas(shared_data: Path) -> None:
    """All the power that eight antennas measure comes from one direction each; clutter nearby is spread."""
    chain, spectra, found = processed(signed(cube(shared_data, "doppler_example_1")))
    moving = found.where((np.abs(found.radial_speed_m_s) > 1.0) & (found.snr_db > 38.0))
    assert len(moving) >= 3
    _, by_direction = chain.azimuth_spectra(spectra, moving)
    power = spectra.power[moving.cells[:, 0], moving.cells[:, 1]]
    assert np.all(by_direction.max(axis=1) / (64 * power) > 0.9)
    assert np.all(np.abs(np.degrees(moving.azimuth_rad)) < 20.0)
    assert len(doa.rows_of(chain.params).row) == 8
