"""Whole frames: echoes of known targets, noise alone, strong and close ones, frames that are wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mapping.errors import RadarDataError
from mapping.radar.chain import POSITION2GO_SETTINGS, ChainSettings, RadarChain
from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
from mapping.radar.targets import Gate
from tests.mapping.radar.echoes import SMALL, Echo, frame, noise
from tests.reference.fmcw import Place, echo

CHAIN = RadarChain(SMALL)


def test_an_awr1843_whose_echoes_come_from_the_length_of_every_way() -> None:
    """Three transmitters and four receivers where TI's drawing has them, a target that moves on."""
    half = SMALL.wavelength_m / 2
    senders: list[Place] = [(0.0, 0.0, 0.0), (4 * half, 0.0, 0.0), (2 * half, 0.0, half)]
    receivers: list[Place] = [(k * half, 0.0, -3 * half) for k in range(4)]
    place = (6.0, 17.0, 2.5)
    range_m = math.hypot(*place)
    velocity = (2.0, 5.0, 0.5)
    found = CHAIN.process(echo(SMALL, senders, receivers, place, velocity))
    assert len(found) == 1
    assert found.range_m[0] == pytest.approx(range_m, abs=0.03)
    assert found.radial_speed_m_s[0] == pytest.approx(np.dot(place, velocity) / range_m, abs=0.03)
    assert found.azimuth_rad[0] == pytest.approx(math.atan2(6.0, 17.0), abs=0.005)
    assert found.elevation_rad[0] == pytest.approx(math.asin(2.5 / range_m), abs=0.02)
    np.testing.assert_allclose(found.xyz_m[0], place, atol=0.4)


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from([(SMALL, ChainSettings()), (POSITION2GO, POSITION2GO_SETTINGS)]),
    st.floats(3, 25),
    st.floats(-0.99, 0.99),
    st.floats(-1.0, 1.0),
)
def test_a_target_comes_out_where_it_is(
    radar: tuple[FmcwParams, ChainSettings], range_m: float, speed: float, azimuth: float
) -> None:
    params, settings = radar
    speed_m_s = speed * params.max_velocity_m_s
    target = Echo(range_m, speed_m_s, azimuth, snr_db=40.0)
    found = RadarChain(params, settings).process(frame(params, target))
    assert found.range_m[0] == pytest.approx(range_m, abs=0.05)
    assert found.radial_speed_m_s[0] == pytest.approx(speed_m_s, abs=0.05 + 0.02 * params.velocity_resolution_m_s)
    assert found.azimuth_rad[0] == pytest.approx(azimuth, abs=0.03)
    assert found.elevation_rad[0] == pytest.approx(0.0, abs=0.06)


def test_errors_at_15_db_are_those_of_the_noise() -> None:
    cases = [(Echo(20.0 + 0.07 * k, 3.0, 0.2, snr_db=15.0), k) for k in range(60)]
    found = [CHAIN.process(frame(SMALL, target, seed=k)) for target, k in cases]
    range_error = [f.range_m[0] - target.range_m for f, (target, _) in zip(found, cases, strict=True)]
    speed_error = [f.radial_speed_m_s[0] - 3.0 for f in found]
    azimuth_error = [f.azimuth_rad[0] - 0.2 for f in found]
    assert np.std(range_error) < 0.05
    assert np.std(speed_error) < 0.1 * SMALL.velocity_resolution_m_s
    assert np.std(azimuth_error) < math.radians(1.0)
    for error, most in ((range_error, 0.01), (speed_error, 0.04), (azimuth_error, math.radians(0.3))):
        assert abs(np.mean(error)) < most


def test_noise_alone_gives_few_targets() -> None:
    chain = RadarChain(AWR1843)
    targets = sum(len(chain.process(noise(AWR1843.shape, seed).astype(np.complex64))) for seed in range(10))
    assert targets <= 10, "about one in four frames"


@pytest.mark.parametrize("name", ["rectangular", "hann"])
def test_one_strong_target_is_one_detection(name: str) -> None:
    chain = RadarChain(AWR1843, ChainSettings(range_window=name, doppler_window=name))  # type: ignore[arg-type]
    found = chain.process(frame(AWR1843, Echo(50.2, 2.0, 0.3, snr_db=50.0), seed=3))
    strong = found.where(found.snr_db > 20.0)
    assert len(strong) == 1


@pytest.mark.parametrize(("name", "cells"), [("rectangular", 1.5), ("hann", 2.0)])
def test_two_alike_side_by_side_are_two(name: str, cells: float) -> None:
    chain = RadarChain(SMALL, ChainSettings(range_window=name))  # type: ignore[arg-type]
    apart, resolved = cells * SMALL.range_resolution_m, 0
    for k in range(40):
        near = 12.0 + 0.013 * k
        pair = Echo(near), Echo(near + apart, phase_rad=2 * math.pi * k / 40)
        ranges = np.unique(chain.process(frame(SMALL, *pair, seed=k)).range_m)
        resolved += int(np.sum((ranges > near - apart) & (ranges < near + 2 * apart)) == 2)
    assert resolved >= 38


