"""A TI radar as a source, over pseudo-terminals with the real serial library: configured, read, lost, found again."""

from __future__ import annotations

import contextlib
import fcntl
import os
import queue
import termios
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import serial

from telemetry.agent.client import NoticeReading, RadarReading
from telemetry.agent.ti_radar import TiRadar
from telemetry.errors import SensorError
from telemetry.sensors.serial_port import open_port
from telemetry.sensors.ti_mmwave import ti_session
from telemetry.sensors.ti_mmwave.cfg_commands import parse_commands
from telemetry.sensors.ti_mmwave.config import config_of
from telemetry.sensors.ti_mmwave.packets import TiStream
from telemetry.sensors.ti_mmwave.ti_session import TiPorts, config_port_beside
from tests.telemetry.test_ti_config import GOOD
from tests.telemetry.ti_board import Board, acknowledging, plugged
from tests.telemetry.ti_packets import frame, sdk3, with_profile

PATIENCE_S = 60.0
CONFIG = config_of(parse_commands(GOOD, file="radar.cfg"))


class Listener:
    """Runs a radar's readings through in a thread, as the agent does."""

    def __init__(self, radar: TiRadar) -> None:
        self.radar = radar
        self.readings: queue.Queue[RadarReading | Exception] = queue.Queue()
        self.notices: list[NoticeReading] = []
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            with contextlib.closing(self.radar.readings()) as readings:
                for reading in readings:
                    if isinstance(reading, NoticeReading):
                        self.notices.append(reading)
                        continue
                    self.readings.put(reading)
                    if self._stopping.is_set():
                        return
        except SensorError as error:
            self.readings.put(error)

    def next(self) -> RadarReading:
        got = self.readings.get(timeout=PATIENCE_S)
        assert isinstance(got, RadarReading), got
        return got

    def error(self) -> SensorError:
        got = self.readings.get(timeout=PATIENCE_S)
        assert isinstance(got, SensorError), got
        return got

    def end(self, board: Board) -> None:
        """One more frame lets the thread see that it is to stop."""
        self._stopping.set()
        for _ in range(round(PATIENCE_S / 0.05)):
            if not self._thread.is_alive():
                break
            board.send(frame(99))
            self._thread.join(0.05)
        self._thread.join(PATIENCE_S)
        assert not self._thread.is_alive()


def soon(_: float) -> None:
    threading.Event().wait(0.02)


@contextlib.contextmanager
def listening(board: Board, told: list[str], *, config: bool = True) -> Iterator[Listener]:
    ports = TiPorts(str(board.data), str(board.config) if config else None)
    listener = Listener(TiRadar(CONFIG, ports, tell=told.append, wait=soon))
    try:
        yield listener
    finally:
        if listener._thread.is_alive():
            listener.end(board)


def until(wanted: Callable[[], bool]) -> None:
    waiting = threading.Event()
    for _ in range(round(PATIENCE_S / 0.01)):
        if wanted():
            return
        waiting.wait(0.01)
    pytest.fail("it never came")


def configured(board: Board, times: int = 1) -> Callable[[], bool]:
    return lambda: len(board.lines) == times * len(CONFIG.commands)


def test_it_is_configured_line_by_line_and_its_points_come(tmp_path: Path) -> None:
    told: list[str] = []
    with plugged(tmp_path) as board, listening(board, told) as listener:
        until(configured(board))
        assert board.lines == [command.text.encode() for command in CONFIG.commands]
        board.send(b"\x00garbage" + frame(1) + sdk3(2, []) + frame(5))
        first, nothing, second = (listener.next() for _ in range(3))
        status = listener.radar.status
        assert (status.stream.bad_bytes, status.stream.lost_packets, status.interruptions) == (8, 2, 0)
    assert first.targets == pytest.approx(np.array([[1, 20, 0.5, -3, 20], [-4, 60, 2, 0.31, 15.5]], np.float32))
    assert nothing.targets.shape == (0, 5)  # It sees nothing, and says so.
    assert (first.lost, nothing.lost, second.lost) == (0, 0, 2)
    assert second.t_s >= first.t_s
    assert told == []


