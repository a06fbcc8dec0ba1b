"""Raw radar files: what is read out of each format, and what is said of files that are wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mapping.errors import RadarDataError
from mapping.geometry.arrays import C64
from mapping.radar.chain import RadarChain
from mapping.radar.radar_params import AWR1843, POSITION2GO
from telemetry.sensors.adc.adc_file import AdcFile
from telemetry.sensors.adc.dca1000 import open_dca1000
from telemetry.sensors.adc.oda import open_oda
from telemetry.sensors.adc.read_adc import open_adc
from tests.telemetry.test_ti_config import config

SMALL = config(frameCfg="frameCfg 0 2 4 0 100 1 0", adcbufCfg="adcbufCfg -1 0 0 1 1")
I_FIRST, Q_FIRST = SMALL, config(frameCfg="frameCfg 0 2 4 0 100 1 0")
SHAPE = (4, 12, 256)


def cube(seed: int = 0, shape: tuple[int, ...] = SHAPE) -> C64:
    rng = np.random.default_rng(seed)
    return (rng.integers(-900, 900, shape) + 1j * rng.integers(-900, 900, shape)).astype(np.complex64)


def dca1000_bytes(frames: list[C64], *, q_first: bool = False) -> bytes:
    """Two samples of one part, then the same two of the other, as the card's two lanes interleave."""
    flat = np.concatenate([frame.ravel() for frame in frames]).reshape(-1, 2)
    parts = (flat.imag, flat.real) if q_first else (flat.real, flat.imag)
    return np.stack(parts, axis=1).astype("<i2").tobytes()


def cubes(opened: AdcFile) -> list[C64]:
    return [frame.cube for frame in opened.frames()]


@pytest.mark.parametrize("q_first", [False, True], ids=["I first", "Q first"])
def test_a_capture_holds_receivers_in_chirps_in_frames(tmp_path: Path, q_first: bool) -> None:
    path = tmp_path / "adc.bin"
    path.write_bytes(dca1000_bytes([cube(1), cube(2)], q_first=q_first))
    opened = open_adc(path, AWR1843, Q_FIRST if q_first else I_FIRST)
    assert opened.params.shape == SHAPE
    assert [frame.t_s for frame in opened.frames()] == [0.0, 0.1]
    for found, made in zip(cubes(opened), [cube(1), cube(2)], strict=True):
        assert found.dtype == np.complex64
        assert np.array_equal(found, made)


def test_a_cut_capture_is_refused_with_the_place_and_a_way_on(tmp_path: Path) -> None:
    path = tmp_path / "adc.bin"
    whole = dca1000_bytes([cube(1), cube(2)])
    path.write_bytes(whole[:-1000])
    with pytest.raises(RadarDataError) as caught:
        open_dca1000(path, I_FIRST)
    assert "middle of frame 1" in caught.value.what
    assert f"at byte {len(whole) // 2:,}" in caught.value.what
    assert "4 chirps x 12 antennas x 256 samples" in caught.value.what
    assert caught.value.advice.endswith("--frames 1.")
    (only,) = cubes(open_dca1000(path, I_FIRST, most=1))
    assert np.array_equal(only, cube(1))


def test_a_capture_with_another_number_of_chirps_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "adc.bin"
    path.write_bytes(dca1000_bytes([cube(1, (3, 12, 256))]))
    with pytest.raises(RadarDataError, match=r"middle of frame 0.*ran with"):
        open_dca1000(path, I_FIRST)


def test_headers_between_samples_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "adc.bin"
    path.write_bytes(bytes(100))
    with pytest.raises(RadarDataError, match="headers"):
        open_dca1000(path, config(clutterRemoval="lvdsStreamCfg -1 1 1 0"))


