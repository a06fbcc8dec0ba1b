"""Vehicles' own logs: every value as other readers have it, and whatever is wrong with a file, an end and a word."""

from __future__ import annotations

import contextlib
import json
import math
import random
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.errors import RecordingError
from telemetry.recording.describe import describe_recording
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.replay_sources import open_source
from telemetry.recording.vehicle_logs import columns
from telemetry.recording.vehicle_logs.dataflash import read_dataflash
from telemetry.recording.vehicle_logs.ulog import read_ulog
from telemetry.topics.messages import Topic
from tests.telemetry.own_logs import (
    STARTED_UTC_S,
    DataFlashWriter,
    dataflash,
    ulog,
    ulog_head,
    ulog_record,
)

REAL_BIN, REAL_ULG = "arducopter-4.7.BIN", "px4-1.17.ulg"


def written(folder: Path, data: bytes, name: str = "a.bin") -> Path:
    (folder / name).write_bytes(data)
    return folder / name


def test_a_dataflash_log_is_a_flight_on_gps_time_at_its_own_rate(tmp_path: Path) -> None:
    log = read_flight_log(written(tmp_path, dataflash()))
    assert (log.kind, log.faults) == ("dataflash", ())
    assert len(log.track) == len(log.states) == 200
    assert log.track.t_utc_s == pytest.approx(STARTED_UTC_S + np.arange(200) / 10, abs=1e-3)
    assert set(log.track.alt_rel_home_m) == {10.0}
    assert [mode for _, mode in log.modes] == ["AUTO"]
    assert [armed for _, armed in log.armed] == [True, False]
    assert [number for _, number in log.reached] == [2]
    assert log.home is not None
    assert (log.home.lat_deg, log.home.alt_amsl_m) == (pytest.approx(48.0), 500.0)
    assert log.mission is not None
    assert [item.command for item in log.mission.items] == [22, 16]
    state = log.states[100][1]
    assert (state.system_id, state.firmware_version) == (7, "4.5.7")
    assert (state.battery_share, state.satellites, state.gnss_fix) == (0.8, 12, "3d")
    assert state.roll_rad == pytest.approx(math.radians(1.0))
    assert state.position_t_mono_s == pytest.approx(log.track.t_utc_s[100])


def test_a_ulog_is_a_flight_whose_heights_count_from_home_as_it_was_then(tmp_path: Path) -> None:
    log = read_flight_log(written(tmp_path, ulog(), "a.ulg"))
    assert (log.kind, len(log.track)) == ("ulog", 50)
    assert log.track.t_utc_s[0] == pytest.approx(1_700_000_050.0)
    assert log.track.alt_rel_home_m.tolist() == [10.0] * 25 + [9.0] * 25
    assert [mode for _, mode in log.modes] == ["MISSION"]
    assert [(t.severity, t.text) for t in log.texts] == [(4, "[commander] Armed by external command")]
    assert log.faults == ("The vehicle could not write for 0.25 s in all: what came then is missing.",)
    state = log.states[-1][1]
    assert state.heading_rad == pytest.approx(math.pi / 2)
    assert (state.system_id, state.firmware_version, state.armed) == (9, "1.14.2", True)


def test_every_record_is_as_pymavlinks_own_program_reads_it(shared_data: Path) -> None:
    """pymavlink's reader is under the GPL: it runs as a program of its own."""
    path = shared_data / "logs" / "real_flights" / REAL_BIN
    kinds = {"POS": ("Lat", "Lng", "RelHomeAlt"), "GPS": ("GMS", "GWk", "HDop"), "CMD": ("CNum", "CId", "Lat", "Alt")}
    program = [sys.executable, str(Path(sys.executable).parent / "mavlogdump.py")]
    run = subprocess.run(
        [*program, "--format", "json", "--types", ",".join(kinds), str(path)], capture_output=True, check=True
    )
    theirs: dict[str, list[dict[str, float]]] = {name: [] for name in kinds}
    for line in run.stdout.decode().splitlines():
        entry = json.loads(line)
        theirs[entry["meta"]["type"]].append(entry["data"])
    flash = read_dataflash(path.read_bytes(), kinds)
    for name, names in kinds.items():
        rows = flash.rows(name)
        assert len(rows) == len(theirs[name]) > 5
        for column in ("TimeUS", *names):
            assert rows.column(column) == pytest.approx([row[column] for row in theirs[name]], rel=1e-12), column


