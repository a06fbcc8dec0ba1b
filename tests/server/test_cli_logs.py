"""``hedgehop logs`` as a crew uses it, against a simulated vehicle in a process of its own that has flown."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymavlink import mavutil

from telemetry.recording.flight_log import read_flight_log
from tests.server.cli_runs import hedgehop
from tests.server.simulated import simulated_vehicle

pytestmark = pytest.mark.xdist_group("cli-flying")
HOME = "-37.1244507,175.6892878,803"
ARM = 400
"""MAV_CMD_COMPONENT_ARM_DISARM"""


@pytest.fixture(scope="module")
def link() -> Iterator[str]:
    with simulated_vehicle(HOME, "--boot-s", 1, "--speedup", 10) as link:
        yield link


def _ordered(line: mavutil.mavfile, command: int, *params: float, until: str, armed: bool) -> None:
    while line.recv_match() is not None:
        pass  # heartbeats from before
    deadline_s = time.monotonic() + 60
    while time.monotonic() < deadline_s:
        line.mav.command_long_send(1, 1, command, 0, *params, *[0.0] * (7 - len(params)))
        heard = line.recv_match(type="HEARTBEAT", blocking=True, timeout=1)
        if heard is not None and bool(heard.base_mode & 128) == armed:
            return
    pytest.fail(f"The vehicle was not {until}.")


def _armed(line: mavutil.mavfile) -> None:
    line.mav.heartbeat_send(6, 8, 0, 0, 0)
    _ordered(line, ARM, 1, 21196, until="armed", armed=True)


def _disarmed(line: mavutil.mavfile) -> None:
    _ordered(line, ARM, 0, 21196, until="disarmed", armed=False)


def test_a_vehicle_that_never_flew_has_none_and_then_they_are_listed_read_and_reviewed(
    link: str, tmp_path: Path
) -> None:
    none = hedgehop("logs", "list", "--link", link)
    assert (none.code, none.out.strip()) == (0, "There is no log on the vehicle."), none.err
    line = mavutil.mavlink_connection(link, source_system=254)
    for _ in range(2):
        _armed(line)
        refused = hedgehop("logs", "list", "--link", link)
        assert refused.code != 0
        assert "The vehicle is armed." in refused.err
        _disarmed(line)
    line.close()
    listed = hedgehop("logs", "list", "--link", link, "--json")
    assert listed.code == 0, listed.err
    assert [log["number"] for log in listed.json["logs"]] == [2, 1]
    newest = listed.json["logs"][0]
    got = hedgehop("logs", "get", "newest", "--link", link, "--out", tmp_path / "logs", "--json")
    assert got.code == 0, got.err
    file = Path(got.json["file"])
    assert file.stat().st_size == newest["bytes"] == got.json["read_bytes"]
    assert [path.name for path in (tmp_path / "logs").iterdir()] == [file.name] == ["log-1-2.bin"]
    flight = read_flight_log(file)
    assert [armed for _, armed in flight.armed] == [True, False]
    assert flight.faults == ()
    assert len(flight.track) > 5
    assert flight.start_utc_s == pytest.approx(flight.track.t_utc_s[0], abs=1.0)
    again = hedgehop("logs", "get", "2", "--link", link, "--out", tmp_path / "logs")
    assert again.code != 0
    assert "There is such a file already." in again.err


def test_wrong_input_is_said_before_anything_is_connected(tmp_path: Path) -> None:
    link = ("--link", "udpin:127.0.0.1:14999")
    (tmp_path / "file").touch()
    for arguments, words in (
        (("logs", "get", "x", *link), "no number of a log"),
        (("logs", "get", "1", "--link", "nonsense"), "nonsense"),
        (("logs", "get", "1", *link, "--out", tmp_path / "file"), "not a directory"),
    ):
        run = hedgehop(*arguments)
        assert run.code != 0
        assert words in run.err


def test_a_number_that_the_vehicle_does_not_have(link: str, tmp_path: Path) -> None:
    run = hedgehop("logs", "get", "99", "--link", link, "--out", tmp_path)
    assert run.code != 0
    assert "There is no log 99 on the vehicle." in run.err


def test_a_px4_writes_ulogs_that_are_listed_read_as_files_and_reviewed(tmp_path: Path) -> None:
    with simulated_vehicle(HOME, "--autopilot", "px4", "--boot-s", 1, "--speedup", 10) as link:
        line = mavutil.mavlink_connection(link, source_system=254)
        for _ in range(2):
            _armed(line)
            _disarmed(line)
        line.close()
        listed = hedgehop("logs", "list", "--link", link, "--json")
        assert listed.code == 0, listed.err
        assert [log["number"] for log in listed.json["logs"]] == [1, 0]
        got = hedgehop("logs", "get", "newest", "--link", link, "--out", tmp_path, "--json")
        assert got.code == 0, got.err
    file = Path(got.json["file"])
    assert file.name == "log-1-1.ulg"
    assert file.stat().st_size == listed.json["logs"][0]["bytes"]
    flight = read_flight_log(file)
    assert (flight.kind, flight.faults) == ("ulog", ())
    assert [armed for _, armed in flight.armed] == [True, False]
    assert flight.vehicle.firmware_version == "1.17.0"
    assert "block by block" not in got.err + got.out
