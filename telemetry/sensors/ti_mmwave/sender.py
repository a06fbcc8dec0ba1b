"""Sends a configuration to the radar's command line, sans-IO: a line, then its answer, then the next one."""

from __future__ import annotations

import re

from telemetry.errors import SensorError
from telemetry.sensors.ti_mmwave.cfg_commands import Command

ANSWER_WITHIN_S, START_WITHIN_S = 3.0, 10.0
"""``sensorStart`` calibrates first."""
LONGEST_ANSWER_BYTES = 8192
_PROMPT = re.compile(rb"^\w+:/>")
_UNKNOWN = b"is not recognized"


class ConfigSender:
    """``start``, then ``on_data`` with what the radar says and ``on_tick`` while it is silent, until ``done``.

    Each returns what is to be written next. All raise SensorError that names the line which the radar refused.
    """

    def __init__(self, commands: tuple[Command, ...]) -> None:
        self._commands = commands
        self._index = 0
        self._heard = bytearray()
        self._said = ""
        self._deadline_s = 0.0

    @property
    def done(self) -> bool:
        return self._index >= len(self._commands)

    @property
    def command(self) -> Command:
        """The one whose answer is awaited."""
        return self._commands[self._index]

    def start(self, now_s: float) -> bytes:
        return self._send(now_s)

    def on_data(self, data: bytes, now_s: float) -> bytes:
        self._heard += data
        while not self.done and b"\n" in self._heard:
            line, _, rest = bytes(self._heard).partition(b"\n")
            self._heard = bytearray(rest)
            if self._is_acknowledged(_PROMPT.sub(b"", line.strip()).strip()):
                # What follows an answer is the prompt; the next answer follows the next line.
                self._index += 1
                return b"" if self.done else self._send(now_s)
        if len(self._heard) > LONGEST_ANSWER_BYTES:
            raise self._garbled()
        return b""

    def on_tick(self, now_s: float) -> None:
        if self.done or now_s < self._deadline_s:
            return
        if self._heard and not _is_text(self._heard):
            raise self._garbled()
        if self._index == 0:
            raise SensorError(
                "The radar does not answer on its config port.",
                where=self._where(),
                advice="Check its power, its baud rate, and that this is its config port and not its data port.",
            )
        raise SensorError(
            f'The radar did not acknowledge "{self.command.text}".',
            where=self._where(),
            advice="Switch the radar off and on, then try again.",
        )

    def _send(self, now_s: float) -> bytes:
        within_s = START_WITHIN_S if self.command.name == "sensorStart" else ANSWER_WITHIN_S
        self._deadline_s = now_s + within_s
        self._heard.clear()
        self._said = ""
        return self.command.text.encode() + b"\n"

    def _is_acknowledged(self, line: bytes) -> bool:
        """Raises SensorError when the radar refuses. Its other words are kept: they say why."""
        if line == b"Done":
            return True
        if line.startswith(b"Error") or _UNKNOWN in line:
            words = _shown(line) if not self._said else f"{self._said} {_shown(line)}"
            raise SensorError(
                f'The radar refused "{self.command.text}": {words}.',
                where=self._where(),
                advice="Correct this line, or use a configuration made for the radar's firmware.",
            )
        if line and line != self.command.text.encode():
            self._said = _shown(line)
        return False

    def _garbled(self) -> SensorError:
        return SensorError(
            "What comes from the config port is no text.",
            where=self._where(),
            advice="Its baud rate is wrong (115200 is usual), or this is the radar's data port.",
        )

    def _where(self) -> str:
        return f"{self.command.file}, line {self.command.line}"


def _is_text(data: bytes | bytearray) -> bool:
    strange = sum(byte > 126 or (byte < 32 and byte not in b"\r\n\t\b\x1b") for byte in data)
    return strange <= len(data) // 10


def _shown(line: bytes) -> str:
    text = line[:120].decode("ascii", "replace")
    return "".join(c if c.isprintable() else "?" for c in text).strip(" .")