@pytest.mark.parametrize("name", [f"real_flights/{REAL_ULG}", "pyulog/sample_log_small.ulg"])
def test_every_topic_is_as_px4s_own_reader_has_it(shared_data: Path, name: str) -> None:
    from pyulog import ULog

    path = shared_data / "logs" / name
    theirs = ULog(str(path))
    ours = read_ulog(path.read_bytes(), {topic.name for topic in theirs.data_list})
    compared = 0
    for topic in theirs.data_list:
        rows = ours.rows(topic.name, topic.multi_id)
        for label, values in topic.data.items():
            field, _, part = label.partition("[")
            if "." in label or rows.packed.dtype[field].base.kind == "S":
                continue
            column = rows.packed[field][:, int(part[:-1])] if part else rows.packed[field]
            assert np.array_equal(column.astype(float), np.asarray(values, dtype=float), equal_nan=True), label
            compared += 1
    assert compared > 900
    assert [text for _, _, text in ours.texts] == [entry.message.strip() for entry in theirs.logged_messages]


def test_a_real_flight_of_arducopter(shared_data: Path) -> None:
    log = read_flight_log(shared_data / "logs" / "real_flights" / REAL_BIN)
    assert len(log.track) == 828
    assert log.vehicle.firmware_version == "4.7.0-dev"
    assert [mode for _, mode in log.modes] == ["GUIDED", "AUTO"]
    assert [armed for _, armed in log.armed] == [True]
    assert [number for _, number in log.reached] == [3, 4]
    assert log.mission is not None
    assert [item.command for item in log.mission.items] == [178, 22, 16, 16, 20]
    assert log.truth is not None
    believed = np.interp(log.truth.t_utc_s, log.track.t_utc_s, log.track.alt_rel_home_m)
    assert np.abs(log.truth.alt_rel_home_m - believed).max() < 0.2


def test_a_real_flight_of_px4(shared_data: Path) -> None:
    log = read_flight_log(shared_data / "logs" / "pyulog" / "sample_px4_events.ulg")
    assert len(log.track) == 109
    assert [mode for _, mode in log.modes] == ["HOLD", "TAKEOFF", "HOLD", "RTL", "HOLD"]
    assert [armed for _, armed in log.armed] == [False, True, False]
    assert 1.5 < log.track.alt_rel_home_m.max() < 3.0


@pytest.mark.parametrize(("data", "name"), [(dataflash(), "a.bin"), (ulog(), "a.ulg")])
def test_it_is_listed_and_replayed(tmp_path: Path, data: bytes, name: str) -> None:
    path = written(tmp_path, data, name)
    info, log = describe_recording(path), read_flight_log(path)
    assert (info.kind, info.fault) == (log.kind, None)
    assert info.start_utc_s == pytest.approx(log.start_utc_s, abs=0.3)
    assert info.duration_s == pytest.approx(log.end_utc_s - log.start_utc_s, abs=0.3)
    assert info.vehicle == ("ArduPilot 4.5.7" if name == "a.bin" else "PX4 1.14.2")
    source = open_source(path)
    entries = list(source.entries(-math.inf))
    assert sum(entry.topic == Topic.TEXT for entry in entries) == len(log.texts)
    assert sum(entry.topic == Topic.VEHICLE for entry in entries) >= len(log.track)
    assert [entry.t_utc_s for entry in entries] == sorted(entry.t_utc_s for entry in entries)


