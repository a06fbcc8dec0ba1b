"""The writer: another library reads what it writes, and neither SIGKILL nor a full disk takes what it acknowledged."""

from __future__ import annotations

import errno
import os
import select
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from mcap.reader import make_reader

from telemetry.errors import RecordingError, RecordingFullError
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.topics.messages import RawFrame, Topic
from tests.telemetry.recordings import PLAN, T0_MONO_S, T0_UTC_S, flight, state_at, write_flight

RATE_HZ = 2000
MOST_LOST_S = 0.3

KILLED = """
import sys, time
from pathlib import Path
from telemetry.topics.messages import RawFrame, Topic
from telemetry.recording.mcap_files.writer import RecordingWriter
writer = RecordingWriter(Path(sys.argv[1]), t_utc_s=time.time(), t_mono_s=time.monotonic())
begin, done = time.monotonic(), 0
while True:
    due = int((time.monotonic() - begin) * int(sys.argv[2]))
    for number in range(done, due):
        stamp = b"%08d %012.6f" % (number, time.monotonic())
        writer.write(Topic.RAW, RawFrame(time.time(), False, "udp", stamp * 2), time.time())
        sys.stdout.buffer.write(stamp + b"\\n")
    sys.stdout.flush()
    done = due
    time.sleep(0.002)
"""


@pytest.mark.parametrize("kill_after_s", [0.9, 1.25, 1.6])
def test_sigkill_loses_less_than_a_third_of_a_second(tmp_path: Path, kill_after_s: float) -> None:
    """2,000 records a second; the other side of a pipe knows how far the writer had come when it was killed."""
    path = tmp_path / "killed.mcap"
    last_number, last_s = _run_and_kill([sys.executable, "-c", KILLED, str(path), str(RATE_HZ)], kill_after_s)
    with open_recording(path) as recording:
        frames = [entry.message for entry in recording.entries([Topic.RAW])]
        assert not recording.finished
    stamps = [frame.frame.split() for frame in frames if isinstance(frame, RawFrame)]
    assert [int(stamp[0]) for stamp in stamps] == list(range(len(stamps)))
    assert 0 < len(stamps) <= last_number + RATE_HZ
    assert last_s - float(stamps[-1][1][:12]) <= MOST_LOST_S


def _run_and_kill(command: list[str], after_s: float) -> tuple[int, float]:
    """Number and time of the last record that it said it had written."""
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        said = bytearray()
        try:
            while said.count(b"\n") < RATE_HZ * after_s:
                ready, _, _ = select.select([process.stdout], [], [], 60)
                assert ready, "the writer says nothing"
                said += os.read(process.stdout.fileno(), 1 << 16)
        finally:
            process.send_signal(signal.SIGKILL)
        said += process.stdout.read()
    number, t_s = said[: said.rindex(b"\n")].splitlines()[-1].split()
    return int(number), float(t_s)


def test_another_library_reads_every_message_and_checks_the_sums(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "a.mcap")
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        topics = [channel.topic for _, channel, _ in reader.iter_messages()]
        assert summary.statistics.message_count == len(topics)
        names = {metadata.name for metadata in reader.iter_metadata()}
    assert topics.count(Topic.VEHICLE) == 201
    assert {"foxglove/position", "foxglove/attitude", "foxglove/log", "mavlink/raw/received"} < set(topics)
    assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}
    assert {"foxglove.LocationFix", "foxglove.FrameTransform", "foxglove.Log"} < {
        schema.name for schema in summary.schemas.values()
    }
    assert names == {"hedgehop", "plan", "vehicle"}
    assert len(summary.chunk_indexes) > 50


def test_both_directions_and_every_link_have_a_channel_and_spare_frames_stay_apart(tmp_path: Path) -> None:
    kinds = [(sent, spare) for sent in (True, False) for spare in (True, False)]
    frames = [RawFrame(T0_UTC_S, sent, link, b"f", spare) for sent, spare in kinds for link in ("udp", "serial")]
    writer = RecordingWriter(tmp_path / "a.mcap", t_utc_s=T0_UTC_S, t_mono_s=0.0)
    for frame in frames:
        writer.write(Topic.RAW, frame, T0_UTC_S)
    writer.close()
    with open_recording(tmp_path / "a.mcap") as recording:
        assert [entry.message for entry in recording.entries([Topic.RAW])] == frames


