"""The recorder: what it writes when, and how it gets over a full disk."""

from __future__ import annotations

import errno
import os
from dataclasses import replace
from pathlib import Path

import pytest

from telemetry.errors import RecordingFullError
from telemetry.recording.disk_space import Space
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.recorded_topics import RECORDED
from telemetry.recording.recorder import Recorder, free_path
from telemetry.recording.trigger import AFTER_DISARM_S
from telemetry.topics.messages import RawFrame, RecorderStatus, ReplayStatus, ServerAlive, Topic
from tests.telemetry.recordings import PLAN, T0_MONO_S, T0_UTC_S, heartbeat, state_at

MB = 1_000_000


class Station:
    """A recorder with a clock and a disk of its own."""

    def __init__(self, folder: Path) -> None:
        self.t_s, self.free, self.broken = 0.0, 50_000 * MB, False
        self.recorder = Recorder(
            folder,
            now=lambda: T0_MONO_S + self.t_s,
            utc=lambda: T0_UTC_S + self.t_s,
            measure=lambda _: Space(self.free, 100_000 * MB),
            write=self._write,
        )

    def _write(self, fd: int, data: memoryview) -> int:
        if self.broken:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return os.write(fd, data)

    def fly(self, seconds: float, *, armed: bool, rate_hz: int = 10) -> RecorderStatus:
        for _ in range(round(seconds * rate_hz)):
            self.t_s = round(self.t_s + 1 / rate_hz, 6)
            frame = RawFrame(T0_UTC_S + self.t_s, False, "udp", heartbeat(0))
            self.recorder.on_message(Topic.RAW, frame)
            self.recorder.on_message(Topic.VEHICLE, state_at(self.t_s, armed=armed))
            self.recorder.work()
            self.recorder.on_tick()
        return self.recorder.status()


@pytest.fixture
def station(tmp_path: Path) -> Station:
    return Station(tmp_path)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob("*"))


def test_a_flight_is_recorded_by_itself_with_the_seconds_before(station: Station, tmp_path: Path) -> None:
    station.recorder.on_message(Topic.PLAN, PLAN)
    assert not station.fly(60.0, armed=False).recording
    assert names(tmp_path) == []
    status = station.fly(30.0, armed=True)
    assert status.recording
    assert status.name == names(tmp_path)[0] == "20231114T221420Z_Alpine-meadow.mcap"
    assert status.bytes > 0
    assert status.error is None
    assert not station.fly(AFTER_DISARM_S + 1.0, armed=False).recording
    log = read_flight_log(tmp_path / names(tmp_path)[0])
    assert log.faults == ()
    assert log.plan == PLAN
    assert log.track.t_utc_s[0] - T0_UTC_S == pytest.approx(55.1, abs=0.11)
    assert log.track.t_utc_s[-1] - T0_UTC_S == pytest.approx(90 + AFTER_DISARM_S, abs=0.21)
    assert [armed for _, armed in log.armed] == [False, True, False]


def test_by_hand_it_runs_without_a_vehicle(station: Station, tmp_path: Path) -> None:
    name = station.recorder.start("../../Bench test: motors <1>")
    assert name == "20231114T221320Z_Bench-test-motors-1.mcap"
    assert station.recorder.start("again") == name
    station.recorder.on_message(Topic.SERVER, ServerAlive(T0_MONO_S, 1))
    station.recorder.work()
    station.recorder.stop()
    station.recorder.work()
    with open_recording(tmp_path / name) as recording:
        assert recording.finished
        assert [entry.topic for entry in recording.entries(RECORDED)] == [Topic.SERVER]


def test_neither_replays_nor_its_own_status_are_recorded(station: Station, tmp_path: Path) -> None:
    name = station.recorder.start()
    station.recorder.on_message("replay/vehicle/state", state_at(1.0))
    station.recorder.on_message(Topic.RECORDER, station.recorder.status())
    station.recorder.on_message(Topic.REPLAY, ReplayStatus(0.0))
    station.recorder.on_message(Topic.VEHICLE, state_at(2.0, armed=False))
    station.recorder.stop()
    station.recorder.work()
    with open_recording(tmp_path / name) as recording:
        assert recording.topics() == {Topic.VEHICLE}


