"""A UWB radar's scans get the places where they were made, live and from a recording."""

from __future__ import annotations

import math
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.uwb.uwb_params import UwbGeometry
from planning.ground.traversable import UwbScans
from telemetry.errors import RecordingError
from telemetry.perception import uwb_drive
from telemetry.perception.uwb_drive import UwbDrive, read_scans, recorded_scans
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.recordings import write_flight
from tests.telemetry.uwb_drives import T0_MONO_S, T0_UTC_S, on_the_bus, scan_of, state_of, write_recording

HERE = (-37.0, 175.0)
METRE_DEG = 1.0 / 111_132.0


def log(count: int = 40) -> UwbScans:
    """Northward at 1 m/s, turning slowly past north."""
    t_s = 0.1 * np.arange(count, dtype=np.float64)
    places = np.column_stack([HERE[0] + 0.1 * METRE_DEG * np.arange(count), np.full(count, HERE[1])])
    heading = np.remainder(np.radians(np.linspace(355.0, 368.0, count)), 2 * math.pi)
    intensity = np.arange(count)[:, None] + np.arange(16)[None, :]
    return UwbScans(t_s, places, heading, intensity.astype(np.float32), UwbGeometry(16))


def driven(scans: UwbScans) -> UwbDrive:
    drive = UwbDrive()
    for message in on_the_bus(scans):
        drive.on_scan(message) if hasattr(message, "intensity") else drive.on_state(message)  # type: ignore[arg-type]
    drive.finish()
    return drive


def apart_m(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    scale = np.array([1.0, math.cos(math.radians(HERE[0]))]) / METRE_DEG
    return np.linalg.norm((one - other) * scale, axis=1)


def test_scans_are_placed_between_the_states_around_them() -> None:
    wanted, drive = log(), driven(log())
    found = drive.scans()
    assert (len(drive), drive.unplaced, drive.source) == (40, 0, "rover")
    # At its end the drive stops from one state to the next.
    assert apart_m(found.lat_lon_deg, wanted.lat_lon_deg)[:-2].max() < 0.005
    turned = np.remainder(found.heading_rad - wanted.heading_rad + math.pi, 2 * math.pi) - math.pi
    assert np.abs(turned).max() < math.radians(0.2)
    assert found.t_s == pytest.approx(wanted.t_s)
    assert np.array_equal(found.intensity, wanted.intensity)


def test_the_beams_bearing_counts_from_the_nose() -> None:
    drive = UwbDrive()
    drive.on_state(state_of(10.0, *HERE, math.radians(350.0)))
    drive.on_scan(scan_of(0, 10.0, np.ones(16), bearing_rad=math.radians(30.0)))
    assert drive.scans().heading_rad == pytest.approx([math.radians(20.0)])


def test_what_cannot_be_placed_is_counted() -> None:
    drive = UwbDrive()
    drive.on_scan(scan_of(0, 1.0, np.ones(16)))
    drive.on_scan(scan_of(1, 9.9, np.ones(16)))
    assert (len(drive), drive.unplaced) == (0, 1)
    drive.on_state(state_of(10.0, *HERE, 0.0))
    drive.on_scan(scan_of(2, 9.95, np.ones(16)))
    drive.on_scan(scan_of(3, 9.94, np.ones(16)))
    assert (len(drive), drive.unplaced) == (2, 2)
    drive.on_scan(scan_of(4, 9.97, np.ones(17)))
    drive.on_scan(scan_of(5, 9.98, np.ones(16), bin_m=0.2))
    assert (len(drive), drive.other_geometry) == (2, 2)
    assert drive.left_out == (
        "Scans left out: 2, where the vehicle was is not known; 2, other range bins than at first."
    )


def test_a_drive_takes_so_much_and_no_more() -> None:
    drive = UwbDrive(most_bytes=3 * 16 * 4)
    drive.on_state(state_of(10.0, *HERE, 0.0))
    for k in range(5):
        drive.on_scan(scan_of(k, 9.9 + 0.01 * k, np.ones(16)))
    assert (len(drive), drive.is_full) == (3, True)


def test_a_recording_gives_the_same_scans_back(tmp_path: Path) -> None:
    found, live = recorded_scans(write_recording(tmp_path / "drive.mcap", log())), driven(log()).scans()
    assert apart_m(found.lat_lon_deg, live.lat_lon_deg).max() < 1e-6
    assert np.array_equal(found.heading_rad, live.heading_rad)
    assert np.array_equal(found.intensity, live.intensity)
    assert read_scans(tmp_path / "drive.mcap", "drive.mcap").geometry == log().geometry


def test_what_of_a_recording_counts_for_nothing_is_told_with_the_scans(tmp_path: Path) -> None:
    assert recorded_scans(write_recording(tmp_path / "drive.mcap", log())).left_out == ""
    with closing(RecordingWriter(tmp_path / "late.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name="late")) as writer:
        for k in range(3):  # the link was connected after the sensor
            writer.write(Topic.UWB_SCAN, early := scan_of(k, T0_MONO_S + k, np.ones(16)), early.t_utc_s)
        for message in on_the_bus(replace(log(), t_s=log().t_s + 60.0)):
            topic = Topic.VEHICLE if isinstance(message, VehicleState) else Topic.UWB_SCAN
            writer.write(topic, message, message.t_utc_s)
    found = recorded_scans(tmp_path / "late.mcap")
    assert len(found.t_s) == 40
    assert found.left_out == "Scans left out: 3, where the vehicle was is not known."


def test_a_recording_of_more_scans_than_are_kept_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(uwb_drive, "MOST_BYTES", 39 * 16 * 4)
    with pytest.raises(RecordingError, match="more than 0 MB of scans"):
        recorded_scans(write_recording(tmp_path / "long.mcap", log()))


def test_recordings_without_scans_or_without_places_say_so(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no scans of a UWB radar"):
        recorded_scans(write_flight(tmp_path / "flight.mcap", seconds=1.0))
    with pytest.raises(RecordingError, match="None of its 40 UWB scans can be placed"):
        recorded_scans(write_recording(tmp_path / "blind.mcap", log(), poses=False))
