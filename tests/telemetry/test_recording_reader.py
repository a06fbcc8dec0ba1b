"""Reading recordings, whole and broken ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from telemetry.errors import RecordingError
from telemetry.recording.mcap_files.reader import Recording, open_recording
from telemetry.recording.recorded_topics import RECORDED
from telemetry.topics.messages import Published, Topic
from tests.telemetry.recordings import T0_MONO_S, T0_UTC_S, flight, write_flight

SENT = [(T0_UTC_S + t_s, str(topic), message) for t_s, topic, message in flight()]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write_flight(tmp_path_factory.mktemp("reader") / "a.mcap").read_bytes()


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return write_flight(tmp_path_factory.mktemp("reader") / "a.mcap", finish=False).read_bytes()


def all_entries(data: bytes) -> list[tuple[float, str, Published]]:
    return [(round(e.t_utc_s, 6), str(e.topic), e.message) for e in Recording("a.mcap", data).entries(RECORDED)]


def test_everything_comes_back_in_order(whole: bytes, killed: bytes) -> None:
    assert all_entries(whole) == SENT
    assert all_entries(killed) == SENT


@settings(deadline=None, max_examples=60)
@given(share=st.floats(0, 1))
def test_a_file_cut_anywhere_gives_a_beginning_of_what_was_recorded(whole: bytes, share: float) -> None:
    cut = round(share * (len(whole) - 1))
    try:
        found = all_entries(whole[:cut])
    except RecordingError:
        assert cut < 5_000  # metadata and the channels of raw frames
        return
    assert found == SENT[: len(found)]


@settings(deadline=None, max_examples=60)
@given(share=st.floats(0, 1), value=st.integers(1, 255))
def test_a_damaged_byte_costs_no_more_than_its_surroundings(whole: bytes, share: float, value: int) -> None:
    """Never an exception, never a message that was not recorded: every chunk has a checksum."""
    at = 60 + round(share * (len(whole) - 61))
    damaged = bytearray(whole)
    damaged[at] ^= value
    try:
        found = all_entries(bytes(damaged))
    except RecordingError:
        return
    assert all(entry in SENT for entry in found if entry[1] != Topic.RAW)


@pytest.mark.parametrize("finish", [True, False])
@settings(deadline=None, max_examples=30)
@given(t_s=st.floats(-1, 21))
def test_the_latest_of_a_topic(whole: bytes, killed: bytes, finish: bool, t_s: float) -> None:
    recording = Recording("a.mcap", whole if finish else killed)
    for topic in (Topic.VEHICLE, Topic.PLAN, Topic.FLIGHT, Topic.LINK, Topic.TRANSFER):
        earlier = [message for t, name, message in SENT if name == topic and t <= T0_UTC_S + t_s]
        found = recording.latest(topic, T0_UTC_S + t_s)
        assert (found.message if found else None) == (earlier[-1] if earlier else None)


@given(t_s=st.floats(-1, 21))
@settings(deadline=None, max_examples=30)
def test_entries_from_a_time_on(whole: bytes, t_s: float) -> None:
    recording = Recording("a.mcap", whole)
    found = [round(entry.t_utc_s, 6) for entry in recording.entries([Topic.VEHICLE], T0_UTC_S + t_s)]
    assert found == [t for t, topic, _ in SENT if topic == Topic.VEHICLE and t >= T0_UTC_S + t_s]


def test_what_a_recording_says_of_itself(whole: bytes, killed: bytes) -> None:
    for data in (whole, killed):
        recording = Recording("a.mcap", data)
        assert recording.metadata["plan"]["name"] == "Alpine meadow"
        assert recording.metadata["vehicle"]["firmware_version"] == "4.6.0"
        assert recording.metadata["hedgehop"]["name"] == "by hand"
        assert recording.mono_minus_utc_s == pytest.approx(T0_MONO_S - T0_UTC_S)
        assert recording.start_utc_s == T0_UTC_S
        assert recording.end_utc_s == pytest.approx(T0_UTC_S + 20)
    assert Recording("a.mcap", whole).faults == []
    assert len(Recording("a.mcap", killed).faults) == 1


def test_a_damaged_part_is_a_fault(whole: bytes) -> None:
    at = len(whole) // 2
    recording = Recording("a.mcap", whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :])
    assert len(list(recording.entries(RECORDED))) < len(SENT)
    assert any("damaged" in fault for fault in recording.faults)


def test_only_recordings_are_opened(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_text("hello")
    with pytest.raises(RecordingError, match="text"), open_recording(tmp_path / "a.mcap"):
        pass