@pytest.mark.parametrize(("data", "positions"), [(dataflash(), 200), (ulog(), 50)])
def test_a_log_that_is_cut_off_is_opened_as_far_as_it_goes(tmp_path: Path, data: bytes, positions: int) -> None:
    cut = data[: len(data) * 3 // 4]
    log = read_flight_log(written(tmp_path, cut[:-5]))
    assert positions // 2 < len(log.track) < positions
    assert "The file ends in the middle of a message." in log.faults


@pytest.mark.parametrize(("data", "positions"), [(dataflash(), 200), (ulog(), 50)])
def test_a_bad_stretch_costs_little_more_than_itself(tmp_path: Path, data: bytes, positions: int) -> None:
    damaged = bytearray(data)
    middle = len(damaged) // 2
    damaged[middle : middle + 90] = random.Random(3).randbytes(90)
    log = read_flight_log(written(tmp_path, bytes(damaged)))
    assert positions - 8 < len(log.track) < positions
    assert any("1 damaged stretch was skipped" in fault for fault in log.faults)


def test_a_time_that_cannot_be_does_not_stretch_the_log(tmp_path: Path) -> None:
    log = DataFlashWriter()
    log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    for step in range(50):
        t_us = 2**62 if step == 20 else 5 if step == 30 else 100_000_000 + 100_000 * step
        log.write("POS", t_us, 480_000_000, 110_000_000, 510.0, 10.0, 10.0)
    flight = read_flight_log(written(tmp_path, bytes(log.data)))
    assert flight.end_utc_s - flight.start_utc_s == pytest.approx(4.9)
    assert 46 <= len(flight.track) <= 48
    assert "The log holds no time of day: its times count from the vehicle's start." in flight.faults


@pytest.mark.parametrize("length", [0, 1, 2, 3, 255])
def test_sizes_that_cannot_be_hold_nothing_up(tmp_path: Path, length: int) -> None:
    log = DataFlashWriter()
    log.describe("BAD", "QB", "TimeUS,Value", length=length)
    log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    for step in range(3000):
        log.write("POS", 100_000 * step, 480_000_000, 110_000_000, 510.0, 10.0, 10.0)
        if step == 1500:
            log.write("BAD", 1, 2)
    assert len(read_flight_log(written(tmp_path, bytes(log.data))).track) > 2900


@pytest.mark.parametrize(
    "fields",
    [
        "uint64_t timestamp;float[2000000000] x;",
        "uint64_t timestamp;vehicle_status[60000] x;",
        "uint64_t timestamp;float[-5] x;",
        "uint64_t timestamp;float[0] x;",
        "uint64_t timestamp;nonsense x;",
        "uint64_t timestamp;float x;float x;",
        "float[",
        "",
    ],
)
def test_descriptions_that_cannot_be_are_not_believed(tmp_path: Path, fields: str) -> None:
    data = ulog_head() + ulog_record("F", f"vehicle_status:{fields}".encode())
    data += ulog_record("A", b"\0\x05\0vehicle_status") + ulog_record("D", b"\x05\0" + bytes(60))
    with pytest.raises(RecordingError, match="nothing that could be shown"):
        read_flight_log(written(tmp_path, data, "a.ulg"))


@pytest.mark.parametrize("kind", ["ARM", "ATT", "CMD", "DSF", "ERR", "EV", "GPA", "GPS", "MISE", "MODE", "ORGN", "SIM"])
def test_records_without_the_columns_that_are_looked_for_are_read_all_the_same(tmp_path: Path, kind: str) -> None:
    log = DataFlashWriter()
    log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    log.describe(kind, "Q", "TimeUS")
    for step in range(3):
        log.write("POS", 100_000 * step, 480_000_000, 110_000_000, 510.0, 10.0, 10.0)
        log.write(kind, 100_000 * step)
    path = written(tmp_path, bytes(log.data))
    assert describe_recording(path).fault is None
    assert len(read_flight_log(path).track) == 3


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        *(("ATT", ["Roll"]), ("BAT", ["Inst", "RemPct"]), ("DSF", ["Dp"]), ("ERR", ["Subsys", "ECode"])),
        *(("EV", ["Id"]), ("GPA", ["I"]), ("GPS", ["Status", "NSats", "GWk"]), ("MISE", ["CNum", "CTot"])),
        *(("MODE", ["ModeNum"]), ("ORGN", ["Type", "Lat"]), ("SIM", ["Lat", "Lng"]), ("XKF1", ["C", "VN"])),
    ],
)
@pytest.mark.parametrize("number", [math.nan, math.inf, -1.0])
def test_numbers_that_count_nothing_and_arrays_are_not_believed(
    tmp_path: Path, kind: str, names: list[str], number: float
) -> None:
    """A record's description comes from the log: it may call anything an array, or a number that is none."""
    for letters in ("f", "a"):
        log = DataFlashWriter()
        log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
        log.describe(kind, "Q" + letters * len(names), "TimeUS," + ",".join(names))
        for step in range(3):
            log.write("POS", 100_000 * step, 480_000_000, 110_000_000, 510.0, 10.0, 10.0)
            log.write(kind, 100_000 * step, *([number] * len(names) if letters == "f" else [bytes(64)] * len(names)))
        path = written(tmp_path, bytes(log.data))
        assert describe_recording(path).kind == "dataflash"
        assert len(read_flight_log(path).track) == 3


def test_one_name_for_two_kinds_mixes_neither(tmp_path: Path) -> None:
    log = DataFlashWriter()
    log.describe("POS", "QLLfff", "TimeUS,Lat,Lng,Alt,RelHomeAlt,RelOriginAlt")
    log.write("POS", 100_000, 480_000_000, 110_000_000, 510.0, 10.0, 10.0)
    log.describe("POS", "H", "Lat")
    log.write("POS", 7)
    path = written(tmp_path, bytes(log.data))
    assert describe_recording(path).kind == "dataflash"
    assert len(read_flight_log(path).track) == 1