def test_a_crowded_frame_is_a_notice_for_the_pilot_once(tmp_path: Path) -> None:
    told: list[str] = []
    with plugged(tmp_path) as board, listening(board, told) as listener:
        until(configured(board))
        for number in (1, 2):
            board.send(sdk3(number, [(0.0, 10.0 + 0.01 * k, 0.0, 0.0) for k in range(1001)]))
            assert len(listener.next().targets) == 1000
        assert listener.radar.status.left_out == 2
    assert [notice.warning for notice in listener.notices] == [True]
    assert listener.notices[0].text == f"radar: {told[0]}"
    assert "A frame has 1,001 targets" in told[0]


def test_a_pulled_cable_is_told_counted_and_recovered_from(tmp_path: Path) -> None:
    told: list[str] = []
    with plugged(tmp_path) as board, listening(board, told) as listener:
        until(configured(board))
        board.send(frame(1) + frame(2)[:50])
        assert len(listener.next().targets) == 2
        until(lambda: listener.radar.status.stream.bytes == len(frame(1)) + 50)
        board.unplug()
        until(lambda: listener.radar.status.trouble != "")
        board.plug()
        until(configured(board, times=2))
        board.send(frame(1))
        assert len(listener.next().targets) == 2
        status = listener.radar.status
        assert (status.interruptions, status.trouble, status.stream.bad_bytes) == (1, "", 50)
    assert "Check its cable" in told[0] or "no such port" in told[0]
    assert told[-1] == "The radar sends frames again."
    assert len(told) <= 4
    assert listener.notices[0].warning
    assert (listener.notices[-1].warning, listener.notices[-1].text) == (False, "radar: It sends frames again.")
    assert "1 interruptions" in str(status)


def test_a_radar_that_falls_silent_is_configured_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    with plugged(tmp_path) as board, listening(board, told) as listener:
        until(configured(board))
        board.send(frame(1))
        listener.next()
        monkeypatch.setattr(ti_session, "SILENT_S", 0.1)
        until(lambda: told != [])
        monkeypatch.setattr(ti_session, "SILENT_S", PATIENCE_S)
        until(lambda: len(board.lines) >= 2 * len(CONFIG.commands))
        until(lambda: board.send(frame(1)) is None and listener.radar.status.trouble == "")
        listener.next()
    assert "has sent nothing" in told[0]
    assert listener.radar.status.interruptions >= 1


def test_a_refused_line_ends_it(tmp_path: Path) -> None:
    def answer(line: bytes) -> bytes:
        return b"Error -1\n" if line.startswith(b"profileCfg") else acknowledging(line)

    with plugged(tmp_path, answer) as board, listening(board, []) as listener:
        error = listener.error()
    assert 'refused "profileCfg 0 77' in error.what
    assert error.where == "radar.cfg, line 8"


def test_what_it_sent_before_it_was_configured_is_not_told_as_new(tmp_path: Path) -> None:
    """It was running already: its old frames wait in the port while it is stopped and set up."""
    set_up = threading.Event()

    def answer(line: bytes) -> bytes:
        if line == b"sensorStop":
            assert set_up.wait(PATIENCE_S)
        return acknowledging(line)

    with plugged(tmp_path, answer) as board, listening(board, []) as listener:
        until(lambda: board.lines == [b"sensorStop"])
        board.send(frame(1) + frame(2))
        set_up.set()
        until(configured(board))
        board.send(frame(77))
        listener.next()
        assert listener.radar.status.stream.frames == 1


def test_frames_that_have_waited_are_as_old_as_their_numbers_say() -> None:
    class Port:
        port, baudrate, in_waiting = "ttyACM1", 921_600, 1

        def read(self, _: int) -> bytes:
            return frame(5) + frame(6) + frame(9) + frame(90_000) + frame(90_001)

    found = ti_session.frames(cast("Any", Port()), TiStream(), period_s=0.1, now=lambda: 100.0)
    sent_s = [next(found)[0] for _ in range(5)]
    own_s = len(frame(1)) * 10 / 921_600
    assert sent_s == pytest.approx([100.0 - own_s - back for back in (0.6, 0.5, 0.2, 0.1, 0.0)], abs=1e-6)


