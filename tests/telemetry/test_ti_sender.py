"""The configuration's sender: line by line against a firmware that answers, refuses, babbles or is silent."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from telemetry.errors import SensorError
from telemetry.sensors.ti_mmwave.cfg_commands import parse_commands
from telemetry.sensors.ti_mmwave.sender import ANSWER_WITHIN_S, START_WITHIN_S, ConfigSender

TEXT = "% demo\nsensorStop\nflushCfg\nframeCfg 0 2 16 0 100 1 0\nsensorStart\n"


def sender() -> ConfigSender:
    return ConfigSender(parse_commands(TEXT, file="radar.cfg"))


def echoing(line: bytes) -> bytes:
    """As the firmware: the echo, words, the answer, the prompt."""
    words = b"Ignored: Sensor is already stopped\n" if line == b"sensorStop" else b""
    return line + b"\r\n" + words + b"Done\r\n\r\nmmwDemo:/>"


def drive(firmware: Callable[[bytes], bytes], piece: int = 1000) -> list[bytes]:
    """The lines that the firmware got."""
    machine, lines, now_s = sender(), [], 0.0
    waiting = machine.start(now_s)
    while not machine.done:
        assert waiting.endswith(b"\n")
        lines.append(waiting.strip())
        answer, waiting = firmware(waiting.strip()), b""
        for start in range(0, len(answer), piece):
            waiting += machine.on_data(answer[start : start + piece], now_s)
        now_s += 0.1
        machine.on_tick(now_s)
    return lines


@pytest.mark.parametrize("piece", [1, 3, 1000])
def test_every_line_is_sent_once_after_the_one_before_was_acknowledged(piece: int) -> None:
    assert drive(echoing, piece) == [b"sensorStop", b"flushCfg", b"frameCfg 0 2 16 0 100 1 0", b"sensorStart"]


def test_an_answer_behind_the_prompt_counts() -> None:
    assert len(drive(lambda line: b"mmwDemo:/>" + line + b"\nmmwDemo:/>Done\n")) == 4


@pytest.mark.parametrize(
    ("answer", "words"),
    [(b"Error -1\r\n", "Error -1"),
     (b"Error: Invalid usage of the CLI command\r\nError -1\r\n", "Invalid usage"),
     (b"'frameCfg' is not recognized as a CLI command\r\n", "not recognized"),
     (b"Debug: too long\r\nError -1\r\n", "Debug: too long Error -1")],
)  # fmt: skip
def test_a_refused_line_is_named_with_the_radars_own_words(answer: bytes, words: str) -> None:
    with pytest.raises(SensorError) as caught:
        drive(lambda line: answer if line.startswith(b"frameCfg") else echoing(line))
    assert words in caught.value.what
    assert "frameCfg 0 2 16 0 100 1 0" in caught.value.what
    assert caught.value.where == "radar.cfg, line 4"


def test_silence_from_the_start_is_another_port_or_no_power() -> None:
    machine = sender()
    machine.start(100.0)
    machine.on_tick(100.0 + ANSWER_WITHIN_S - 0.01)
    with pytest.raises(SensorError, match="does not answer on its config port"):
        machine.on_tick(100.0 + ANSWER_WITHIN_S)


def test_silence_later_names_the_line() -> None:
    machine = sender()
    machine.start(0.0)
    assert machine.on_data(b"Done\n", 1.0) == b"flushCfg\n"
    with pytest.raises(SensorError, match=r'did not acknowledge "flushCfg"'):
        machine.on_tick(1.0 + ANSWER_WITHIN_S)


def test_starting_may_take_longer() -> None:
    machine = sender()
    machine.start(0.0)
    for _ in range(3):
        machine.on_data(b"Done\n", 0.0)
    machine.on_tick(START_WITHIN_S - 0.1)
    assert machine.on_data(b"Debug: Init Calibration Status = 0x7fe\nDone\n", 5.0) == b""
    assert machine.done
    machine.on_tick(1000.0)


def test_garbage_is_a_wrong_baud_rate() -> None:
    machine = sender()
    machine.start(0.0)
    machine.on_data(bytes([0x80, 0xFE, 0x00, 0xF3] * 20), 0.1)
    with pytest.raises(SensorError, match="no text") as caught:
        machine.on_tick(ANSWER_WITHIN_S)
    assert "baud" in caught.value.advice


def test_endless_babble_ends() -> None:
    machine = sender()
    machine.start(0.0)
    machine.on_data(b"x" * 8000, 0.1)
    with pytest.raises(SensorError, match="no text"):
        machine.on_data(b"x" * 8000, 0.1)
