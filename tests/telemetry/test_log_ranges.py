"""Distance sensors in vehicles' own logs, against a wall whose place is known."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from mapping.geometry.arrays import F64
from mapping.geometry.frames import LocalFrame, heading_rotation
from mapping.sensor_frames import RangeFrame
from telemetry.errors import RecordingError
from telemetry.perception.rebuilding.log_readers import log_kind
from telemetry.perception.rebuilding.range_flight import RangeFlight, write_range_flight
from telemetry.perception.rebuilding.rebuild import rebuild
from telemetry.perception.sensor_kinds import RANGES
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.vehicle_logs.dataflash_ranges import read_dataflash_ranges
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.own_logs import dataflash, ulog
from tests.telemetry.range_logs import (
    HOME,
    RANGES_HZ,
    UP_M,
    Flight,
    dataflash_of,
    times,
    ulog_of,
    with_finder,
    with_proximity,
    with_single,
)
from tests.telemetry.recordings import tlog_record

AHEAD_DOWN = Flight(pitch=math.radians(-10.0))
LEFT_UP = Flight(heading=math.pi / 2, roll=math.radians(10.0), looks=(-1.0, 0.0, 0.0))
ASKEW = Flight(heading=0.3, pitch=-0.2, roll=0.15, looks=(math.sin(0.5), math.cos(0.5), 0.0))
MEASUREMENTS = len(list(times(RANGES_HZ)))


def made(folder: Path, data: bytes, name: str) -> tuple[RangeFlight, Path]:
    log, out = folder / name, folder / f"{name}.mcap"
    log.write_bytes(data)
    kind = log_kind(log)
    assert kind is not None
    return write_range_flight(log, out, kind), out


def refused(folder: Path, data: bytes, name: str) -> str:
    with pytest.raises(RecordingError) as caught:
        made(folder, data, name)
    assert caught.value.where == name
    return f"{caught.value.what} {caught.value.advice}"


def points_of(recording: Path) -> F64:
    """(N, 3) where the frames put what was hit, in metres from home."""
    found, state = list[F64](), VehicleState(1, 1)
    with open_recording(recording) as opened:
        for entry in opened.entries((Topic.VEHICLE, Topic.RANGE_FRAME)):
            if isinstance(entry.message, VehicleState):
                state = entry.message
            elif isinstance(frame := entry.message, RangeFrame):
                assert frame.looks_rad == ()
                b, e, r = (np.array(a) for a in (frame.bearing_rad, frame.elevation_rad, frame.range_m))
                level = np.column_stack([np.cos(e) * np.sin(b), np.cos(e) * np.cos(b), np.sin(e)]) * r[:, None]
                home = LocalFrame(state.home_lat_deg or 0.0, state.home_lon_deg or 0.0, state.home_alt_amsl_m or 0.0)
                at = home.to_enu(state.lat_deg or 0.0, state.lon_deg or 0.0, state.alt_amsl_m or 0.0)[0]
                found.append(level @ heading_rotation(state.heading_rad or 0.0).T + at)
    return np.concatenate(found)


@pytest.mark.parametrize(("flight", "orientation"), [(AHEAD_DOWN, 0), (LEFT_UP, 6)])
@pytest.mark.parametrize("placed", ["global", "local"])
def test_of_px4_the_wall_stands_where_it_is(tmp_path: Path, flight: Flight, orientation: int, placed: str) -> None:
    data = with_single(ulog_of(flight, placed=placed), flight, orientation)
    told, out = made(tmp_path, data, "a.ulg")
    # A float of a height over 500 m, and the difference between PX4's sphere and the ellipsoid over 24 m.
    np.testing.assert_allclose(points_of(out), flight.hits(), atol=0.1 if placed == "local" else 1e-3)
    assert (told.frames, told.left_out) == (MEASUREMENTS, 0)
    beyond = MEASUREMENTS - len(flight.hits())
    assert beyond > 0
    assert told.notes[0] == f"Measurements in the log: distance_sensor 1: {MEASUREMENTS}; {beyond} hit nothing."


def test_a_sensor_that_is_askew_is_turned_by_its_quaternion(tmp_path: Path) -> None:
    data = with_single(ulog_of(ASKEW), ASKEW, 100, q=(math.cos(0.25), 0.0, 0.0, math.sin(0.25)))
    np.testing.assert_allclose(points_of(made(tmp_path, data, "a.ulg")[1]), ASKEW.hits(), atol=1e-3)
    words = refused(tmp_path, with_single(ulog_of(ASKEW), ASKEW, 100), "b.ulg")
    assert f"{MEASUREMENTS} (distance_sensor 1: orientation 100 is not understood)" in words


@pytest.mark.parametrize(("flight", "orientation"), [(AHEAD_DOWN, 0), (LEFT_UP, 6)])
@pytest.mark.parametrize(("placed", "turned"), [("POS", "ATT"), ("AHR2", "AHR2")])
def test_of_ardupilot_the_wall_stands_where_it_is(
    tmp_path: Path, flight: Flight, orientation: int, placed: str, turned: str
) -> None:
    data = with_finder(dataflash_of(flight, placed=placed, turned=turned), flight, orientation)
    told, out = made(tmp_path, data, "a.bin")
    np.testing.assert_allclose(points_of(out), flight.hits(), atol=0.02)
    assert told.left_out == 0
    assert any("second estimator" in note for note in told.notes) == (placed == "AHR2")
    assert any("47.0000000°, 8.0000000°, 500.00 m above sea level" in note for note in told.notes)


def test_the_map_holds_the_wall_and_nothing_else(tmp_path: Path) -> None:
    data = with_single(ulog_of(AHEAD_DOWN), AHEAD_DOWN, 0)
    _, out = made(tmp_path, data, "a.ulg")
    built = rebuild(out, RANGES)
    shifts = np.array(list(product((-1e-3, 1e-3), repeat=3)))
    around = (AHEAD_DOWN.hits()[:, None] + shifts).reshape(-1, 3)
    keys = set(map(tuple, built.folded.voxels.occupied().keys.tolist()))
    assert keys <= set(map(tuple, np.floor(around / built.resolution_m).astype(int).tolist()))
    assert len(keys) >= 4
    assert built.dropped == 0


def test_what_is_not_valid_is_no_obstacle(tmp_path: Path) -> None:
    assert "signal invalid" in refused(tmp_path, with_single(ulog_of(AHEAD_DOWN), AHEAD_DOWN, 0, quality=0), "a.ulg")
    for status in (0, 1):
        data = with_finder(dataflash_of(AHEAD_DOWN), AHEAD_DOWN, 0, status=status)
        assert "not connected, or no data" in refused(tmp_path, data, "a.bin")
    for status in (2, 3):
        data = with_finder(dataflash_of(AHEAD_DOWN), AHEAD_DOWN, 0, status=status)
        told, out = made(tmp_path, data, f"b{status}.bin")
        assert len(points_of(out)) == 0
        assert told.frames == MEASUREMENTS
    assert "orientation 9" in refused(tmp_path, with_finder(dataflash_of(AHEAD_DOWN), AHEAD_DOWN, 9), "c.bin")


def test_sectors_of_px4_from_north_and_from_the_nose(tmp_path: Path) -> None:
    east = Flight(heading=math.pi / 2)
    log = ulog_of(east)
    log.describe(
        "obstacle_distance",
        "uint16_t[72] distances;float increment;float angle_offset;uint16_t min_distance;uint16_t max_distance;"
        "uint8_t frame;",
    )
    distances = [500, 65535, 2001] + [65535] * 69
    log.write("obstacle_distance", 1.0, "72HffHHB", *distances, 5.0, 0.0, 20, 2000, 0)
    log.write("obstacle_distance", 2.0, "72HffHHB", *distances, 5.0, 0.0, 20, 2000, 12)
    log.write("obstacle_distance", 3.0, "72HffHHB", *distances, 0.0, 0.0, 20, 2000, 12)
    told, out = made(tmp_path, log.data, "a.ulg")
    np.testing.assert_allclose(points_of(out), [[0.0, 9.0, UP_M], [5.0, 8.0, UP_M]], atol=1e-3)
    assert "1 (obstacle_distance 0: not valid, or not understood)" in told.notes[1]


@pytest.mark.parametrize("name", ["PRX", "PRXR"])
def test_sectors_of_ardupilot_where_the_farthest_is_nothing(tmp_path: Path, name: str) -> None:
    none = 12.0
    rows = [(2, [none, none, 5.0, none, none, none, none, 0.0]), (3, [6.0, *[none] * 7]), (2, [1e30, *[none] * 7])]
    told, out = made(tmp_path, with_proximity(dataflash_of(Flight()), name, rows), "a.bin")
    up_m, ahead_m = 6.0 * math.sin(math.radians(30.0)), 6.0 * math.cos(math.radians(30.0))
    np.testing.assert_allclose(points_of(out), [[5.0, 0.0, UP_M], [0.0, 2.0 + ahead_m, UP_M + up_m]], atol=0.02)
    assert any("PRX_LOG_RAW" in note for note in told.notes) == (name == "PRX")
    assert any("45° wide" in note for note in told.notes)


FAR = {
    "one limit": ([[40.0] * 8] * 60 + [[12.0, *[40.0] * 7]] * 5, ""),
    "one limit and a wall near by": ([[40.0] * 7 + [5.0]] * 60, ""),
    "two limits": ([[40.0] * 8] * 60 + [[20.0] * 8] * 60, "20 m 480 times"),
    "a lower limit for a while": ([[40.0] * 8] * 60 + [[20.0] * 8] * 6, "20 m 48 times"),
    "never nothing": ([[6.0 + 0.01 * (k % 50 + sector) for sector in range(8)] for k in range(120)], "if 6.56 m was"),
}


@pytest.mark.parametrize("which", FAR)
def test_a_farthest_that_is_not_clearly_nothing_is_said(tmp_path: Path, which: str) -> None:
    distances, words = FAR[which]
    found = read_dataflash_ranges(with_proximity(dataflash_of(Flight()), "PRXR", [(2, row) for row in distances]))
    said = [note for note in found.notes if "taken for nothing" in note]
    assert len(said) == bool(words)
    assert words in " ".join(said)


def test_a_ground_stations_log_with_a_companions_sensor(tmp_path: Path) -> None:
    vehicle, companion = mavlink.MAVLink(None, srcSystem=3), mavlink.MAVLink(None, srcSystem=3, srcComponent=195)
    vehicle.srcComponent = 1
    lat, lon, alt = (round(value) for value in (HOME.lat_deg * 1e7, HOME.lon_deg * 1e7, HOME.alt_m * 1e3))
    records = list[bytes]()
    for number in range(30):
        t_s, ms = 1_700_000_000.0 + number / 10, 1000 + 100 * number
        told = [
            mavlink.MAVLink_heartbeat_message(2, 3, 0, 0, 4, 3),
            mavlink.MAVLink_global_position_int_message(ms, lat, lon, alt + 10_000, 10_000, 0, 0, 0, 0),
            mavlink.MAVLink_attitude_message(ms, 0.0, math.radians(-10.0), 0.0, 0.0, 0.0, 0.0),
        ]
        records += [tlog_record(t_s, bytes(message.pack(vehicle))) for message in told]
        orientation, quality = (0, 100) if number < 20 else (0, 1)
        ranged = mavlink.MAVLink_distance_sensor_message(
            ms, 20, 3000, 1000, 0, 1, orientation, 255, signal_quality=quality
        )
        records.append(tlog_record(t_s + 0.001, bytes(ranged.pack(companion))))
    told, out = made(tmp_path, b"".join(records), "a.tlog")
    down, ahead = 10.0 * math.sin(math.radians(10.0)), 10.0 * math.cos(math.radians(10.0))
    found = points_of(out)
    np.testing.assert_allclose(found, np.tile([0.0, ahead, -down], (20, 1)), atol=0.02)
    assert any("10 (DISTANCE_SENSOR 195/1: not valid, or not understood)" in note for note in told.notes)
    assert any("when messages came" in note for note in told.notes)


@pytest.mark.parametrize(
    ("data", "name", "words"),
    [
        (ulog(), "a.ulg", "no distance that could be mapped (distance_sensor or obstacle_distance)"),
        (dataflash(), "a.bin", "no distance that could be mapped (RFND, PRX or PRXR)"),
        (with_single(ulog_of(AHEAD_DOWN, placed="no"), AHEAD_DOWN, 0), "a.ulg", "no position with a height"),
        (with_single(ulog_of(AHEAD_DOWN, turned=False), AHEAD_DOWN, 0), "a.ulg", "no attitude (vehicle_attitude)"),
        (with_finder(dataflash_of(AHEAD_DOWN, placed="no"), AHEAD_DOWN, 0), "a.bin", "position with a height"),
        (with_finder(dataflash_of(AHEAD_DOWN, turned="no"), AHEAD_DOWN, 0), "a.bin", "no attitude (ATT, XKF1 or AHR2)"),
    ],
)
def test_what_is_missing_is_said(tmp_path: Path, data: bytes, name: str, words: str) -> None:
    assert words in refused(tmp_path, data, name)


def test_without_home_the_map_counts_from_the_first_position(tmp_path: Path) -> None:
    data = with_single(ulog_of(AHEAD_DOWN, home=False), AHEAD_DOWN, 0)
    told, out = made(tmp_path, data, "a.ulg")
    np.testing.assert_allclose(points_of(out), AHEAD_DOWN.hits() - [0.0, 0.0, UP_M], atol=1e-3)
    assert any("tells no home" in note for note in told.notes)


def test_distances_of_other_times_than_the_poses_are_left_out(tmp_path: Path) -> None:
    log = ulog_of(AHEAD_DOWN)
    log.describe("distance_sensor", "float min_distance;float max_distance;float current_distance;uint8_t orientation;")
    for t in (3.0, 6.1, 9.0, 9.5):
        log.write("distance_sensor", t, "fffB", 0.5, 30.0, 5.0, 0)
    told, out = made(tmp_path, log.data, "a.ulg")
    assert (told.frames, told.left_out, len(points_of(out))) == (2, 2, 2)
    assert "2 measurements were left out: position too far in time." in told.notes
    late = ulog_of(AHEAD_DOWN)
    late.describe(
        "distance_sensor", "float min_distance;float max_distance;float current_distance;uint8_t orientation;"
    )
    late.write("distance_sensor", 9.0, "fffB", 0.5, 30.0, 5.0, 0)
    assert "No measurement could be placed (1: position too far in time)" in refused(tmp_path, late.data, "b.ulg")
