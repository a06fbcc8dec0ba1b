"""The simulated PX4's own logs: ULogs that PX4's own reader takes, told and handed out as PX4 does it."""

from __future__ import annotations

import math
import re
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire
from pyulog import ULog

from telemetry.mavlink.logs.ftp.payload import FtpPayload, Nak, Opcode, read_payload
from telemetry.recording.flight_log import read_flight_log
from telemetry.simulation.simulator.autopilot.personality import PERSONALITIES
from telemetry.simulation.simulator.own_logs.ulog_records import TOPICS
from tests.telemetry.simulator_bench import Bench

ARM, SET_MODE, TAKEOFF = 400, 176, 22
UP_M = 8.0
QUICK = {"COM_SPOOLUP_TIME": 0.2, "MPC_TKO_RAMP_T": 0.5, "MPC_LAND_SPEED": 1.5, "MPC_LAND_CRWL": 1.0}
FOLDER = "/fs/microsd/log"


def bench_of(**parameters: float) -> Bench:
    bench = Bench(make="px4", parameters=PERSONALITIES["px4"].parameters(**{**QUICK, **parameters}))
    bench.until(lambda: bench.vehicle.autopilot.position_ok)
    bench.advance(1.2)
    return bench


def fly(bench: Bench) -> None:
    """Up, and down again."""
    nan, frame = math.nan, bench.vehicle.frame
    assert bench.command(ARM, 1) == 0
    assert bench.command(TAKEOFF, nan, 0, 0, nan, nan, nan, frame.alt_amsl_m + UP_M) == 0
    bench.until(lambda: bench.vehicle.autopilot.mode.name == "HOLD")
    bench.advance(3.0)
    assert bench.command(SET_MODE, 1, 4, 6) == 0
    bench.until(lambda: not bench.vehicle.autopilot.armed)
    bench.advance(0.1)


@pytest.fixture(scope="module")
def flown() -> Bench:
    bench = bench_of()
    fly(bench)
    return bench


SEQ = count(1)


def ask(bench: Bench, opcode: Opcode, *, offset: int = 0, size: int = 0, data: bytes = b"") -> FtpPayload:
    (answer,) = bench.send(FtpPayload(next(SEQ), opcode, 0, offset, size or len(data), data).message((1, 1)))
    heard = read_payload(answer)
    assert heard is not None
    return heard


def names_in(bench: Bench, folder: str) -> list[bytes]:
    listed = ask(bench, Opcode.LIST_DIRECTORY, data=folder.encode())
    return [] if listed.is_refusal(Nak.END_OF_FILE) else [name for name in listed.data.split(b"\0") if name]


def the_file(bench: Bench) -> str:
    (day,) = names_in(bench, FOLDER)
    (name,) = names_in(bench, f"{FOLDER}/{day[1:].decode()}")
    assert re.fullmatch(rb"D\d{4}-\d\d-\d\d", day)
    assert re.fullmatch(rb"F\d\d_\d\d_\d\d\.ulg\t\d+", name)
    return f"{FOLDER}/{day[1:].decode()}/{name[1:13].decode()}"


def read_as_file(bench: Bench, path: str) -> bytes:
    opened = ask(bench, Opcode.OPEN_TO_READ, data=path.encode())
    size, content = int.from_bytes(opened.data[:4], "little"), b""
    while len(content) < size:
        content += ask(bench, Opcode.READ_FILE, offset=len(content), size=239).data
    assert ask(bench, Opcode.TERMINATE_SESSION).opcode == Opcode.ACK
    return content


def read_as_blocks(bench: Bench, number: int, size: int) -> bytes:
    before = len(bench.heard)
    bench.send(wire.MAVLink_log_request_data_message(1, 1, number, 0, size))
    bench.advance(size / 90 / 20 * 0.1)
    blocks: list[Any] = [one.message for one in bench.heard[before:] if one.message.get_type() == "LOG_DATA"]
    return b"".join(bytes(block.data[: block.count]) for block in blocks)


