"""What replays are fed from."""

from __future__ import annotations

from pathlib import Path

import pytest

from telemetry.errors import RecordingError
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.replay_sources import open_source
from telemetry.topics.messages import Topic
from telemetry.topics.vehicle import VehicleState
from tests.telemetry.recordings import T0_UTC_S, flight, write_flight


@pytest.mark.parametrize("finish", [True, False])
def test_a_recording_gives_what_was_published_but_no_frames(tmp_path: Path, finish: bool) -> None:
    source = open_source(write_flight(tmp_path / "a.mcap", finish=finish))
    try:
        found = [(round(e.t_utc_s - T0_UTC_S, 6), e.topic, e.message) for e in source.entries(0.0)]
        assert found == [entry for entry in flight() if entry[1] != Topic.RAW]
        latest = {entry.topic for entry in source.latest(source.end_utc_s)}
        assert latest == {Topic.VEHICLE, Topic.LINK, Topic.PLAN, Topic.FLIGHT}
    finally:
        source.close()


def test_frames_come_when_asked_for(tmp_path: Path) -> None:
    source = open_source(write_flight(tmp_path / "a.mcap"), raw=True)
    try:
        assert sum(entry.topic == Topic.RAW for entry in source.entries(0.0)) == 201
    finally:
        source.close()


def test_a_log_of_another_station_gives_states_and_texts(shared_data: Path) -> None:
    path = shared_data / "logs" / "arducopter" / "auto.tlog"
    source, log = open_source(path), read_flight_log(path)
    entries = list(source.entries(0.0))
    assert [e.t_utc_s for e in entries] == sorted(e.t_utc_s for e in entries)
    states = {e.t_utc_s: e.message for e in entries if isinstance(e.message, VehicleState)}
    assert all(states[t] == state for t, state in log.states)
    assert [e.message for e in entries if e.topic == Topic.TEXT] == list(log.texts)
    (latest,) = source.latest(log.track.t_utc_s[1000])
    assert latest.message == log.states[1000][1]
    assert source.latest(source.start_utc_s - 1) == []
    assert next(source.entries(log.track.t_utc_s[1000])).t_utc_s >= log.track.t_utc_s[1000]
    source.close()


def test_what_cannot_be_replayed_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.tlog").write_text("hello")
    with pytest.raises(RecordingError, match="text"):
        open_source(tmp_path / "a.tlog")
