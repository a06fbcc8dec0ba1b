"""A recorder that is started again: which file it goes on with, until when, and what it does where that cannot be."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.mcap_files.continuing import WITHIN_S, Unfinished, find_unfinished
from telemetry.recording.mcap_files.mend import mend
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.recorder import Recorder
from telemetry.recording.trigger import AFTER_DISARM_S
from telemetry.topics.messages import RawFrame, Topic
from tests.telemetry.recordings import PLAN, T0_MONO_S, T0_UTC_S, heartbeat, state_at


class Station:
    """One recorder after the other, on one clock."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.t_s = folder, 0.0
        self.recorder = self._recorder(None)

    def _recorder(self, unfinished: Unfinished | None) -> Recorder:
        return Recorder(
            self.folder,
            unfinished=unfinished,
            now=lambda: T0_MONO_S + self.t_s,
            utc=lambda: T0_UTC_S + self.t_s,
        )

    def found(self, *, utc_later_s: float = 0.0) -> Unfinished | None:
        return find_unfinished(self.folder, t_utc_s=T0_UTC_S + self.t_s + utc_later_s, t_mono_s=T0_MONO_S + self.t_s)

    def fly(self, seconds: float, *, armed: bool = True) -> None:
        for _ in range(round(seconds * 10)):
            self.t_s = round(self.t_s + 0.1, 6)
            self.recorder.on_message(Topic.RAW, RawFrame(T0_UTC_S + self.t_s, False, "udp", heartbeat(0)))
            self.recorder.on_message(Topic.VEHICLE, state_at(self.t_s, armed=armed))
            self.recorder.work()
            self.recorder.on_tick()
        for path in self.folder.iterdir():
            os.utime(path, (T0_UTC_S + self.t_s, T0_UTC_S + self.t_s))

    def kill(self, away_s: float) -> None:
        """Its file is closed by the system, without an index, and unlocked."""
        writer = self.recorder._writer
        assert writer is not None
        writer.abandon()
        self.t_s += away_s

    def start_again(self) -> None:
        self.recorder = self._recorder(self.found())


@pytest.fixture
def station(tmp_path: Path) -> Station:
    return Station(tmp_path)


def only(folder: Path) -> Path:
    (path,) = folder.iterdir()
    return path


def test_killed_twice_a_flight_is_one_whole_file_with_two_gaps(station: Station, tmp_path: Path) -> None:
    station.recorder.on_message(Topic.PLAN, PLAN)
    station.fly(20.0)
    name = only(tmp_path).name
    for away_s in (1.4, 20.0):
        station.kill(away_s)
        station.start_again()
        assert station.recorder.status().name == name
        station.fly(10.0)
    station.fly(AFTER_DISARM_S + 1.0, armed=False)
    assert not station.recorder.recording
    log = read_flight_log(only(tmp_path))
    assert (log.plan, log.armed[-1][1]) == (PLAN, False)
    assert [fault.partition(" from")[0] for fault in log.faults] == [
        "Nothing was recorded for 1.5 s",
        "Nothing was recorded for 20.1 s",
    ]
    assert log.end_utc_s - log.start_utc_s == pytest.approx(20.0 + 1.4 + 10.0 + 20.0 + 10.0 + AFTER_DISARM_S, abs=0.3)
    with open_recording(only(tmp_path)) as recording:
        assert recording.finished
        times = [entry.t_utc_s for entry in recording.entries((Topic.RAW,))]
        assert times == sorted(times)
        assert len(times) == pytest.approx(470, abs=3)


def gaps(folder: Path) -> list[str]:
    return [fault.partition(" from")[0] for fault in read_flight_log(only(folder)).faults if "Nothing was" in fault]


def test_a_gap_is_told_as_soon_as_anything_is_counted_as_written(station: Station, tmp_path: Path) -> None:
    """Whoever reads a file in flight has to wait for that: a recorder that only just began has told nothing yet."""
    station.fly(5.0)
    station.kill(2.0)
    station.start_again()
    assert station.recorder.status().recording
    assert (station.recorder.status().messages, gaps(tmp_path)) == (0, [])
    station.fly(0.1)
    assert station.recorder.status().messages > 0
    assert gaps(tmp_path) == ["Nothing was recorded for 2.1 s"]


