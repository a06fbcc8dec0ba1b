"""Any recording as one flight log, and clear words for everything else."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from planning.formats.wpl import read_wpl
from telemetry.errors import RecordingError
from telemetry.recording.flight_log import FlightLog, read_flight_log
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.checklist import ChecklistPoint, ChecklistRecord
from telemetry.topics.messages import Topic, VehicleText
from telemetry.topics.obstacles import AvoidanceStatus
from tests.telemetry.recordings import (
    HOME,
    MISSION,
    PLAN,
    T0_MONO_S,
    T0_UTC_S,
    flight,
    heartbeat,
    tlog_record,
    write_flight,
)


@pytest.fixture(scope="module")
def auto(shared_data: Path) -> FlightLog:
    return read_flight_log(shared_data / "logs" / "arducopter" / "auto.tlog")


def test_a_log_of_another_ground_station_becomes_a_flight(auto: FlightLog) -> None:
    assert auto.kind == "tlog"
    assert auto.end_utc_s - auto.start_utc_s == pytest.approx(394, abs=0.5)
    assert [mode for _, mode in auto.modes] == ["STABILIZE", "GUIDED", "AUTO"]
    assert [armed for _, armed in auto.armed] == [False, True, False]
    assert [seq for _, seq in auto.reached] == list(range(1, 88))
    assert len(auto.texts) == 209
    assert auto.vehicle.autopilot == "ardupilot"
    assert auto.faults == ()


def test_every_position_is_a_row_with_its_time(auto: FlightLog, shared_data: Path) -> None:
    """3,913 GLOBAL_POSITION_INT, of which the first ones have no position yet."""
    assert 3800 < len(auto.track) == len(auto.states) <= 3913
    assert auto.track.t_utc_s.tolist() == [t for t, _ in auto.states]
    assert np.all(np.diff(auto.track.t_utc_s) >= 0)
    assert np.all(np.isfinite([auto.track.lat_deg, auto.track.lon_deg, auto.track.alt_rel_home_m]))
    row = len(auto.track) // 2
    assert auto.states[row][1].lat_deg == auto.track.lat_deg[row]
    assert auto.t_s[0] == pytest.approx(auto.track.t_utc_s[0] - auto.start_utc_s)


def test_the_flight_from_the_first_to_the_last_waypoint_has_the_readmes_positions(auto: FlightLog) -> None:
    """2,216 positions of the vehicle's own and 1,108 true ones in 221.6 s."""
    assert auto.truth is not None
    times = {seq: t for t, seq in auto.reached}
    for track, count in ((auto.track, 2216), (auto.truth, 1108)):
        within = (track.t_utc_s >= times[2]) & (track.t_utc_s <= times[86])
        assert int(within.sum()) == pytest.approx(count, abs=2)
    assert times[86] - times[2] == pytest.approx(221.6, abs=0.2)


def test_the_truth_is_near_what_the_vehicle_believes(auto: FlightLog) -> None:
    assert auto.truth is not None
    assert len(auto.truth) == 1957
    late = auto.truth.t_utc_s > auto.armed[1][0]
    believed = np.interp(auto.truth.t_utc_s[late], auto.track.t_utc_s, auto.track.alt_rel_home_m)
    assert np.abs(auto.truth.alt_rel_home_m[late] - believed).max() < 1.0
    assert (
        np.abs(np.interp(auto.truth.t_utc_s, auto.track.t_utc_s, auto.track.lat_deg) - auto.truth.lat_deg).max() < 1e-4
    )


def test_the_mission_is_what_was_on_board(auto: FlightLog, shared_data: Path) -> None:
    sent = read_wpl((shared_data / "logs" / "arducopter" / "mission.waypoints").read_bytes())
    assert auto.mission is not None
    assert auto.mission.firmware == "ardupilot"
    assert len(auto.mission.items) == len(sent.items) == 87
    for found, item in zip(auto.mission.items, sent.items, strict=True):
        assert found.command == item.command
        assert found.alt_m == pytest.approx(item.alt_m, abs=0.011)
        assert found.lat_deg == pytest.approx(item.lat_deg, abs=2e-7)
    assert auto.home is not None
    assert auto.mission.home.lat_deg == pytest.approx(auto.home.lat_deg, abs=1e-6)


def test_targets_of_a_guided_flight(shared_data: Path) -> None:
    log = read_flight_log(shared_data / "logs" / "arducopter" / "guided.tlog")
    assert len(log.targets) == 30
    assert log.mission is None
    rtl = next(t for t, mode in log.modes if mode == "RTL")
    assert rtl - log.targets[0].t_utc_s == pytest.approx(63.8, abs=0.3)