def test_it_is_the_same_by_blocks_and_as_a_file_and_is_numbered_from_0(flown: Bench) -> None:
    flown.send(wire.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    flown.advance(0.1)
    entry = flown.last("LOG_ENTRY")
    assert (entry.id, entry.num_logs, entry.last_log_num) == (0, 1, 0)
    content = read_as_file(flown, the_file(flown))
    assert entry.size == len(content) > 20_000
    assert read_as_blocks(flown, 0, entry.size) == content


def test_folders_above_are_listed_and_only_one_file_may_be_open(flown: Bench) -> None:
    assert names_in(flown, "/fs") == [b"Dmicrosd"]
    assert ask(flown, Opcode.LIST_DIRECTORY, data=b"/APM/LOGS").is_refusal(Nak.FILE_NOT_FOUND)
    path = the_file(flown).encode()
    assert ask(flown, Opcode.OPEN_TO_READ, data=path).opcode == Opcode.ACK
    assert ask(flown, Opcode.OPEN_TO_READ, data=path).is_refusal(Nak.NO_SESSIONS_AVAILABLE)
    assert ask(flown, Opcode.RESET_SESSIONS).opcode == Opcode.ACK
    assert ask(flown, Opcode.OPEN_TO_READ, data=path).opcode == Opcode.ACK
    assert ask(flown, Opcode.RESET_SESSIONS).opcode == Opcode.ACK


def test_px4s_own_reader_finds_every_topic_and_the_flight_in_it(flown: Bench, tmp_path: Path) -> None:
    path = tmp_path / "flown.ulg"
    path.write_bytes(read_as_file(flown, the_file(flown)))
    log = ULog(str(path))
    assert not log.file_corruption
    topics = {topic.name: topic.data for topic in log.data_list}
    assert set(topics) == set(TOPICS)
    assert log.msg_info_dict["sys_name"] == "PX4"
    assert log.initial_parameters["MPC_XY_CRUISE"] == 5.0
    assert log.initial_parameters["COM_RC_IN_MODE"] == 1
    local, place = topics["vehicle_local_position"], topics["vehicle_global_position"]
    assert np.diff(local["timestamp"] / 1e6) == pytest.approx(0.1, abs=0.021)
    assert -local["z"].min() == pytest.approx(UP_M, abs=0.8)
    assert place["alt"] == pytest.approx(local["ref_alt"] - local["z"], abs=1e-3)
    assert [int(state) for state in dict.fromkeys(topics["vehicle_status"]["nav_state"])] == [17, 4, 18]
    assert topics["vehicle_status"]["arming_state"][-1] == 1
    assert set(topics["vehicle_land_detected"]["landed"]) == {0, 1}
    square = sum(topics["vehicle_attitude"][f"q[{k}]"] ** 2 for k in range(4))
    assert square == pytest.approx(1.0, abs=1e-5)
    assert topics["battery_status"]["remaining"][-1] < topics["battery_status"]["remaining"][0]
    assert "Takeoff detected" in [entry.message for entry in log.logged_messages]


def test_it_is_a_flight_to_review(flown: Bench, tmp_path: Path) -> None:
    path = tmp_path / "flown.ulg"
    path.write_bytes(read_as_file(flown, the_file(flown)))
    log = read_flight_log(path)
    assert (log.kind, log.faults) == ("ulog", ())
    assert (log.vehicle.autopilot, log.vehicle.firmware_version) == ("px4", "1.17.0")
    assert [mode for _, mode in log.modes] == ["TAKEOFF", "HOLD", "LAND", "HOLD"]
    assert [armed for _, armed in log.armed] == [True, False]
    assert np.nanmax(log.track.alt_rel_home_m) == pytest.approx(UP_M, abs=0.8)
    assert log.truth is not None
    assert len(log.truth.t_utc_s) == len(log.track)


def test_nothing_is_handed_out_while_it_is_armed_and_nothing_is_written_that_is_not_wanted() -> None:
    bench = bench_of(SDLOG_MODE=-1)
    fly(bench)
    assert names_in(bench, FOLDER) == []
    bench = bench_of(COM_DISARM_PRFLT=0)
    assert bench.command(ARM, 1) == 0
    bench.advance(1.0)
    bench.send(wire.MAVLink_log_request_list_message(1, 1, 0, 0xFFFF))
    bench.advance(0.5)
    assert not [one for one in bench.heard if one.message.get_type() == "LOG_ENTRY"]


def test_two_that_begin_in_one_second_have_files_of_their_own() -> None:
    bench = bench_of()
    for _ in range(3):
        assert bench.command(ARM, 1) == 0
        bench.advance(0.1)
        assert bench.command(ARM, 0) == 0
        bench.advance(0.1)
    (day, *others) = names_in(bench, FOLDER)
    listed = sum(len(names_in(bench, f"{FOLDER}/{each[1:].decode()}")) for each in (day, *others))
    assert listed == 3
