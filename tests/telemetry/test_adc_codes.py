"""How 16-bit samples stand for numbers: told by how they fill their scale, asked for, or refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mapping.errors import RadarDataError
from mapping.geometry.arrays import I64, U16
from mapping.radar.chain import RadarChain
from mapping.radar.radar_params import AWR1843, POSITION2GO
from telemetry.sensors.adc.codes import SampleCode, histogram, told
from telemetry.sensors.adc.read_adc import open_adc
from tests.mapping.radar.echoes import SMALL as SMALL_RADAR
from tests.mapping.radar.echoes import Echo, frame
from tests.telemetry.test_adc_files import I_FIRST, SHAPE, cube, cubes, dca1000_bytes, oda_line, save


def signal(seed: int, spread: float, mean: float = 0.0, count: int = 20_000) -> I64:
    return np.round(np.random.default_rng(seed).normal(mean, spread, count)).astype(np.int64)


def words(numbers: I64, zero: int | None = None) -> U16:
    """As two's complement, or around ``zero``."""
    return ((numbers + (zero or 0)) % 65536).astype(np.uint16)


@given(st.floats(0.5, 7000), st.floats(-400, 400), st.sampled_from([None, 32768]), st.integers(0, 99))
def test_each_code_gives_itself_away(spread: float, mean: float, zero: int | None, seed: int) -> None:
    numbers = np.clip(signal(seed, spread, mean), -32_000, 32_000)  # the rarest would be no 16 bits
    code = told(histogram(words(numbers, zero)), "auto", "x")
    assert code.zero == zero
    np.testing.assert_array_equal(code.numbers(words(numbers, zero)), numbers)
    assert ("offset binary of 16 bits" in code.note) == (zero is not None)


@pytest.mark.parametrize("bits", [12, 14])
def test_offset_binary_of_fewer_bits(bits: int) -> None:
    middle = 1 << (bits - 1)
    numbers = signal(1, 40.0, 3.0)
    code = told(histogram(words(numbers, middle)), "auto", "x")
    np.testing.assert_array_equal(code.numbers(words(numbers, middle)), numbers)
    assert f"of {bits} bits: {middle} was taken off" in code.note


@given(st.floats(5_000, 28_000), st.sampled_from([None, 32768]))
def test_a_large_tone_that_leaves_the_ends_free(height: float, zero: int | None) -> None:
    tone = np.round(height * np.cos(np.arange(40_000) * 0.37)).astype(np.int64)
    assert told(histogram(words(tone, zero)), "auto", "x").zero == zero


@pytest.mark.parametrize(
    "stored",
    [np.random.default_rng(3).integers(0, 65536, 50_000).astype(np.uint16),
     words(np.clip(signal(2, 30_000.0), -32768, 32767)),
     words(np.clip(40_000 * np.cos(np.arange(40_000) * 0.37), -32768, 32767).astype(np.int64)),
     words(signal(4, 60.0)).byteswap()],
    ids=["noise of all bits", "clipped noise", "clipped tone", "bytes the other way round"],
)  # fmt: skip
def test_what_is_no_unclipped_signal_in_either_code_is_refused(stored: U16) -> None:
    with pytest.raises(RadarDataError, match="no unclipped signal") as caught:
        told(histogram(stored), "auto", "adc.bin")
    assert "--samples" in caught.value.advice


def test_a_steady_offset_is_no_signal() -> None:
    counts = histogram(words(signal(1, 40.0, 20_000.0)))
    with pytest.raises(RadarDataError, match="All of its samples lie around 20,000, 40 to either side") as caught:
        told(counts, "auto", "adc.bin")
    assert "--samples twos-complement" in caught.value.advice
    assert told(counts, "twos-complement", "x").zero is None


@given(st.sampled_from(["twos-complement", "offset-binary"]), st.floats(1.0, 5000.0))
def test_what_is_asked_for_and_cannot_be_is_refused(asked: SampleCode, spread: float) -> None:
    other = 32768 if asked == "twos-complement" else None
    with pytest.raises(RadarDataError, match="stand at the ends of their scale"):
        told(histogram(words(signal(7, spread), other)), asked, "x")