@pytest.mark.parametrize(
    ("topic", "fields"),
    [
        ("vehicle_global_position", "uint64_t timestamp;pair lat;double lon;"),
        ("vehicle_global_position", "uint64_t[2] timestamp;double lat;double lon;"),
        ("vehicle_global_position", "uint64_t timestamp;double[2] lat;double lon;"),
        ("vehicle_status", "uint64_t timestamp;uint8_t[2] nav_state;pair arming_state;uint8_t[3] failsafe;"),
        ("vehicle_status", "uint64_t timestamp;uint8_t[2] system_id;"),
        ("vehicle_attitude", "uint64_t timestamp;pair[4] q;"),
        ("battery_status", "uint64_t timestamp;float[3] remaining;"),
        ("sensor_gps", "uint64_t timestamp;uint8_t[2] fix_type;double satellites_used;"),
        ("home_position", "uint64_t timestamp;double[2] lat;double lon;"),
        ("mission_result", "uint64_t timestamp;double seq_current;uint32_t[2] seq_total;"),
        ("vehicle_land_detected", "uint64_t timestamp;uint8_t[2] landed;"),
        ("vehicle_local_position", "uint64_t timestamp;float[2] vx;float vy;"),
        ("vehicle_status", "uint64_t timestamp;step0 nav_state;"),
    ],
)
@pytest.mark.parametrize("content", [bytes(60), b"\xff" * 60, bytes.fromhex("000000000000f07f") * 8])
def test_topics_that_are_packed_as_nobody_packs_them_are_not_believed(
    tmp_path: Path, topic: str, fields: str, content: bytes
) -> None:
    """Structures, arrays and thousands of structures in one another, where a number is looked for."""
    words = ["pair:float a;uint8_t b;", *(f"step{k}:step{k + 1} x;" for k in range(1500)), "step1500:uint8_t x;"]
    described = b"".join(ulog_record("F", text.encode()) for text in [*words, f"{topic}:{fields}"])
    records = [ulog_record("D", b"\x09\0" + bytes((step, *bytes(7))) + content) for step in range(3)]
    start = len(ulog_head())
    data = ulog()[:start] + described + ulog_record("A", b"\0\x09\0" + topic.encode()) + b"".join(records)
    path = written(tmp_path, data, "a.ulg")
    assert describe_recording(path).kind == "ulog"
    with contextlib.suppress(RecordingError):
        read_flight_log(path)


@pytest.mark.parametrize("kind", "FADLCIMPQSORB")
@pytest.mark.parametrize("length", range(5))
def test_records_that_are_too_short_are_no_records(tmp_path: Path, kind: str, length: int) -> None:
    start, whole = len(ulog_head()), ulog()
    for fill in (b"\0", b"\xff"):
        path = written(tmp_path, whole[:start] + ulog_record(kind, fill * length) + whole[start:], "a.ulg")
        assert describe_recording(path).kind == "ulog"
        assert len(read_flight_log(path).track) == 50


def test_one_time_that_cannot_be_does_not_stretch_what_the_list_says(tmp_path: Path) -> None:
    data = bytearray(ulog())
    at = data.rindex(ulog_record("D", b"\x04\0")[3:] + (59_800_000).to_bytes(8, "little")) + 2
    data[at + 6] = 0x40
    info = describe_recording(written(tmp_path, bytes(data), "a.ulg"))
    assert info.duration_s == pytest.approx(9.8, abs=0.3)


@given(st.integers(0, 10**9), st.sampled_from([dataflash(2), ulog(4)]))
@settings(max_examples=150)
def test_no_damage_brings_the_reader_down(tmp_path_factory: pytest.TempPathFactory, seed: int, data: bytes) -> None:
    """Cut, overwritten and doubled: a flight or a clear error, with finite times in order."""
    draw, damaged = random.Random(seed), bytearray(data)
    for _ in range(draw.randrange(1, 12)):
        at = draw.randrange(8, len(damaged))
        match draw.randrange(4):
            case 0:
                damaged[at : at + 8] = draw.randbytes(8)
            case 1:
                del damaged[at : at + draw.randrange(200)]
            case 2:
                damaged[at:at] = damaged[: draw.randrange(300)]
            case _:
                damaged[at % len(damaged)] ^= 1 << draw.randrange(8)
    path = tmp_path_factory.getbasetemp() / "damaged.bin"
    path.write_bytes(damaged)
    describe_recording(path)
    log = None
    with contextlib.suppress(RecordingError):
        log = read_flight_log(path)
    if log is None:
        return
    assert np.all(np.diff(log.track.t_utc_s) >= 0)
    assert np.all(np.abs(log.track.lat_deg) <= 90)
    assert math.isfinite(log.end_utc_s - log.start_utc_s)


def test_a_very_long_log_is_thinned_and_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "_MOST_STATES", 60)
    log = read_flight_log(written(tmp_path, dataflash()))
    assert len(log.track) in (50, 51)
    assert "The log is very long: one of every 4 positions is shown." in log.faults
    monkeypatch.setattr(columns, "_MOST_STATES", 250)
    log = read_flight_log(written(tmp_path, dataflash()))
    assert (len(log.track), log.faults) == (200, ())