@pytest.mark.parametrize("coupling_db", [None, 50.0])
@pytest.mark.parametrize(
    ("radar", "ranges_m", "stronger_db"),
    [((POSITION2GO, POSITION2GO_SETTINGS), (4.0, 5.0, 7.0), 10.0), ((AWR1843, ChainSettings()), (2.5, 4.0, 5.0), 15.0)],
)
def test_a_near_target_before_a_larger_one_is_seen(
    radar: tuple[FmcwParams, ChainSettings], ranges_m: tuple[float, ...], stronger_db: float, coupling_db: float | None
) -> None:
    """The larger one 3 to 4 m behind it, at the same speed; with and without the transmitter heard directly."""
    params, chosen = radar
    chain, direct = RadarChain(params, chosen), () if coupling_db is None else (Echo(0.1, snr_db=coupling_db),)
    for k, range_m in enumerate(ranges_m):
        behind = Echo(range_m + 3.0 + k / 2, snr_db=25.0 + stronger_db, phase_rad=2.0 * k)
        found = chain.process(frame(params, Echo(range_m, snr_db=25.0), behind, *direct, seed=k))
        assert np.min(np.abs(found.range_m - range_m)) < params.range_resolution_m, range_m


def test_beyond_the_limit_a_speed_wraps_and_beyond_the_range_a_distance() -> None:
    fast = CHAIN.process(frame(SMALL, Echo(15.0, SMALL.max_velocity_m_s + 2.0)))
    assert fast.radial_speed_m_s[0] == pytest.approx(2.0 - SMALL.max_velocity_m_s, abs=0.1)
    far = CHAIN.process(frame(SMALL, Echo(SMALL.max_range_m + 6.0)))
    assert far.range_m[0] == pytest.approx(6.0, abs=0.05)


def test_limits_of_range_and_the_gate() -> None:
    targets = (
        Echo(5.0, 1.0, 0.1, 0.2),
        Echo(15.0, -2.0, 0.1, 0.2),
        Echo(25.0, 3.0, -1.0, 0.2),
        Echo(20.0, 5.0, 0.1, -0.3),
    )
    cube = frame(SMALL, *targets)
    everything = CHAIN.process(cube)
    assert {round(r) for r in everything.range_m[:4]} == {5, 15, 20, 25}
    some = RadarChain(SMALL, ChainSettings(nearest_m=10.0, farthest_m=22.0)).process(cube)
    assert {round(r) for r in some.range_m} == {15, 20}
    ahead = RadarChain(SMALL, ChainSettings(gate=Gate())).process(cube)
    assert {round(r) for r in ahead.range_m} == {5, 15}


def test_a_thousand_targets_are_bounded_and_the_strongest() -> None:
    rng = np.random.default_rng(9)
    many = noise(SMALL.shape, 1)
    for _ in range(30):
        many += 30.0 * noise(SMALL.shape, int(rng.integers(1 << 30))) * (rng.random(SMALL.shape) < 0.01)
    chain = RadarChain(SMALL, ChainSettings(most=10, side_lobe_margin=0.0, second_azimuth=1.0))
    assert len(chain.process(many.astype(np.complex64))) <= 10


def test_the_same_frame_gives_the_same_targets_and_is_left_alone() -> None:
    cube = frame(SMALL, Echo(10.0), Echo(12.0, 4.0))
    before = cube.copy()
    first, again = CHAIN.process(cube), CHAIN.process(cube)
    np.testing.assert_array_equal(cube, before)
    for name in ("range_m", "radial_speed_m_s", "azimuth_rad", "elevation_rad", "snr_db", "cells"):
        np.testing.assert_array_equal(getattr(first, name), getattr(again, name))


def test_spectra_are_there_to_be_drawn() -> None:
    spectra = CHAIN.spectra(frame(SMALL, Echo(16.0, 4.0, 0.3)))
    found = CHAIN.detect(spectra)
    assert spectra.range_m[np.argmax(spectra.range_profile)] == pytest.approx(16.0, abs=0.3)
    speeds, power = spectra.range_doppler
    assert np.all(np.diff(speeds) > 0)
    row, cell = np.unravel_index(np.argmax(power), power.shape)
    assert speeds[row] == pytest.approx(4.0, abs=SMALL.velocity_resolution_m_s)
    assert spectra.range_m[cell] == pytest.approx(16.0, abs=0.3)
    right, by_direction = CHAIN.azimuth_spectra(spectra, found)
    assert by_direction.shape == (len(found), 64)
    assert right[np.argmax(by_direction[0])] == pytest.approx(math.sin(0.3), abs=0.03)


@pytest.mark.parametrize(
    ("cube", "words"),
    [
        (np.zeros((15, 12, 64), np.complex64), "15 x 12 x 64"),
        (np.zeros((16, 12, 63), np.complex64), "16 chirps x 12 antennas x 64 samples"),
        (np.zeros((0,), np.complex64), "0 samples"),
        (np.zeros(SMALL.shape, np.float32), "not complex"),
        (np.full(SMALL.shape, np.nan, np.complex64), "not numbers"),
        (np.full(SMALL.shape, 1e38, np.complex64), "too large"),
        (np.full(SMALL.shape, 1e300, np.complex128), "too large"),
        (np.full(SMALL.shape, np.inf, np.complex128), "not numbers"),
    ],
)
def test_wrong_frames_are_named(cube: np.ndarray, words: str) -> None:
    with pytest.raises(RadarDataError, match=words):
        CHAIN.process(cube)


def test_silence_is_no_target() -> None:
    assert len(CHAIN.process(np.zeros(SMALL.shape, np.complex64))) == 0
    assert CHAIN.process(np.zeros(SMALL.shape, np.complex64)).xyz_m.shape == (0, 3)


def test_one_antenna_gives_ranges_and_speeds() -> None:
    one = replace(SMALL, antennas=((0.0, 0.0),), tdm_order=())
    found = RadarChain(one).process(frame(one, Echo(9.0, -3.0, 0.5)))
    assert found.range_m[0] == pytest.approx(9.0, abs=0.05)
    assert found.radial_speed_m_s[0] == pytest.approx(-3.0, abs=0.1)
    assert found.azimuth_rad[0] == 0.0
