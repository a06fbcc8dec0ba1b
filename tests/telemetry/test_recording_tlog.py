"""Telemetry logs: every good frame is found, whatever stands between."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.recording.tlog import Damage, tlog_frames
from tests.telemetry.recordings import T0_UTC_S, heartbeat, tlog_record

GCS = 255


def readme_counts(readme: str, log: str) -> dict[str, tuple[int, int]]:
    """{message type: (from the vehicle, from the ground station)} as the README's table has it."""
    section = readme.split(f"### {log} ")[1].split("###")[0]
    return {name: (int(a), int(b)) for name, a, b in re.findall(r"\| ([A-Z_0-9]+) \| (\d+) \| (\d+) \|", section)}


@pytest.mark.parametrize("log", ["auto.tlog", "guided.tlog", "gcs_failsafe.tlog", "rejects.tlog"])
def test_every_message_of_the_recorded_flights_is_found(shared_data: Path, log: str) -> None:
    folder = shared_data / "logs" / "arducopter"
    damage, counts = Damage(), Counter[tuple[str, bool]]()
    for frame in tlog_frames((folder / log).read_bytes(), damage):
        counts[mavlink.mavlink_map[frame.message_id].msgname, frame.system_id == GCS] += 1
    expected = readme_counts((folder / "README.md").read_text(), log)
    assert {name: (counts[name, False], counts[name, True]) for name, _ in counts} == expected
    assert damage == Damage()


def test_a_log_with_bad_stretches_keeps_all_its_messages(shared_data: Path) -> None:
    damage = Damage()
    frames = list(tlog_frames((shared_data / "logs" / "dronekit" / "flight.tlog").read_bytes(), damage))
    assert len(frames) == 75_477
    assert damage.spans == 1_314
    assert damage.cut_short
    assert len({(frame.system_id, frame.component_id) for frame in frames}) == 3
    assert frames[-1].t_utc_s - frames[0].t_utc_s == pytest.approx(1377, abs=1)


def versions_of_a_frame(sequence: int) -> bytes:
    """Alternately MAVLink 2 and 1."""
    if sequence % 2:
        return heartbeat(sequence)
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    link.seq = sequence % 256
    return bytes(link.heartbeat_encode(2, 3, 1, 3, 4).pack(link, force_mavlink1=True))


@given(st.lists(st.binary(max_size=40), min_size=1, max_size=12))
def test_rubbish_between_records_costs_only_itself(rubbish: list[bytes]) -> None:
    frames = [versions_of_a_frame(number) for number in range(len(rubbish))]
    data = b"".join(
        junk + tlog_record(T0_UTC_S + number, frame)
        for number, (junk, frame) in enumerate(zip(rubbish, frames, strict=True))
    )
    assert [entry.frame for entry in tlog_frames(data) if entry.frame in frames] == frames


@given(st.integers(min_value=0, max_value=3 * 29 - 1))
def test_a_log_cut_anywhere_gives_its_whole_records(cut: int) -> None:
    whole = b"".join(tlog_record(T0_UTC_S + number, heartbeat(number)) for number in range(3))
    size = len(whole) // 3
    damage = Damage()
    assert len(list(tlog_frames(whole[:cut], damage))) == cut // size
    assert damage.cut_short == (cut % size > 0)
    assert damage.spans == 0


def test_messages_of_unknown_type_are_counted_between_known_ones() -> None:
    """Their checksum cannot be known; their length is."""
    frame = bytearray(heartbeat(1))
    frame[7:10] = (60_000).to_bytes(3, "little")
    data = b"".join(tlog_record(T0_UTC_S, f) for f in (heartbeat(0), bytes(frame), heartbeat(2)))
    damage = Damage()
    assert [entry.message_id for entry in tlog_frames(data, damage)] == [0, 60_000, 0]
    assert damage == Damage()


def test_a_signed_frame_keeps_its_signature() -> None:
    link = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    link.signing.secret_key = b"k" * 32
    link.signing.sign_outgoing = True
    signed = bytes(link.heartbeat_encode(2, 3, 1, 3, 4).pack(link))
    found = [entry.frame for entry in tlog_frames(tlog_record(T0_UTC_S, signed) + tlog_record(T0_UTC_S, heartbeat(0)))]
    assert found == [signed, heartbeat(0)]