def test_one_that_dies_again_before_it_has_written_anything_leaves_one_gap_over_both(
    station: Station, tmp_path: Path
) -> None:
    station.fly(5.0)
    station.kill(2.0)
    station.start_again()
    station.recorder.work()
    station.fly(0.0)
    assert gaps(tmp_path) == ["Nothing was recorded for 2.0 s"]
    station.kill(3.0)
    station.start_again()
    station.fly(1.0)
    assert gaps(tmp_path) == ["Nothing was recorded for 5.1 s"]


def test_it_ends_when_the_vehicle_was_disarmed_meanwhile(station: Station, tmp_path: Path) -> None:
    station.fly(5.0)
    station.kill(3.0)
    station.start_again()
    station.fly(AFTER_DISARM_S - 1.0, armed=False)
    assert station.recorder.recording
    station.fly(2.0, armed=False)
    assert not station.recorder.recording
    assert read_flight_log(only(tmp_path)).armed[-1][1] is False


def test_one_by_hand_goes_on_until_it_is_stopped(station: Station, tmp_path: Path) -> None:
    station.recorder.start("bench")
    station.fly(5.0, armed=False)
    station.kill(1.0)
    station.start_again()
    station.fly(3 * AFTER_DISARM_S, armed=False)
    assert station.recorder.recording
    station.recorder.stop()
    station.recorder.work()
    assert "bench" in only(tmp_path).name
    assert len(read_flight_log(only(tmp_path)).faults) == 1


def test_a_torn_end_is_cut_off(station: Station, tmp_path: Path) -> None:
    station.fly(5.0)
    station.kill(1.0)
    path = only(tmp_path)
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - 7)
    os.utime(path, (T0_UTC_S + station.t_s, T0_UTC_S + station.t_s))
    station.start_again()
    station.fly(5.0)
    station.recorder.stop()
    station.recorder.work()
    with open_recording(path) as recording:
        assert recording.finished
        assert not [fault for fault in recording.faults if "damaged" in fault]
        assert recording.end_utc_s == pytest.approx(T0_UTC_S + 11.0, abs=0.2)


def test_what_is_damaged_is_left_and_another_file_has_the_seconds_before(station: Station, tmp_path: Path) -> None:
    station.fly(5.0)
    station.kill(1.0)
    path = only(tmp_path)
    found = station.found()
    with path.open("r+b") as file:
        file.truncate(400)
    station.recorder = station._recorder(found)
    station.fly(10.0)
    names = sorted(each.name for each in tmp_path.iterdir())
    assert len(names) == 2
    assert station.recorder.status().name == names[1]
    station.recorder.stop()
    station.recorder.work()
    log = read_flight_log(tmp_path / names[1])
    assert log.start_utc_s == pytest.approx(T0_UTC_S + 6.1, abs=0.3)
    assert path.stat().st_size == 400


def test_on_a_full_disk_it_says_so_and_leaves_the_file_as_it_was(station: Station, tmp_path: Path) -> None:
    station.fly(5.0)
    station.kill(1.0)

    def full(fd: int, data: memoryview) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    recorder = Recorder(tmp_path, unfinished=station.found(), now=lambda: T0_MONO_S + station.t_s, write=full)
    assert recorder.work() is not None
    recorder.on_tick()
    status = recorder.status()
    assert (status.recording, status.error is None) == (False, False)
    assert mend(only(tmp_path))
    assert read_flight_log(only(tmp_path)).faults == ()


def test_what_is_not_gone_on_with(station: Station, tmp_path: Path) -> None:
    assert station.found() is None  # nothing there
    station.fly(5.0)
    station.kill(1.0)
    assert station.found() is not None
    # The computer was started again, or its clock was set.
    assert station.found(utc_later_s=5.0) is None
    station.t_s += WITHIN_S
    assert station.found() is None  # too long ago
    station.t_s -= WITHIN_S
    assert mend(only(tmp_path))
    os.utime(only(tmp_path), (T0_UTC_S + station.t_s, T0_UTC_S + station.t_s))
    assert station.found() is None  # finished
    only(tmp_path).write_text("hello")
    os.utime(only(tmp_path), (T0_UTC_S + station.t_s, T0_UTC_S + station.t_s))
    assert station.found() is None  # foreign
