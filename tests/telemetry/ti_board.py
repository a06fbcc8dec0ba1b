"""A TI board at two pseudo-terminals: answers on its config port, sends on its data port, and can be unplugged."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from tests.telemetry.pseudo_terminals import PseudoTerminals, plugged_in

Answer = Callable[[bytes], bytes]


def acknowledging(line: bytes) -> bytes:
    return line + b"\r\nDone\r\n\r\nmmwDemo:/>"


class Board(PseudoTerminals):
    """Its ports are ``ttyACM0`` (config) and ``ttyACM1`` (data) in a folder of the test's."""

    def __init__(self, folder: Path, answer: Answer = acknowledging) -> None:
        self.config, self.data = folder / "ttyACM0", folder / "ttyACM1"
        super().__init__(self.config, self.data)
        self.answer = answer
        self.lines: list[bytes] = []

    def answered(self, heard: bytes) -> tuple[list[bytes], bytes]:
        """The command line: whole lines in, answers out."""
        *lines, rest = heard.split(b"\n")
        self.lines += lines
        return [self.answer(line) for line in lines], rest


def plugged(folder: Path, answer: Answer = acknowledging) -> AbstractContextManager[Board]:
    return plugged_in(Board(folder, answer))
