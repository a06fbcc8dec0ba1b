"""UWB radar logs: written, read back, and refused with the field that is wrong."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mapping.uwb.uwb_params import UwbGeometry
from planning.errors import FormatError
from planning.ground.traversable import UwbScans
from telemetry.sensors import uwb_log
from telemetry.sensors.uwb_log import read_uwb_log, write_uwb_log

GOOD: dict[str, Any] = {
    "format": "hedgehop-uwb",
    "version": 1,
    "t_s": np.arange(5) / 10,
    "lat_deg": np.full(5, 50.0),
    "lon_deg": np.full(5, 14.0),
    "heading_deg": np.linspace(0, 90, 5),
    "intensity": np.arange(5 * 256, dtype=np.uint8).reshape(5, 256),
    "bin_m": 0.3,
    "first_bin_m": 0.15,
    "beamwidth_deg": 40.0,
}


def packed(**changes: Any) -> bytes:
    """A log with some fields changed, or left out when None."""
    fields = {name: value for name, value in (GOOD | changes).items() if value is not None}
    stream = io.BytesIO()
    np.savez_compressed(stream, **fields)
    return stream.getvalue()


def test_what_is_written_is_read(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    geometry = UwbGeometry(64, 0.2, 0.1, math.radians(30))
    scans = UwbScans(
        np.linspace(0.0, 0.8, 9),
        np.column_stack([random.uniform(50, 51, 9), random.uniform(14, 15, 9)]),
        random.uniform(-3, 3, 9),
        random.integers(0, 255, (9, 64), np.uint8),
        geometry,
    )
    write_uwb_log(tmp_path / "log.npz", scans)
    for source in (tmp_path / "log.npz", (tmp_path / "log.npz").read_bytes()):
        found = read_uwb_log(source)
        np.testing.assert_array_equal(found.intensity, scans.intensity)
        np.testing.assert_array_equal(found.lat_lon_deg, scans.lat_lon_deg)
        np.testing.assert_allclose(found.heading_rad, scans.heading_rad, atol=1e-12)
        np.testing.assert_array_equal(found.t_s, scans.t_s)
        assert found.geometry.bins == 64
        assert found.geometry.beamwidth_rad == pytest.approx(geometry.beamwidth_rad)


def test_the_radars_own_numbers_may_be_left_out() -> None:
    assert read_uwb_log(packed(bin_m=None, first_bin_m=None, beamwidth_deg=None)).geometry == UwbGeometry()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "other"}, "This is no UWB log"),
        ({"version": 9}, "newer Hedgehop"),
        ({"lat_deg": None}, "no lat_deg"),
        ({"t_s": np.zeros(4)}, "t_s: 4 values for 5 scans"),
        ({"t_s": np.array([0.0, 1, 2, 1.5, 3])}, "The time of scan 3"),
        ({"t_s": np.full(5, 7.0)}, "t_s: No time passes"),
        ({"t_s": np.arange(5) * 100.0}, "t_s: Scans usually follow each other after 100 s"),
        ({"t_s": np.arange(5) * 1e-5}, "not in milliseconds or ticks"),
        ({"heading_deg": np.array([0.0, 1e6, 0, 0, 0])}, "heading_deg: 1e+06 is no such angle"),
        ({"heading_deg": np.array([0.0, -361, 0, 0, 0])}, "heading_deg: -361"),
        ({"lat_deg": np.full(5, 100.0)}, "lat_deg: 100"),
        ({"lon_deg": np.array([1.0, 2, np.nan, 3, 4])}, "lon_deg: The number at (2,)"),
        ({"intensity": np.zeros((5, 256), complex)}, "complex128"),
        ({"intensity": np.zeros(256)}, "2-D numbers"),
        ({"intensity": np.zeros((5, 5000))}, "5000 range bins"),
        ({"intensity": np.array([[{}]])}, "intensity.npy"),
        ({"bin_m": "far"}, "One finite number"),
    ],
    ids=lambda value: value if isinstance(value, str) else ",".join(value),
)
def test_wrong_fields_are_named(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(FormatError) as caught:
        read_uwb_log(packed(**changes), "drive.npz")
    assert words in str(caught.value)
    assert "drive.npz" in str(caught.value)


def test_pauses_and_times_that_are_rounded_to_the_same_are_no_other_unit() -> None:
    t_s = np.array([0.0, 0.0, 0.1, 60.0, 60.1])
    np.testing.assert_array_equal(read_uwb_log(packed(t_s=t_s)).t_s, t_s)


@pytest.mark.parametrize("heading_deg", [-360.0, 720.0])
def test_headings_of_any_convention_are_taken(heading_deg: float) -> None:
    assert read_uwb_log(packed(heading_deg=np.full(5, heading_deg))).heading_rad[0] == math.radians(heading_deg)


def test_what_is_no_archive_is_refused() -> None:
    whole = packed()
    for data in (b"", b"PK\x03\x04 no zip", whole[:200], whole[: len(whole) // 2]):
        with pytest.raises(FormatError):
            read_uwb_log(data)


def test_every_damaged_byte_is_refused_or_harmless() -> None:
    whole = packed()
    refused = 0
    for at in range(0, len(whole), 37):
        damaged = bytearray(whole)
        damaged[at] ^= 0xFF
        try:
            assert read_uwb_log(bytes(damaged)).intensity.shape[0] == 5
        except FormatError:
            refused += 1
    assert refused > 10


def test_a_header_that_promises_too_much_is_not_believed() -> None:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": "<f8", "fortran_order": False, "shape": (10**9, 10**6)})
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("intensity.npy", stream.getvalue() + bytes(64))
    with pytest.raises(FormatError, match="promises"):
        read_uwb_log(archive.getvalue())


def test_a_bomb_is_refused_before_it_is_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uwb_log, "MOST_BYTES", 1000)
    with pytest.raises(FormatError, match="unpacks to"):
        read_uwb_log(packed())