def test_a_little_clipping_is_taken_when_the_code_is_said() -> None:
    counts = histogram(words(np.clip(signal(2, 11_000.0), -32768, 32767)))
    with pytest.raises(RadarDataError):
        told(counts, "auto", "x")
    code = told(counts, "twos-complement", "x")
    assert "were clipped" in code.note
    assert code.zero is None


@pytest.mark.parametrize("zero", [32768, 8192])
def test_a_capture_in_offset_binary_is_that_of_the_signed_one(tmp_path: Path, zero: int) -> None:
    made = [cube(1), cube(2)]
    flat = np.concatenate([one.ravel() for one in made]).reshape(-1, 2)
    path = tmp_path / "adc.bin"
    path.write_bytes((np.stack((flat.real, flat.imag), axis=1) + zero).astype("<u2").tobytes())
    opened = open_adc(path, AWR1843, I_FIRST)
    assert any("offset binary" in note for note in opened.notes)
    np.testing.assert_array_equal(np.stack(cubes(opened)), np.stack(made))


def test_a_clipped_capture_is_refused_and_names_the_frame(tmp_path: Path) -> None:
    loud = np.clip(40.0 * cube(1).view(np.float32), -20_000, 20_000).view(np.complex64)
    path = tmp_path / "adc.bin"
    path.write_bytes(dca1000_bytes([cube(2), loud]))
    opened = open_adc(path, AWR1843, I_FIRST)
    with pytest.raises(RadarDataError, match=r"adc\.bin, frame 1: .* clipped"):
        list(opened.frames())


def test_clipped_rows_and_arrays_are_refused(tmp_path: Path) -> None:
    tone = frame(POSITION2GO, Echo(5.0, snr_db=40.0))
    clipped = np.clip(tone.view(np.float32), -2.0, 2.0).view(np.complex64)
    (tmp_path / "radar.csv").write_text(oda_line(0, tone) + "\n" + oda_line(63_694_000, clipped))
    with pytest.raises(RadarDataError, match=r"line 2: .* clipped"):
        list(open_adc(tmp_path / "radar.csv", POSITION2GO, None).frames())
    with pytest.raises(RadarDataError, match=r"a\.npy, frame 0: .* clipped"):
        list(open_adc(save(tmp_path / "a.npy", clipped), POSITION2GO, None).frames())


@pytest.mark.parametrize("name", ["simple_frame_1.npy", "doppler_example.npy", "doppler_example_1.npy"])
def test_a_recorded_cube_in_offset_binary_has_the_same_targets(shared_data: Path, tmp_path: Path, name: str) -> None:
    file = shared_data / "radar" / "openradar" / name
    stored = np.load(file)
    real, imaginary = (np.where(part > 32767, part - 65536, part) + 32768 for part in (stored.real, stored.imag))
    usual = open_adc(file, AWR1843, None)
    offset = open_adc(save(tmp_path / name, real + 1j * imaginary), AWR1843, None)
    assert any("offset binary of 16 bits" in note for note in offset.notes)
    assert not any("65536" in note for note in offset.notes)
    np.testing.assert_array_equal(cubes(offset)[0], cubes(usual)[0])
    chain = RadarChain(usual.params)
    assert len(chain.process(cubes(offset)[0])) == len(chain.process(cubes(usual)[0])) >= 3


def test_offset_binary_is_asked_only_of_words(tmp_path: Path) -> None:
    path = save(tmp_path / "a.npy", frame(SMALL_RADAR, Echo(9.0)))
    with pytest.raises(RadarDataError, match="not whole numbers"):
        open_adc(path, AWR1843, None, samples_as="offset-binary")
    assert open_adc(path, AWR1843, None, samples_as="twos-complement").params.shape == SMALL_RADAR.shape


def test_silence_is_told_as_usual(tmp_path: Path) -> None:
    path = tmp_path / "adc.bin"
    path.write_bytes(bytes(4 * SHAPE[0] * SHAPE[1] * SHAPE[2]))
    opened = open_adc(path, AWR1843, I_FIRST)
    assert opened.notes == ()
    assert not np.any(cubes(opened)[0])