def test_modes_of_a_flight_with_a_failsafe(shared_data: Path) -> None:
    log = read_flight_log(shared_data / "logs" / "arducopter" / "gcs_failsafe.tlog")
    assert [mode for _, mode in log.modes] == ["STABILIZE", "GUIDED", "AUTO", "RTL", "AUTO", "RTL"]
    assert log.modes[3][0] - log.start_utc_s == pytest.approx(83.8, abs=0.1)


def test_refused_uploads_are_not_the_mission(shared_data: Path) -> None:
    log = read_flight_log(shared_data / "logs" / "arducopter" / "rejects.tlog")
    assert log.mission is not None
    assert len(log.mission.items) == 87


def test_a_damaged_log_says_so_and_shows_the_vehicle_with_positions(shared_data: Path) -> None:
    log = read_flight_log(shared_data / "logs" / "dronekit" / "flight.tlog")
    assert (log.vehicle.system_id, log.vehicle.component_id) == (1, 1)
    assert 2600 < len(log.track) <= 2833
    assert any("1314 damaged stretches" in fault for fault in log.faults)
    assert any(armed for _, armed in log.armed)
    assert log.mission is None


@pytest.mark.parametrize("finish", [True, False])
def test_hedgehops_own_recording(tmp_path: Path, finish: bool) -> None:
    log = read_flight_log(write_flight(tmp_path / "a.mcap", finish=finish))
    assert (log.kind, log.name) == ("hedgehop", "a.mcap")
    assert len(log.track) == 201
    assert log.track.t_utc_s == pytest.approx(T0_UTC_S + np.arange(201) / 10, abs=1e-6)
    assert [armed for _, armed in log.armed] == [False, True, False]
    assert log.plan == PLAN
    assert log.mission is not None
    assert len(log.mission.items) == len(MISSION.items)
    assert (log.home and log.home.lat_deg) == HOME[0]
    assert [text.text for text in log.texts] == ["Half of it flown"]
    assert [command.words for command in log.commands] == ["start the mission"]
    assert len(log.faults) == (0 if finish else 1)


def test_without_a_plan_the_mission_comes_from_the_frames(tmp_path: Path, shared_data: Path) -> None:
    """The real log's frames, recorded as Hedgehop records them."""
    from telemetry.recording.tlog import tlog_frames
    from telemetry.topics.messages import RawFrame

    writer = RecordingWriter(tmp_path / "b.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S)
    for t_s, topic, message in flight(1.0):
        if topic != Topic.PLAN:
            writer.write(topic, message, T0_UTC_S + t_s)
    for entry in tlog_frames((shared_data / "logs" / "arducopter" / "auto.tlog").read_bytes()):
        raw = RawFrame(entry.t_utc_s, entry.system_id == 255, "tcp:127.0.0.1:5760", entry.frame)
        writer.write(Topic.RAW, raw, entry.t_utc_s)
    writer.close()
    log = read_flight_log(tmp_path / "b.mcap")
    assert log.plan is None
    assert log.mission is not None
    assert len(log.mission.items) == 87
    assert log.truth is not None
    assert len(log.truth) == 1957
    assert [seq for _, seq in log.reached] == list(range(1, 88))


def test_a_recording_without_a_vehicle(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "c.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S)
    writer.write(Topic.TEXT, VehicleText(T0_UTC_S, 6, "hello"), T0_UTC_S)
    writer.close()
    with pytest.raises(RecordingError, match="no vehicle"):
        read_flight_log(tmp_path / "c.mcap")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty"),
        (b"QGC WPL 110\n", "text"),
        (b"II*\x00" + bytes(100), "TIFF"),
        (b"PK\x03\x04" + bytes(100), "ZIP"),
        (b"\x89MCAP", "cut off"),
        (b"\x89MCAP0\r\n", "cut off"),
        (bytes(range(256)) * 20, "unknown kind"),
        (b"\x89MCAP0\r\n" + b"\xff" * 50, "cut off"),
    ],
)
def test_files_that_are_no_recording(tmp_path: Path, content: bytes, words: str) -> None:
    path = tmp_path / "upload.tlog"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=re.escape(words)) as caught:
        read_flight_log(path)
    assert caught.value.where == "upload.tlog"
    assert caught.value.advice


