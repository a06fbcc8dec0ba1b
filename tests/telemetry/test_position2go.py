"""A Position2Go as a source, over a pseudo-terminal with the real serial library: known, set up, read, lost, found."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from mapping.radar.radar_params import POSITION2GO
from telemetry.agent.client import NoticeReading, RadarReading
from telemetry.agent.position2go import Position2Go
from telemetry.errors import SensorError
from telemetry.sensors.position2go import answers, board_session
from telemetry.sensors.position2go.board_messages import MessageStream, OutOfStepError, Payload, Status, encode
from tests.telemetry.position2go_board import Position2GoBoard, frame, payload, plugged, status


@pytest.fixture
def board(tmp_path: Path) -> Iterator[Position2GoBoard]:
    with plugged(tmp_path) as made:
        yield made


def radar_at(board: Position2GoBoard, told: list[str] | None = None) -> Position2Go:
    return Position2Go(str(board.device), tell=(told if told is not None else []).append, wait=lambda _: None)


def taken(radar: Position2Go, count: int) -> list[RadarReading]:
    """So many frames, without what the pilot is told."""
    with contextlib.closing(radar.readings()) as readings:
        return list(islice((one for one in readings if isinstance(one, RadarReading)), count))


def test_its_samples_become_targets_on_board(board: Position2GoBoard) -> None:
    told: list[str] = []
    radar = radar_at(board, told)
    readings = taken(radar, 3)
    assert board.interval_us == 0
    assert board.format == struct.pack("<BIIBB", 0x41, 64, 16, 3, 2)
    for reading in readings:
        strongest = reading.targets[np.argmax(reading.targets[:, 4])]
        range_m, azimuth_deg = np.hypot(*strongest[:2]), np.degrees(np.arctan2(strongest[0], strongest[1]))
        assert range_m == pytest.approx(8.0, abs=0.2)
        assert azimuth_deg == pytest.approx(20.0, abs=3.0)
        assert strongest[3] == pytest.approx(-1.5, abs=0.2)
        assert strongest[4] > 20.0
        assert reading.lost == 0
    assert readings[0].t_s < readings[1].t_s < readings[2].t_s
    assert told == ["The radar's range cells are 0.75 m, to 48 m; speeds to 6.2 m/s."]
    assert (radar.status.frames, radar.status.counts.bad_bytes) == (3, 0)
    assert "3 frames" in str(radar.status)


@pytest.mark.parametrize("damage", ["lost byte", "extra bytes", "wrong length", "noise before", "cut short", "nothing"])
def test_a_damaged_frame_is_one_lost_frame(
    board: Position2GoBoard, damage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(board_session, "ANSWER_WITHIN_S", 0.3)
    board.damage = ["", damage]
    radar = radar_at(board)
    readings = taken(radar, 4)
    assert [reading.lost for reading in readings] == [0, 1, 0, 0]
    assert radar.status.counts.lost_frames == 1
    assert (radar.status.counts.bad_bytes > 0) == (damage != "nothing")
    assert radar.status.interruptions == 0


def test_a_pulled_cable_is_told_counted_and_recovered_from(board: Position2GoBoard) -> None:
    told: list[str] = []
    radar = radar_at(board, told)
    notices: list[NoticeReading] = []
    with contextlib.closing(radar.readings()) as readings:
        assert isinstance(next(readings), RadarReading)
        board.unplug()
        while not radar.status.trouble:
            notices += [one for one in [next(readings)] if isinstance(one, NoticeReading)]
        board.plug()
        while radar.status.trouble:
            notices += [one for one in [next(readings)] if isinstance(one, NoticeReading)]
        assert isinstance(next(readings), RadarReading)
    assert radar.status.interruptions == 1
    assert "has gone" in told[1] or "no such port" in told[1]
    assert told[-1] == "The radar sends frames again."
    assert [notice.warning for notice in (notices[0], notices[-1])] == [True, False]


def test_a_board_that_falls_silent_is_set_up_again(board: Position2GoBoard, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_session, "ANSWER_WITHIN_S", 0.5)
    board.damage = ["", *board_session.LOST_MOST * ["nothing"]]
    radar = radar_at(board)
    readings = taken(radar, 2)
    assert [reading.lost for reading in readings] == [0, 0]
    assert (radar.status.counts.lost_frames, radar.status.interruptions) == (board_session.LOST_MOST, 1)


def test_another_device_is_said(board: Position2GoBoard, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(board_session, "ANSWER_WITHIN_S", 0.5)
    board.is_mute = True
    with pytest.raises(SensorError, match="Nothing at this port answers as a Position2Go") as caught:
        taken(radar_at(board), 1)
    assert caught.value.where == str(board.device)
    board.is_mute, board.endpoints = False, [(0x52424153, 1), (0x52444F50, 1)]
    with pytest.raises(SensorError, match="another of Infineon's boards"):
        taken(radar_at(board), 1)


@pytest.mark.parametrize(
    ("change", "words"),
    [({"refuses": {0x41: 7}}, "refused request 0x41 with status 7"), ({"direction": 1}, "do not go upward"),
     ({"sweep_khz": (60_000_000, 61_000_000)}, "none of its own"), ({"chirp_ns": 1}, "none of its own")],
)  # fmt: skip
def test_a_board_that_does_otherwise_is_refused(board: Position2GoBoard, change: dict[str, object], words: str) -> None:
    for name, value in change.items():
        setattr(board, name, value)
    with pytest.raises(SensorError, match=words):
        taken(radar_at(board), 1)


def test_its_own_sweep_makes_its_cells(board: Position2GoBoard) -> None:
    board.sweep_khz, board.chirp_ns = (24_050_000, 24_150_000), 400_000
    told: list[str] = []
    taken(radar_at(board, told), 1)
    assert told[0].startswith("The radar's range cells are 1.50 m, to 96 m; speeds to 5.2 m/s")


def test_driven_to_the_end_of_the_scale_is_told_once(board: Position2GoBoard) -> None:
    board.gain = 900.0
    told: list[str] = []
    radar = radar_at(board, told)
    with contextlib.closing(radar.readings()) as readings:
        seen = list(islice(readings, 4))
    assert [type(one) for one in seen] == [NoticeReading, RadarReading, RadarReading, RadarReading]
    assert radar.status.counts.clipped_frames == 3
    assert sum("end of their scale" in line for line in told) == 1


def test_a_frame_of_samples_is_read_to_the_last_bit() -> None:
    rng = np.random.default_rng(3)
    for bits in (8, 12, 13, 16):
        words = rng.integers(1, (1 << bits) - 1, (16, 2, 2, 64))
        packed = np.packbits((words.reshape(-1, 1) >> np.arange(bits)) & 1, bitorder="little").tobytes()
        read = answers.frame_of(struct.pack("<BIIBIBBBB", 0, 5, 16, 2, 64, 3, 1, bits, 0) + packed)
        centred = words - words.mean(axis=-1, keepdims=True)
        assert (read.number, read.clipped, read.cube.shape) == (5, 0.0, POSITION2GO.shape)
        assert read.cube == pytest.approx(centred[:, :, 0] + 1j * centred[:, :, 1], abs=0.02)


@pytest.mark.parametrize(
    "wrong",
    [b"", frame(1)[:-1], frame(1) + b"\0", b"\x01" + frame(1)[1:], frame(1)[:5] + b"\x08" + frame(1)[6:],
     frame(1)[:15] + b"\x02" + frame(1)[16:], frame(1)[:16] + b"\x20" + frame(1)[17:],
     frame(1)[:17] + b"\x01" + frame(1)[18:]],
    ids=["empty", "short", "long", "kind", "chirps", "interleaved parts", "32 bits", "interleaved receivers"],
)  # fmt: skip
def test_frames_of_another_form_are_refused(wrong: bytes) -> None:
    with pytest.raises(answers.WrongAnswerError):
        answers.frame_of(wrong)


def test_messages_come_in_any_pieces() -> None:
    whole = payload(1, b"abc") + status(1) + payload(2, b"") + status(0, 0x0102)
    for size in (1, 2, 5, len(whole)):
        stream = MessageStream()
        found = [m for k in range(0, len(whole), size) for m in stream.feed(whole[k : k + size])]
        assert found == [Payload(1, b"abc"), Status(1, 0), Payload(2, b""), Status(0, 0x0102)]
        assert stream.reset() == 0
    assert encode(1, b"abc") == payload(1, b"abc")


@pytest.mark.parametrize("wrong", [b"\x00", b"\x5a\x01\xff\xff", payload(1, b"abc")[:-1] + b"\x00"])
def test_what_is_out_of_step_is_told_and_forgotten(wrong: bytes) -> None:
    stream = MessageStream()
    with pytest.raises(OutOfStepError):
        stream.feed(wrong)
    assert stream.reset() == len(wrong)
    assert stream.feed(status(3)) == [Status(3, 0)]
