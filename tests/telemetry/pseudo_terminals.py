"""A simulated board's ports: pseudo-terminals under names of their own, which can be unplugged and plugged in again."""

from __future__ import annotations

import os
import pty
import select
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar


class PseudoTerminals:
    """The first port answers what it hears."""

    def __init__(self, *links: Path) -> None:
        self._links = links
        self._masters: list[int] = []
        self._thread: threading.Thread | None = None

    def answered(self, heard: bytes) -> tuple[list[bytes], bytes]:
        """The answers to the whole requests that were heard, and what is left of it."""
        raise NotImplementedError

    def plug(self) -> None:
        """New pseudo-terminals under the same names, as USB does it."""
        for link in self._links:
            master, slave = pty.openpty()
            tty.setraw(slave)
            link.symlink_to(os.ttyname(slave))
            os.close(slave)
            self._masters.append(master)
        stop_read, self._stop_write = os.pipe()
        self._thread = threading.Thread(target=self._serve, args=(self._masters[0], stop_read))
        self._thread.start()

    def unplug(self) -> None:
        if self._thread is None:
            return
        os.close(self._stop_write)
        self._thread.join()
        self._thread = None
        for link in self._links:
            link.unlink()
        for master in self._masters:
            os.close(master)
        self._masters.clear()

    def send(self, data: bytes) -> None:
        """On the last port."""
        while data:
            data = data[os.write(self._masters[-1], data) :]

    def _serve(self, master: int, stop_read: int) -> None:
        heard = b""
        try:
            while True:
                ready, _, _ = select.select([master, stop_read], [], [])
                if stop_read in ready:
                    return
                try:
                    heard += os.read(master, 4096)
                except OSError:  # nobody has the port open
                    heard = b""
                    threading.Event().wait(0.01)
                    continue
                answers, heard = self.answered(heard)
                for answer in answers:
                    _write(master, stop_read, answer)
        finally:
            os.close(stop_read)


def _write(master: int, stop_read: int, data: bytes) -> None:
    while data:
        readable, writable, _ = select.select([stop_read], [master], [])
        if readable:
            return
        if writable:
            data = data[os.write(master, data) :]


Board = TypeVar("Board", bound=PseudoTerminals)


@contextmanager
def plugged_in(board: Board) -> Iterator[Board]:
    board.plug()
    try:
        yield board
    finally:
        board.unplug()
