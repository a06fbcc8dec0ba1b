"""One line per recording."""

from __future__ import annotations

import errno
import mmap
import os
from pathlib import Path
from typing import NoReturn

import pytest

from telemetry.errors import RecordingUnreadableError
from telemetry.recording.describe import describe_recording
from telemetry.recording.flight_log import read_flight_log
from tests.telemetry.recordings import T0_UTC_S, write_flight


@pytest.mark.parametrize("finish", [True, False])
def test_hedgehops_own(tmp_path: Path, finish: bool) -> None:
    path = write_flight(tmp_path / "a.mcap", finish=finish)
    info = describe_recording(path)
    assert (info.name, info.kind, info.size_bytes) == ("a.mcap", "hedgehop", path.stat().st_size)
    assert info.start_utc_s == T0_UTC_S
    assert info.duration_s == pytest.approx(20.0)
    assert info.vehicle == "ArduPilot 4.6.0, system 1"
    assert (info.plan_name, info.terrain_id, info.terrain_sha256) == ("Alpine meadow", "t1", "a" * 64)
    assert (info.fault is None) == finish


def test_logs_of_other_ground_stations(shared_data: Path) -> None:
    auto = describe_recording(shared_data / "logs" / "arducopter" / "auto.tlog")
    assert (auto.kind, auto.vehicle, auto.fault) == ("tlog", "ArduPilot, system 1", None)
    assert auto.duration_s == pytest.approx(394, abs=0.5)
    damaged = describe_recording(shared_data / "logs" / "dronekit" / "flight.tlog")
    assert damaged.duration_s == pytest.approx(1377, abs=1)
    assert damaged.fault is not None


def test_what_is_no_recording_has_a_fault(tmp_path: Path) -> None:
    (tmp_path / "text.mcap").write_text("hello")
    (tmp_path / "empty.tlog").touch()
    (tmp_path / "cut.mcap").write_bytes(b"\x89MCAP0\r\n\x01")
    for name, words in (("text.mcap", "text"), ("empty.tlog", "empty"), ("cut.mcap", "cut off"), ("none", "cannot")):
        info = describe_recording(tmp_path / name)
        assert info.kind == "unreadable"
        assert words in (info.fault or "")


def test_a_hundred_are_listed_without_being_read(tmp_path: Path) -> None:
    """Described by a few thousand bytes at their ends, not by all of them: damage in the middle goes unnoticed."""
    path = write_flight(tmp_path / "a.mcap")
    data = bytearray(path.read_bytes())
    data[len(data) // 4 : len(data) // 2] = bytes(len(data) // 2 - len(data) // 4)
    path.write_bytes(data)
    assert describe_recording(path).fault is None


def test_what_its_disk_does_not_give_is_not_called_no_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "flight.mcap"
    write_flight(path)

    def fails(*_args: object, **_named: object) -> NoReturn:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as patched:
        patched.setattr(mmap, "mmap", fails)
        with pytest.raises(RecordingUnreadableError, match="cannot be read: Input/output error"):
            read_flight_log(path)
        assert describe_recording(path).fault == "The file cannot be read: Input/output error."
    assert describe_recording(path).fault is None
