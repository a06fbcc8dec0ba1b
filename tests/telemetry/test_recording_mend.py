"""Killed recordings get their index back."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.mend import mend
from telemetry.recording.mcap_files.reader import open_recording
from telemetry.recording.mcap_files.sink import being_written
from telemetry.recording.mcap_files.writer import RecordingWriter
from telemetry.recording.recorded_topics import RECORDED
from telemetry.topics.messages import Topic
from tests.telemetry.recordings import T0_UTC_S, state_at, write_flight


def counts(path: Path) -> tuple[int, bool]:
    with open_recording(path) as recording:
        return sum(1 for _ in recording.entries(RECORDED)), recording.finished


@settings(deadline=None, max_examples=25)
@given(cut=st.floats(0.2, 1.0, exclude_max=True))
def test_a_recording_cut_anywhere_becomes_a_whole_one(tmp_path_factory: pytest.TempPathFactory, cut: float) -> None:
    path = write_flight(tmp_path_factory.mktemp("mend") / "a.mcap", seconds=5)
    data = path.read_bytes()
    path.write_bytes(data[: int(cut * len(data))])
    before, finished = counts(path)
    assert not finished
    assert mend(path)
    assert counts(path) == (before, True)
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert sum(1 for _ in reader.iter_messages()) == summary.statistics.message_count >= before
        assert [m.name for m in reader.iter_metadata()] == ["hedgehop", "plan", "vehicle"]


def test_a_whole_recording_stays_as_it_is(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "a.mcap", seconds=1)
    data = path.read_bytes()
    assert not mend(path)
    assert path.read_bytes() == data


def test_a_recording_that_is_being_written_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    writer = RecordingWriter(path, t_utc_s=T0_UTC_S, t_mono_s=0.0)
    writer.write(Topic.VEHICLE, state_at(0.0), T0_UTC_S)
    writer.commit()
    assert being_written(path)
    assert not mend(path)
    assert counts(path) == (1, False)
    writer.close()
    assert not being_written(path)
    assert counts(path) == (1, True)


def test_foreign_files_are_not_touched(tmp_path: Path) -> None:
    for content in (b"hello", b"\x89MCAP0\r\n" + bytes(100)):
        (tmp_path / "a.mcap").write_bytes(content)
        assert not mend(tmp_path / "a.mcap")
        assert (tmp_path / "a.mcap").read_bytes() == content


def test_a_recording_without_messages_cannot_be_mended(tmp_path: Path) -> None:
    RecordingWriter(tmp_path / "a.mcap", t_utc_s=0.0, t_mono_s=0.0).abandon()
    with pytest.raises(RecordingError, match="no messages"):
        mend(tmp_path / "a.mcap")
    with pytest.raises(RecordingError):
        mend(tmp_path / "none.mcap")


def test_whoever_reads_the_broken_file_goes_on_reading_it(tmp_path: Path) -> None:
    path = write_flight(tmp_path / "a.mcap", finish=False, seconds=5)
    with path.open("ab") as file:
        file.write(b"\x06" + (10**6).to_bytes(8, "little") + bytes(50_000))
    with open_recording(path) as recording:
        assert mend(path)
        assert sum(1 for _ in recording.entries([Topic.VEHICLE])) == 51
    assert counts(path)[1]
    assert list(tmp_path.iterdir()) == [path]