def test_a_flipped_bit_in_a_number_makes_no_frame_older() -> None:
    class Port:
        port, baudrate, in_waiting = "ttyACM1", 921_600, 1

        def read(self, _: int) -> bytes:
            return frame(5) + frame(6 + 64) + frame(7)

    found = ti_session.frames(cast("Any", Port()), TiStream(), period_s=0.1, now=lambda: 100.0)
    own_s = len(frame(1)) * 10 / 921_600
    assert [next(found)[0] for _ in range(3)] == pytest.approx([100.0 - own_s - back for back in (0.2, 0.1, 0.0)])


def test_a_port_that_fails_while_it_is_emptied_is_one_that_has_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The terminal's own errors are no OSError: they would end the reading thread, and nobody would be told."""

    def fails(_: object) -> None:
        raise termios.error(5, "Input/output error")

    with plugged(tmp_path) as board:
        with contextlib.closing(open_port(str(board.data), 921_600)) as port:
            monkeypatch.setattr(serial.Serial, "reset_input_buffer", fails)
            with pytest.raises(SensorError, match="has gone"):
                ti_session.empty(port)
        monkeypatch.setattr(serial.Serial, "_reset_input_buffer", fails)
        with pytest.raises(SensorError, match="cannot be opened"):
            open_port(str(board.data), 921_600)


def test_garbage_alone_is_a_wrong_baud_rate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ti_session, "GARBLED_S", 0.0)
    with plugged(tmp_path) as board, listening(board, [], config=False) as listener:
        until(lambda: listener.radar.status.stream.bytes > 0 or board.send(b"\x81\x00\xfe" * 100) is not None)
        error = listener.error()
    assert "no frame is among them" in error.what
    assert "921600" in error.advice


def test_garbage_after_frames_is_told_and_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    with plugged(tmp_path) as board, listening(board, told) as listener:
        until(configured(board))
        board.send(frame(1))
        listener.next()
        monkeypatch.setattr(ti_session, "GARBLED_S", 0.0)
        board.send(b"\x81\x00\xfe" * 100)
        until(lambda: listener.radar.status.trouble != "")
        board.send(frame(2))
        listener.next()
        assert listener.radar.status.trouble == ""
    assert "baud rate" in told[0]


def test_a_port_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(SensorError, match="no such port") as caught:
        open_port(str(tmp_path / "ttyACM1"), 921_600)
    assert caught.value.where.endswith("ttyACM1")


def test_a_port_in_use_is_said(tmp_path: Path) -> None:
    with plugged(tmp_path) as board:
        other = os.open(board.data, os.O_RDWR | os.O_NOCTTY)
        try:
            fcntl.flock(other, fcntl.LOCK_EX)
            with pytest.raises(SensorError, match="in use by another program"):
                open_port(str(board.data), 921_600)
        finally:
            os.close(other)


def test_a_file_is_no_port(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"hello")
    with pytest.raises(SensorError, match="cannot be opened"):
        open_port(str(tmp_path / "file"), 921_600)


def test_the_config_port_is_the_one_before(tmp_path: Path) -> None:
    assert config_port_beside(str(tmp_path / "ttyACM1")) is None
    (tmp_path / "ttyACM0").touch()
    assert config_port_beside(str(tmp_path / "ttyACM1")) == str(tmp_path / "ttyACM0")
    assert config_port_beside(str(tmp_path / "ttyACM0")) is None
    assert config_port_beside("COM4") is None


def test_a_running_radar_with_another_configuration_is_told_to_the_pilot(tmp_path: Path) -> None:
    told: list[str] = []
    with plugged(tmp_path) as board, listening(board, told, config=False) as listener:
        until(lambda: board.send(with_profile(1, 64)) is None and not listener.readings.empty())
        board.send(with_profile(2, 64))
        listener.next()
    assert [notice.warning for notice in listener.notices] == [True]
    assert "64 range cells" in listener.notices[0].text
    assert len(told) == 1