def save(path: Path, array: NDArray[np.generic]) -> Path:
    np.save(path, array)
    return path


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize(
    ("shape", "frame", "count"),
    [((16, 64), (16, 1, 64), 1), ((16, 8, 64), (16, 8, 64), 1), ((3, 16, 12, 64), (16, 12, 64), 3)],
)
def test_arrays_of_any_depth_are_frames(
    tmp_path: Path, order: str, shape: tuple[int, ...], frame: tuple[int, int, int], count: int
) -> None:
    made = cube(5, shape).astype(np.complex128)
    path = save(tmp_path / "cube.npy", np.asarray(made, order=order))  # type: ignore[call-overload]
    opened = open_adc(path, AWR1843, None)
    assert opened.params.shape == frame
    assert any("hold only if" in note for note in opened.notes)
    assert np.array_equal(np.stack(cubes(opened)), made.reshape(count, *frame))


def test_a_cube_of_the_sensors_own_shape_needs_no_note(tmp_path: Path) -> None:
    opened = open_adc(save(tmp_path / "a.npy", cube(1, POSITION2GO.shape)), POSITION2GO, None)
    assert opened.params == POSITION2GO
    assert opened.notes == ()


@given(st.lists(st.integers(-30000, -300) | st.integers(300, 30000), min_size=15, max_size=15).map(lambda v: [0, *v]))
def test_unsigned_samples_come_out_signed(tmp_path_factory: pytest.TempPathFactory, values: list[int]) -> None:
    signed = np.array(values, np.float64).reshape(2, 8) * (1 + 1j)
    stored = np.where(signed.real < 0, signed.real + 65536, signed.real)
    path = save(tmp_path_factory.mktemp("unsigned") / "cube.npy", stored + 1j * stored)
    opened = open_adc(path, AWR1843, None)
    (found,) = cubes(opened)
    assert np.array_equal(found[:, 0], signed.astype(np.complex64))
    assert any("stored unsigned" in note for note in opened.notes) == (min(values) < 0)


@pytest.mark.parametrize("order", ["C", "F"])
def test_a_quiet_first_frame_does_not_hide_that_the_others_are_unsigned(tmp_path: Path, order: str) -> None:
    signed = np.stack([np.zeros((16, 8, 64)), cube(1, (16, 8, 64)), cube(2, (16, 8, 64))])
    real, imaginary = (np.where(part < 0, part + 65536, part) for part in (signed.real, signed.imag))
    stored = np.asarray((real + 1j * imaginary).astype(np.complex64), order=order)  # type: ignore[call-overload]
    opened = open_adc(save(tmp_path / "cube.npy", stored), AWR1843, None)
    assert any("stored unsigned" in note for note in opened.notes)
    assert np.array_equal(np.stack(cubes(opened)), signed)


def test_frames_that_are_signed_after_all_are_left_alone(tmp_path: Path) -> None:
    made = np.stack([np.full((16, 8, 64), 40000 + 0j), np.full((16, 8, 64), -1 + 0j)])
    opened = open_adc(save(tmp_path / "cube.npy", made), AWR1843, None)
    assert not any("unsigned" in note for note in opened.notes)
    assert np.array_equal(np.stack(cubes(opened)), made)


def test_a_hole_in_a_later_frame_does_not_make_unsigned_samples_signed(tmp_path: Path) -> None:
    made = np.full((2, 16, 8, 64), 65535 + 0j)
    made[1, 0, 0, 0] = np.nan
    opened = open_adc(save(tmp_path / "cube.npy", made), AWR1843, None)
    assert next(opened.frames()).cube[0, 0, 0] == -1


def test_large_signed_samples_are_left_alone(tmp_path: Path) -> None:
    made = np.array([[40000 - 1j, -2 + 50000j] * 8] * 4)
    opened = open_adc(save(tmp_path / "a.npy", made), AWR1843, None)
    assert np.array_equal(cubes(opened)[0][:, 0], made.astype(np.complex64))


@pytest.mark.parametrize("name", ["simple_frame_1.npy", "doppler_example.npy", "doppler_example_1.npy"])
def test_the_recorded_cubes_are_unsigned_and_hold_targets(shared_data: Path, name: str) -> None:
    opened = open_adc(shared_data / "radar" / "openradar" / name, AWR1843, None)
    assert any("stored unsigned" in note for note in opened.notes)
    (found,) = cubes(opened)
    assert abs(float(found.real.mean())) < 50
    assert float(np.abs(found).max()) < 400
    assert len(RadarChain(opened.params).process(found)) >= 3