def test_a_full_disk_is_said_and_recording_goes_on_in_a_new_file(station: Station, tmp_path: Path) -> None:
    station.fly(10.0, armed=True)
    station.broken = True
    status = station.fly(1.0, armed=True)
    assert not status.recording
    assert status.error is not None
    assert status.error.code == RecordingFullError.code
    (first,) = names(tmp_path)
    assert len(read_flight_log(tmp_path / first).track) >= 100
    assert station.fly(20.0, armed=True).error is not None
    station.broken = False
    status = station.fly(8.0, armed=True)
    assert status.recording
    assert status.error is None
    assert status.name != first
    station.fly(AFTER_DISARM_S + 1, armed=False)
    last = read_flight_log(tmp_path / names(tmp_path)[-1])
    assert last.faults == ()
    assert last.armed[-1][1] is False


def test_before_the_disk_is_full_the_recording_is_finished(station: Station, tmp_path: Path) -> None:
    station.fly(10.0, armed=True)
    station.free = 100 * MB
    status = station.fly(3.0, armed=True)
    assert status.recording
    assert status.error is not None
    assert "100 MB" in status.error.what
    station.free = 10 * MB
    status = station.fly(3.0, armed=True)
    assert not status.recording
    assert status.error is not None
    assert "stopped" in status.error.what
    log = read_flight_log(tmp_path / names(tmp_path)[0])
    assert log.faults == ()
    assert len(log.track) > 125
    station.fly(60.0, armed=True)
    assert len(names(tmp_path)) == 1
    station.free = 50_000 * MB
    assert station.fly(5.0, armed=True).recording
    assert len(names(tmp_path)) == 2


def test_started_by_hand_on_a_full_disk(station: Station, tmp_path: Path) -> None:
    station.free = 0
    station.recorder.start()
    assert isinstance(station.recorder.work(), RecordingFullError)
    assert station.recorder.error is not None
    assert not station.recorder.status().recording
    station.recorder.stop()
    assert station.recorder.status().error is None


def test_a_folder_that_disappears_is_an_error_not_the_end(station: Station, tmp_path: Path) -> None:
    station.recorder = Recorder(tmp_path / "gone", now=lambda: station.t_s, utc=lambda: station.t_s)
    station.recorder.start()
    assert station.recorder.work() is not None
    status = station.recorder.status()
    assert not status.recording
    assert status.error is not None
    (tmp_path / "gone").mkdir()
    station.recorder.start()
    assert station.recorder.work() is None
    assert station.recorder.status().recording
    station.recorder.stop()
    station.recorder.work()


def test_the_second_flight_has_a_file_of_its_own(station: Station, tmp_path: Path) -> None:
    for _ in range(2):
        station.fly(3.0, armed=True)
        station.fly(AFTER_DISARM_S + 1, armed=False)
    logs = [read_flight_log(tmp_path / name) for name in names(tmp_path)]
    assert len(logs) == 2
    assert all(log.faults == () for log in logs)


def test_another_plan_names_the_next_file(tmp_path: Path) -> None:
    station = Station(tmp_path)
    station.recorder.on_message(Topic.PLAN, replace(PLAN, name="Über den Ätna/../"))
    assert station.recorder.start() == "20231114T221320Z_ber-den-tna.mcap"
    station.recorder.stop()
    station.recorder.work()


def test_names_are_never_used_twice(tmp_path: Path) -> None:
    first = free_path(tmp_path, T0_UTC_S, "a")
    first.touch()
    second = free_path(tmp_path, T0_UTC_S, "a")
    assert (first.name, second.name) == ("20231114T221320Z_a.mcap", "20231114T221320Z_a_2.mcap")
    assert free_path(tmp_path, T0_UTC_S, "").name == "20231114T221320Z.mcap"