def test_times_never_go_back(tmp_path: Path) -> None:
    writer = RecordingWriter(tmp_path / "a.mcap", t_utc_s=T0_UTC_S, t_mono_s=0.0)
    for t_s in (1.0, 0.5, 2.0):
        writer.write(Topic.VEHICLE, state_at(t_s), T0_UTC_S + t_s)
    writer.close()
    with open_recording(tmp_path / "a.mcap") as recording:
        assert [e.t_utc_s - T0_UTC_S for e in recording.entries([Topic.VEHICLE])] == [1.0, 1.0, 2.0]


class Disk:
    """Takes so many bytes, the last of them as a short write, then says that it is full."""

    def __init__(self, room: int) -> None:
        self.room = room

    def write(self, fd: int, data: memoryview) -> int:
        if self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written = os.write(fd, data[: min(len(data), self.room)])
        self.room -= written
        return written


@pytest.mark.parametrize("room", [5_000, 5_500, 8_000, 12_345])
def test_a_full_disk_keeps_all_that_was_acknowledged(tmp_path: Path, room: int) -> None:
    disk, clock = Disk(room), [0.0]
    path = tmp_path / "a.mcap"
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, now=lambda: clock[0], write=disk.write)
    messages = flight(600.0)

    def write_all() -> None:
        for t_s, topic, message in messages:
            clock[0] = t_s
            writer.write(topic, message, T0_UTC_S + t_s)

    with pytest.raises(RecordingFullError, match="full"):
        write_all()
    acknowledged, size = writer.messages, writer.bytes
    writer.abandon()
    assert path.stat().st_size == size <= room
    with open_recording(path) as recording:
        kinds = {Topic.RAW, Topic.VEHICLE, Topic.PLAN, Topic.LINK, Topic.COMMAND, Topic.TEXT, Topic.FLIGHT}
        assert sum(1 for _ in recording.entries(kinds)) == acknowledged > 0


def test_writing_goes_on_in_the_same_file_when_there_is_space_again(tmp_path: Path) -> None:
    disk = Disk(6_000)
    writer = RecordingWriter(tmp_path / "a.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, write=disk.write)
    for number in range(300):
        writer.write(Topic.VEHICLE, state_at(float(number)), T0_UTC_S + number)
        try:
            writer.commit()
        except RecordingFullError:
            disk.room = 1_000_000
    writer.close()
    assert len(read_flight_log(tmp_path / "a.mcap").track) == 300


def test_a_file_size_limit_of_the_system_is_a_full_disk(tmp_path: Path) -> None:
    """The kernel first takes a part, then refuses (RLIMIT_FSIZE)."""
    code = f"""
import resource
from pathlib import Path
from telemetry.errors import RecordingFullError
from telemetry.topics.messages import Topic
from telemetry.recording.mcap_files.writer import RecordingWriter
from tests.telemetry.recordings import T0_UTC_S, state_at
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
writer = RecordingWriter(Path({str(tmp_path / "a.mcap")!r}), t_utc_s=T0_UTC_S, t_mono_s=0.0)
try:
    for number in range(10_000):
        writer.write(Topic.VEHICLE, state_at(float(number)), T0_UTC_S + number)
        writer.commit()
except RecordingFullError:
    print(writer.messages)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=90, check=True)
    assert len(read_flight_log(tmp_path / "a.mcap").track) == int(done.stdout) > 0


def test_without_room_for_the_index_the_recording_is_readable_all_the_same(tmp_path: Path) -> None:
    disk = Disk(1 << 30)
    writer = RecordingWriter(tmp_path / "a.mcap", t_utc_s=T0_UTC_S, t_mono_s=T0_MONO_S, write=disk.write)
    writer.write(Topic.PLAN, PLAN, T0_UTC_S)
    writer.write(Topic.VEHICLE, state_at(0.0), T0_UTC_S)
    writer.commit()
    disk.room = 100
    with pytest.raises(RecordingFullError):
        writer.close()
    assert read_flight_log(tmp_path / "a.mcap").plan == PLAN


def test_what_cannot_be_created_is_said(tmp_path: Path) -> None:
    for path in (tmp_path / "none" / "a.mcap", write_flight(tmp_path / "there.mcap", seconds=1)):
        with pytest.raises(RecordingError, match="cannot be written"):
            RecordingWriter(path, t_utc_s=0.0, t_mono_s=0.0)
    with pytest.raises(RecordingFullError):
        RecordingWriter(tmp_path / "full.mcap", t_utc_s=0.0, t_mono_s=0.0, write=Disk(5).write)
