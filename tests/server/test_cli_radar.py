"""``hedgehop radar process``: files of every kind in, detections, figures and clear words out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mapping.radar.radar_params import AWR1843, POSITION2GO, FmcwParams
from telemetry.agent.client import RadarReading
from telemetry.agent.sources import recorded_readings
from telemetry.sensors.ti_mmwave.ti_config import fmcw_params
from tests.server.cli_runs import hedgehop
from tests.telemetry.test_adc_files import dca1000_bytes, oda_line, save
from tests.telemetry.test_ti_config import GOOD, config

DETECTION = [
    "frame", "t_s", "range_m", "radial_speed_m_s", "azimuth_deg", "elevation_deg", "x_right_m", "y_forward_m", "z_up_m",
    "snr_db", "doppler_cell", "range_cell",
]  # fmt: skip
KEYS = ["frames", "detections", "seconds_per_frame", "parameters"]
FIGURES = {"range-profile.png", "range-doppler.png", "azimuth-spectrum.png"}


def echo(params: FmcwParams, range_m: float, speed_m_s: float, sine: float) -> np.ndarray:
    """A cube with one target and a little noise, straight from the definitions in FmcwParams."""
    chirps, _, samples = params.shape
    t_s = np.arange(samples) / params.sample_rate_hz
    chirp_s = np.arange(chirps)[:, None] * params.chirp_interval_s + params.offset_s
    way_m = range_m + speed_m_s * (chirp_s[:, :, None] - chirp_s.max() / 2)
    phase = 4 * np.pi * way_m / params.wavelength_m
    phase = phase + 4 * np.pi * params.slope_hz_per_s * range_m / 299_792_458.0 * t_s
    phase = phase - 2 * np.pi * params.position_wavelengths[None, :, :1] * sine
    rng = np.random.default_rng(1)
    noise = rng.normal(size=params.shape) + 1j * rng.normal(size=params.shape)
    return np.round(400 * np.exp(1j * phase) + 4 * noise).astype(np.complex64)


def targets(path: Path) -> np.ndarray:
    """Of the first frame, strongest first."""
    reading = next(reading for _, reading in recorded_readings(path))
    assert isinstance(reading, RadarReading)
    return reading.targets[np.argsort(-reading.targets[:, 4])]


def test_a_recorded_cube_gives_detections_and_figures(shared_data: Path, tmp_path: Path) -> None:
    file = shared_data / "radar" / "openradar" / "doppler_example_1.npy"
    run = hedgehop("radar", "process", file, "--sensor", "awr1843", "--plots", tmp_path / "figures",
                   "--out", tmp_path / "targets.mcap", "--json")  # fmt: skip
    assert run.code == 0, run.err
    assert list(run.json) == KEYS
    assert all(list(row) == DETECTION for row in run.json["detections"])
    assert run.json["frames"] == 1
    assert len(run.json["detections"]) == len(targets(tmp_path / "targets.mcap")) >= 10
    assert run.json["seconds_per_frame"] > 0
    assert run.json["parameters"]["antennas"] == 8
    assert "stored unsigned" in run.err
    assert {path.name for path in (tmp_path / "figures").iterdir()} == FIGURES
    for path in (tmp_path / "figures").iterdir():
        with Image.open(path) as image:
            assert image.size >= (900, 500)
            assert len(set(image.convert("L").get_flattened_data())) > 20
    again = hedgehop("radar", "process", file, "--out", tmp_path / "again.mcap", "--json")
    assert again.json["detections"] == run.json["detections"]
    assert np.array_equal(targets(tmp_path / "again.mcap"), targets(tmp_path / "targets.mcap"))


def test_a_capture_with_its_configuration_puts_the_target_where_it_is(tmp_path: Path) -> None:
    setup = config()
    params = FmcwParams(
        start_frequency_hz=setup.start_frequency_hz + setup.slope_hz_per_s * setup.adc_start_s,
        slope_hz_per_s=setup.slope_hz_per_s, sample_rate_hz=setup.sample_rate_hz, samples=256, chirps=60,
        chirp_interval_s=setup.chirp_interval_s, antennas=AWR1843.antennas, tdm_order=AWR1843.tdm_order,
    )  # fmt: skip
    (tmp_path / "radar.cfg").write_text(GOOD)
    frames = [echo(params, 40.0, -3.0, 0.3), echo(params, 39.7, -3.0, 0.3)]
    (tmp_path / "adc.bin").write_bytes(dca1000_bytes(frames, q_first=True))
    run = hedgehop("radar", "process", tmp_path / "adc.bin", "--cfg", tmp_path / "radar.cfg",
                   "--out", tmp_path / "targets.mcap", "--json")  # fmt: skip
    assert run.code == 0, run.err
    assert run.json["frames"] == 2
    x, y, _, speed, _ = targets(tmp_path / "targets.mcap")[0]
    assert np.hypot(x, y) == pytest.approx(40.0, abs=0.2)
    strongest = [next(row for row in run.json["detections"] if row["frame"] == frame) for frame in (0, 1)]
    for row, range_m in zip(strongest, (40.0, 39.7), strict=True):
        assert row["range_m"] == pytest.approx(range_m, abs=0.2)
        assert row["azimuth_deg"] == pytest.approx(np.degrees(np.arcsin(0.3)), abs=1.0)
        assert row["radial_speed_m_s"] == pytest.approx(-3.0, abs=0.1)
        assert np.hypot(row["x_right_m"], row["y_forward_m"]) == pytest.approx(
            row["range_m"] * np.cos(np.radians(row["elevation_deg"])), abs=1e-3
        )
        assert row["z_up_m"] == pytest.approx(row["range_m"] * np.sin(np.radians(row["elevation_deg"])), abs=1e-3)
        assert row["snr_db"] > 30.0
        assert min(row["doppler_cell"], row["range_cell"]) >= 0
    assert [row["t_s"] for row in strongest] == [0.0, 0.1]
    assert np.degrees(np.arctan2(x, y)) == pytest.approx(np.degrees(np.arcsin(0.3)), abs=1.0)
    assert speed == pytest.approx(-3.0, abs=0.1)
    plain = hedgehop("radar", "process", tmp_path / "adc.bin", "--cfg", tmp_path / "radar.cfg", "--frames", 1)
    assert "detections in 1 frame," in plain.out
    assert "azimuth" in plain.out


def test_oda_rows_are_those_of_a_position2go(tmp_path: Path) -> None:
    made = [echo(POSITION2GO, 6.0, 1.0, -0.2) for _ in range(3)]
    (tmp_path / "radar.csv").write_text("\n".join(oda_line(k * 63_694_000, cube) for k, cube in enumerate(made)))
    run = hedgehop("radar", "process", tmp_path / "radar.csv", "--plots", tmp_path, "--plot-frame", 2,
                   "--out", tmp_path / "targets.mcap", "--json")  # fmt: skip
    assert run.code == 0, run.err
    assert (run.json["frames"], run.json["parameters"]["sensor"]) == (3, "position2go")
    x, y, _, speed, _ = targets(tmp_path / "targets.mcap")[0]
    assert np.hypot(x, y) == pytest.approx(6.0, abs=0.3)
    assert np.degrees(np.arctan2(x, y)) == pytest.approx(-11.5, abs=1.5)
    assert speed == pytest.approx(1.0, abs=0.2)
    assert {path.name for path in tmp_path.glob("*.png")} == FIGURES


def test_offset_binary_is_told_and_may_be_said(tmp_path: Path) -> None:
    (tmp_path / "radar.cfg").write_text(GOOD)
    setup = fmcw_params(config())
    stored = dca1000_bytes([echo(setup, 40.0, -3.0, 0.3)], q_first=True)
    offset = (np.frombuffer(stored, "<i2").astype(np.int64) + 32768).astype("<u2").tobytes()
    (tmp_path / "offset.bin").write_bytes(offset)
    (tmp_path / "noise.bin").write_bytes(np.random.default_rng(1).bytes(len(stored)))
    arguments = ("--cfg", tmp_path / "radar.cfg", "--json")
    run = hedgehop("radar", "process", tmp_path / "offset.bin", *arguments)
    assert run.json["detections"][0]["range_m"] == pytest.approx(40.0, abs=0.2)
    assert "offset binary of 16 bits" in run.err
    asked = hedgehop("radar", "process", tmp_path / "offset.bin", "--samples", "offset-binary", *arguments)
    assert asked.json["detections"] == run.json["detections"]
    for name, samples_as in (("offset.bin", "twos-complement"), ("noise.bin", "auto")):
        wrong = hedgehop("radar", "process", tmp_path / name, "--samples", samples_as, *arguments)
        assert wrong.code == 2
        assert "no unclipped signal" in wrong.json["error"]["what"]


def test_noise_alone_is_drawn_too(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(size=(16, 64)) + 1j * rng.normal(size=(16, 64))
    run = hedgehop("radar", "process", save(tmp_path / "noise.npy", noise), "--plots", tmp_path / "new" / "figures")
    assert run.code == 0, run.err
    assert len(list((tmp_path / "new" / "figures").iterdir())) == 3


def test_what_is_wrong_is_said_before_anything_is_written(tmp_path: Path) -> None:
    good = save(tmp_path / "good.npy", echo(POSITION2GO, 6.0, 1.0, 0.0))
    holed = echo(POSITION2GO, 6.0, 1.0, 0.0)
    holed[3, 1, 7] = np.nan
    both = save(tmp_path / "holed.npy", np.stack((echo(POSITION2GO, 6.0, 1.0, 0.0), holed)))
    (tmp_path / "radar.cfg").write_text(GOOD)
    before = sorted(tmp_path.iterdir())
    for arguments, words in (
        ((tmp_path / "none.npy",), "No such file"),
        ((good, "--sensor", "awr1843"), "2 antennas"),
        ((good, "--cfg", tmp_path / "radar.cfg"), "16 x 2 x 64"),
        ((good, "--sensor", "position2go", "--cfg", tmp_path / "radar.cfg"), "no .cfg"),
        ((good, "--sensor", "position2go", "--out", tmp_path / "a.csv"), "no format of recordings"),
        ((good, "--sensor", "position2go", "--plot-frame", 5, "--plots", tmp_path), "Frame 5 is not in the file"),
        ((good, "--sensor", "position2go", "--plot-frame", 5, "--plots", tmp_path / "p", "--out", tmp_path / "a.mcap"),
         "Frame 5 is not in the file"),
        ((both, "--sensor", "position2go", "--out", tmp_path / "a.mcap"), "holed.npy, frame 1"),
        ((both, "--sensor", "position2go", "--plots", tmp_path), "holed.npy, frame 1"),
        ((good, "--sensor", "position2go", "--out", tmp_path / "nowhere" / "a.mcap"), f"{tmp_path}/nowhere/a.mcap"),
        ((tmp_path / "radar.cfg",), "no format of raw samples"),
    ):  # fmt: skip
        run = hedgehop("radar", "process", *arguments)
        assert run.code == 2, arguments
        assert words in run.err
        assert sorted(tmp_path.iterdir()) == before
    as_json = hedgehop("radar", "process", good, "--json")
    assert as_json.json["error"]["code"] == "radar_data"


def test_the_help_shows_examples() -> None:
    run = hedgehop("radar", "process", "--help")
    assert run.code == 0
    assert "hedgehop radar process" in run.out.split("Examples:")[1]
    assert "process" in hedgehop("radar").out
