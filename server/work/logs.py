"""Log lines: one per event, whatever a name from outside contains."""

from __future__ import annotations

import contextlib
import logging
import os
import shutil
import stat
import sys
from collections import OrderedDict
from typing import TextIO

MOST_BYTES = 20 * 1024**2
"""Of a log that somebody keeps in a file; as much again of what was before."""


class OneLineFormatter(logging.Formatter):
    """Escapes control characters, so that no client can forge a line or drive the terminal."""

    def format(self, record: logging.LogRecord) -> str:
        return one_line(super().format(record))


class Repeats(logging.Filter):
    """What is said again and again is counted instead: whoever floods us does not fill the disk with our own words."""

    def __init__(self, *, most: int = 20, within_s: float = 60.0) -> None:
        super().__init__()
        self._most, self._within_s = most, within_s
        self._said: OrderedDict[tuple[str, str], list[float]] = OrderedDict()
        """Of each sentence: since when it is counted, and how often it came since."""

    def filter(self, record: logging.LogRecord) -> bool:
        if record.levelno < logging.WARNING:
            return True
        key = record.name, str(record.msg)[:200]
        counted = self._said.get(key)
        if counted is None or record.created - counted[0] >= self._within_s or record.created < counted[0]:
            unsaid = 0 if counted is None else max(0, int(counted[1]) - self._most)
            self._said[key] = [record.created, 1.0]
            self._said.move_to_end(key)
            if len(self._said) > 500:
                self._said.popitem(last=False)
            if unsaid:
                record.msg, record.args = f"{record.getMessage()} (And {unsaid} times more before.)", ()
            return True
        counted[1] += 1
        return counted[1] <= self._most


class LimitedStderr(logging.StreamHandler[TextIO]):
    """Standard error. A file that it was led to is begun anew when it is full; what was in it stands in ``NAME.1``."""

    def __init__(self, stream: TextIO, *, most_bytes: int = MOST_BYTES) -> None:
        super().__init__(stream)
        self._most_bytes = most_bytes

    def emit(self, record: logging.LogRecord) -> None:
        super().emit(record)
        with contextlib.suppress(OSError, ValueError):  # a terminal, a pipe, no file at all
            number = self.stream.fileno()
            about = os.fstat(number)
            if stat.S_ISREG(about.st_mode) and about.st_size > self._most_bytes:
                _begin_anew(number)


def _begin_anew(number: int) -> None:
    """Other processes write to the same file: it is emptied, not replaced."""
    with contextlib.suppress(OSError):  # on a full disk, or where the file has no name any more, what was in it goes
        name = os.readlink(f"/proc/self/fd/{number}")
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW | os.O_CLOEXEC
        with open(name, "rb") as old, open(os.open(f"{name}.1", flags, 0o600), "wb") as kept:
            shutil.copyfileobj(old, kept)
    os.ftruncate(number, 0)
    os.lseek(number, 0, os.SEEK_SET)  # else what follows would stand behind a hole as long as the old file


def one_line(text: str) -> str:
    return "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text)


def configure_logging(level: str) -> None:
    handler = LimitedStderr(sys.stderr)
    handler.setFormatter(OneLineFormatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    handler.addFilter(Repeats())
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
    # A refused handshake is told by the guard, which knows why.
    logging.getLogger("websockets").setLevel(logging.CRITICAL)
    logging.getLogger("uvicorn").setLevel(max(logging.getLogger().level, logging.WARNING))
