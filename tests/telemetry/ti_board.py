"""A TI board at two pseudo-terminals: answers on its config port, sends on its data port, and can be unplugged."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from tests.telemetry.pseudo_terminals import PseudoTerminals, plugged_in

Answer = Callable[[bytes], bytes]


def acknowledging(line: bytes) -> bytes:
    return line + b"\r\nDone\r\n\r\nmmwDemo:/>"


class Board:
    """Its ports are ``ttyACM0`` (config) and ``ttyACM1`` (data) in a folder of the test's."""

    def __init__(self, folder: Path, answer: Answer = acknowledging) -> None:
        self.config, self.data = folder / "ttyACM0", folder / "ttyACM1"
        self.answer = answer
        self.lines: list[bytes] = []
        self._masters: list[int] = []
        self._thread: threading.Thread | None = None
        self._stop_read = -1

    def plug(self) -> None:
        """New pseudo-terminals under the same names, as USB does it."""
        for link in (self.config, self.data):
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
        for link in (self.config, self.data):
            link.unlink()
        for master in self._masters:
            os.close(master)
        self._masters.clear()

    def send(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._masters[1], data) :]

    def _serve(self, master: int, stop_read: int) -> None:
        """The command line: whole lines in, answers out."""
        heard = b""
        try:
            while True:
                ready, _, _ = select.select([master, stop_read], [], [])
                if stop_read in ready:
                    return
                try:
                    heard += os.read(master, 4096)
                except OSError:  # nobody has the port open
                    threading.Event().wait(0.01)
                    continue
                *lines, heard = heard.split(b"\n")
                for line in lines:
                    self.lines.append(line)
                    os.write(master, self.answer(line))
        finally:
            os.close(stop_read)


@contextmanager
def plugged(folder: Path, answer: Answer = acknowledging) -> Iterator[Board]:
    board = Board(folder, answer)
    board.plug()
    try:
        yield board
    finally:
        board.unplug()