def oda_line(t_ns: int, made: C64) -> str:
    blocks = [made[:, 0].real, made[:, 0].imag, made[:, 1].real, made[:, 1].imag]
    return ",".join([str(t_ns), *(f"{v:g}" for block in blocks for v in block.ravel())])


@pytest.mark.parametrize("heading", ["", "time,rx1_re\n"], ids=["plain", "heading"])
def test_oda_rows_are_frames(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "radar.csv"
    made = [cube(seed, POSITION2GO.shape) for seed in (1, 2)]
    path.write_text(heading + oda_line(5_000_000_000, made[0]) + "\n\n" + oda_line(5_063_694_000, made[1]) + ",\n")
    opened = open_adc(path, POSITION2GO, None)
    assert [frame.t_s for frame in opened.frames()] == pytest.approx([0.0, 0.063694])
    assert np.array_equal(np.stack(cubes(opened)), np.stack(made))


def test_a_byte_order_mark_is_no_heading(tmp_path: Path) -> None:
    path = tmp_path / "radar.csv"
    made = [cube(seed, POSITION2GO.shape) for seed in (1, 2)]
    lines = [oda_line(k * 63_694_000, one) for k, one in enumerate(made)]
    path.write_text("\ufeff" + "\n".join(lines), encoding="utf-8")
    assert np.array_equal(np.stack(cubes(open_oda(path, POSITION2GO))), np.stack(made))


@pytest.mark.parametrize(
    ("times", "words"),
    [(("nan", "1"), "line 1: The frame's time is nan"),
     (("0", "1e400"), "line 2: The frame's time is inf"),
     (("0", "63694000", "63694000"), "line 3: .* 63694000 ns, is not after the one before, 63694000 ns"),
     (("5e9", "4e9"), "line 2: .* not after"),
     (("0", "1e300"), "line 2: .* more than a day after")],
)  # fmt: skip
def test_times_of_oda_rows_are_finite_and_rise(tmp_path: Path, times: tuple[str, ...], words: str) -> None:
    path = tmp_path / "radar.csv"
    row = oda_line(0, cube(1, POSITION2GO.shape)).split(",", 1)[1]
    path.write_text("\n".join(f"{t},{row}" for t in times))
    with pytest.raises(RadarDataError, match=words) as caught:
        list(open_oda(path, POSITION2GO).frames())
    assert "nanoseconds that rise" in caught.value.advice


def test_a_cut_oda_row_is_named(tmp_path: Path) -> None:
    path = tmp_path / "radar.csv"
    line = oda_line(0, cube(1, POSITION2GO.shape))
    path.write_text(line + "\n" + line[:5000])
    opened = open_oda(path, POSITION2GO)
    with pytest.raises(RadarDataError, match=r"radar\.csv, line 2: A row of .* values; .* has 4,097") as caught:
        list(opened.frames())
    assert "cut off" in caught.value.advice


def test_words_in_an_oda_row_are_named(tmp_path: Path) -> None:
    path = tmp_path / "radar.csv"
    fields = oda_line(0, cube(1, POSITION2GO.shape)).split(",")
    fields[70] = "many"
    path.write_text(",".join(fields))
    with pytest.raises(RadarDataError, match='line 1: Value 71 is "many"'):
        list(open_oda(path, POSITION2GO).frames())


def test_a_heading_alone_is_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "radar.csv"
    path.write_text("time,rx1\n")
    with pytest.raises(RadarDataError, match="no frame"):
        list(open_oda(path, POSITION2GO).frames())


@pytest.mark.parametrize(
    ("array", "words"),
    [(np.zeros((4, 8)), "float64, not complex"),
     (np.zeros(64, complex), "shape 64"),
     (np.zeros((2, 2, 2, 2, 2), complex), "shape 2 x 2 x 2 x 2 x 2"),
     (np.zeros((4, 0), complex), "shape 4 x 0"),
     (np.zeros((4, 7, 64), complex), "7 antennas"),
     (np.zeros((64, 4, 2), complex), "2 samples"),
     (np.array(1 + 1j), "single number")],
)  # fmt: skip
def test_arrays_that_are_no_cubes_are_refused(tmp_path: Path, array: NDArray[np.generic], words: str) -> None:
    with pytest.raises(RadarDataError, match=words):
        open_adc(save(tmp_path / "a.npy", array), AWR1843, None)


def test_a_cube_that_contradicts_the_configuration_is_refused(tmp_path: Path) -> None:
    path = save(tmp_path / "a.npy", cube(1, (8, 12, 256)))
    with pytest.raises(RadarDataError, match=r"8 x 12 x 256 .* they would be 4 x 12 x 256"):
        open_adc(path, AWR1843, SMALL)


def test_a_cut_array_is_refused_with_the_place(tmp_path: Path) -> None:
    path = save(tmp_path / "a.npy", cube(1, (2, 16, 8, 64)))
    data = path.read_bytes()
    chirp_bytes = 8 * 64 * 8
    path.write_bytes(data[: -3 * chirp_bytes - 1])
    with pytest.raises(RadarDataError, match="in chirp 12 of frame 1"):
        open_adc(path, AWR1843, None)
    path.write_bytes(data + b"more")
    with pytest.raises(RadarDataError, match="4 bytes follow"):
        open_adc(path, AWR1843, None)


@pytest.mark.parametrize("ending", ["npy", "bin", "csv"])
def test_empty_files_are_said_to_be_empty(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a.{ending}"
    path.touch()
    sensor, cfg = (AWR1843, SMALL) if ending == "bin" else (POSITION2GO, None)
    with pytest.raises(RadarDataError, match=rf"a\.{ending}: The file is empty"):
        open_adc(path, sensor, cfg)


@pytest.mark.parametrize(
    ("name", "words"),
    [("a.npy", "no NumPy array"), ("a.bin", "--cfg FILE"), ("a.wav", "no format of raw samples"), ("a", "no format")],
)
def test_other_files_are_refused(tmp_path: Path, name: str, words: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"\x93NUMPY\x01\x00\xff\xff{'descr'" if name == "a.npy" else b"hello")
    with pytest.raises(RadarDataError, match=words):
        open_adc(path, AWR1843, None)


@given(st.binary(max_size=300))
def test_no_bytes_behind_the_magic_break_the_reader(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.mktemp("npy") / "a.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + data)
    with pytest.raises(RadarDataError, match=r"a\.npy"):
        open_adc(path, AWR1843, None)


def test_a_position2go_file_needs_two_receivers(tmp_path: Path) -> None:
    path = tmp_path / "radar.csv"
    path.write_text(oda_line(0, cube(1, POSITION2GO.shape)))
    with pytest.raises(RadarDataError, match="position2go"):
        open_adc(path, AWR1843, None)
    with pytest.raises(RadarDataError, match=r"no \.cfg"):
        open_adc(path, POSITION2GO, SMALL)


def test_frames_are_read_in_any_order(tmp_path: Path) -> None:
    made = [cube(number, POSITION2GO.shape) for number in range(3)]
    rows = [oda_line(k * 63_694_000, one) for k, one in enumerate(made)]
    (tmp_path / "radar.csv").write_text("\n".join(["time,re,im", rows[0], "", *rows[1:]]))
    (tmp_path / "adc.bin").write_bytes(dca1000_bytes([cube(number) for number in range(3)]))
    files = (
        open_oda(tmp_path / "radar.csv", POSITION2GO),
        open_adc(save(tmp_path / "a.npy", np.stack(made)), POSITION2GO, None),
        open_adc(tmp_path / "adc.bin", AWR1843, I_FIRST),
    )
    for opened in files:
        one_by_one, every = list(opened.frames()), opened.any_frame()
        assert every.count == 3
        for number in (2, 0, 1):
            found = every.read(number)
            assert found.t_s == one_by_one[number].t_s
            assert np.array_equal(found.cube, one_by_one[number].cube)