def test_foreign_files_of_the_data_folder(shared_data: Path) -> None:
    for name, words in (
        ("dsm/coromandel/coromandel_dsm_050.tif", "TIFF"),
        ("logs/arducopter/mission.waypoints", "text"),
    ):
        with pytest.raises(RecordingError, match=words):
            read_flight_log(shared_data / name)


def test_missing_files_and_folders(tmp_path: Path) -> None:
    for path in (tmp_path / "none.mcap", tmp_path):
        with pytest.raises(RecordingError, match="no such recording"):
            read_flight_log(path)


def test_another_programs_mcap_is_named(tmp_path: Path) -> None:
    from mcap.writer import Writer

    with (tmp_path / "ros.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(library="rosbag2")
        writer.finish()
    with pytest.raises(RecordingError, match="rosbag2"):
        read_flight_log(tmp_path / "ros.mcap")


def test_a_log_without_an_autopilot(tmp_path: Path) -> None:
    from pymavlink.dialects.v20 import ardupilotmega as mavlink

    gcs = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    frame = bytes(gcs.heartbeat_encode(6, 8, 0, 0, 0).pack(gcs))
    (tmp_path / "gcs.tlog").write_bytes(b"".join(tlog_record(T0_UTC_S + n, frame) for n in range(9)))
    with pytest.raises(RecordingError, match="none of an autopilot"):
        read_flight_log(tmp_path / "gcs.tlog")


def test_a_log_without_positions_opens(tmp_path: Path) -> None:
    (tmp_path / "a.tlog").write_bytes(b"".join(tlog_record(T0_UTC_S + n, heartbeat(n)) for n in range(9)))
    log = read_flight_log(tmp_path / "a.tlog")
    assert len(log.track) == 0
    assert log.modes == ((T0_UTC_S, "AUTO"),)
    assert log.home is None
    assert any("no position" in fault for fault in log.faults)
    assert math.isclose(log.end_utc_s - log.start_utc_s, 8.0)


def test_what_avoidance_said_of_itself_is_kept_where_its_state_changed(tmp_path: Path) -> None:
    clock = [0.0]
    path = tmp_path / "avoided.mcap"
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, name="by hand", now=lambda: clock[0])
    said = (
        (5.0, AvoidanceStatus(True, "climbing", "Braking.")),
        (6.0, AvoidanceStatus(True, "climbing", "Climbing.")),
        (9.0, AvoidanceStatus(True, "offset", height_offset_m=9.0)),
    )
    entries = [*flight(), *((t_s, Topic.AVOIDANCE, status) for t_s, status in said)]
    for t_s, topic, message in sorted(entries, key=lambda entry: entry[0]):
        clock[0] = t_s
        writer.write(topic, message, T0_UTC_S + t_s)
    writer.close()
    kept = read_flight_log(path).avoidance
    assert [(round(t - T0_UTC_S, 1), status.state) for t, status in kept] == [(5.0, "climbing"), (9.0, "offset")]


def _ticked(t_s: float, *, by: str, started: bool) -> ChecklistRecord:
    t_utc_s = T0_UTC_S + t_s
    point = ChecklistPoint("Propellers", "Vehicle", by, t_utc_s - 1.0)
    return ChecklistRecord(t_utc_s, "Quad", "x", "d", (point,), t_utc_s if started else None)


@pytest.mark.parametrize(
    ("told", "by"),
    [
        ([], None),
        ([_ticked(0.1, by="Anna", started=False)], None),
        ([_ticked(-100.0, by="Anna", started=True)], "Anna"),
        ([_ticked(-200.0, by="Anna", started=True)], None),
        ([_ticked(0.1, by="Anna", started=True), _ticked(5.0, by="", started=False)], "Anna"),
        ([_ticked(0.1, by="Anna", started=True), _ticked(9.0, by="Ben", started=True)], "Ben"),
    ],
)
def test_the_checklist_is_the_one_that_was_ticked_for_this_flights_start(
    tmp_path: Path, told: list[ChecklistRecord], by: str | None
) -> None:
    path = tmp_path / "ticked.mcap"
    writer = RecordingWriter(path, t_mono_s=T0_MONO_S, t_utc_s=T0_UTC_S)
    for t_s, topic, message in flight(5.0):
        writer.write(topic, message, T0_UTC_S + t_s)
    for record in told:
        writer.write(Topic.CHECKLIST, record, T0_UTC_S + max(0.0, record.t_utc_s - T0_UTC_S))
    writer.close()
    log = read_flight_log(path)
    assert (None if log.checklist is None else log.checklist.points[0].ticked_by) == by
