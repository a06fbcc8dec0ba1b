"""Reading a file to its end, sans-IO, where the size that is said at opening is an estimate only.

ArduPilot makes such files while they are read, and allows one size of read on each.
"""

from __future__ import annotations

from telemetry.errors import TransferError
from telemetry.mavlink.actions import Action
from telemetry.mavlink.logs.ftp.payload import MOST_DATA, FtpPayload, Nak, Opcode
from telemetry.mavlink.logs.ftp.questions import Numbers
from telemetry.mavlink.logs.ftp.reading import FtpRead


class FtpReadWhole(FtpRead):
    """Ends in Done(bytes). A file that is larger than ``most_bytes`` fails."""

    def __init__(self, path: str, *, most_bytes: int, target: tuple[int, int], numbers: Numbers) -> None:
        blocks = most_bytes // MOST_DATA + 1
        super().__init__(path, 0, blocks * MOST_DATA, target=target, numbers=numbers)
        self._most_bytes, self._has_end = most_bytes, False

    def _size_to_read(self, said: int) -> int:
        del said
        return self._size

    def _on_data(self, heard: FtpPayload, now_s: float) -> list[Action]:
        """A block that is not full is the last one."""
        if heard.offset % MOST_DATA:
            return []
        if len(heard.data) < MOST_DATA:
            self._cut(heard.offset + len(heard.data))
        return super()._on_data(heard, now_s)

    def _on_refusal(self, heard: FtpPayload, now_s: float) -> list[Action]:
        """There is nothing from the offset on that was asked for; a burst's may be that of its beginning."""
        if heard.answers == Opcode.READ_FILE and heard.is_refusal(Nak.END_OF_FILE):
            self._cut(heard.offset)
            return self._read_pieces(now_s) if 0 in self._has else self._close(now_s)
        return super()._on_refusal(heard, now_s)

    def _close(self, now_s: float) -> list[Action]:
        if self._has_end:
            return super()._close(now_s)
        what = f"{self._path} is larger than {self._most_bytes} bytes."
        return self._fail(TransferError(what, advice="Read it another way."))

    def _cut(self, end: int) -> None:
        self._has_end = True
        del self._content[end:], self._has[end:]
        self._pieces = {begin: asked_s for begin, asked_s in self._pieces.items() if begin < end}
        self._furthest = min(self._furthest, end)
