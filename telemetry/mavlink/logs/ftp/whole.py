"""Reading a file to its end, sans-IO, where the size that is said at opening is an estimate only.

ArduPilot makes such files while they are read, and allows one size of read on each. A block may be shorter than asked
for anywhere: where the file ends is known when a read there is refused.
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
        self._begins: dict[int, int] = {}
        """Of the pieces that were asked for, by the numbers of their answers."""

    def _size_to_read(self, said: int) -> int:
        del said
        return self._size

    def _ask_piece(self, begin: int, size: int) -> Action:
        """Always of the one size, however little is missing there."""
        del size
        asking = super()._ask_piece(begin, MOST_DATA)
        self._begins[self._questions.awaited_seq] = begin
        return asking

    def _on_refusal(self, heard: FtpPayload, now_s: float) -> list[Action]:
        """There is nothing from the offset on that was asked for. ArduPilot does not repeat it, so the number tells
        what is answered; of a burst it does not."""
        if heard.answers != Opcode.READ_FILE or not heard.is_refusal(Nak.END_OF_FILE):
            return super()._on_refusal(heard, now_s)
        begin = self._begins.get(heard.seq)
        if begin is None:
            return []
        self._cut(begin)
        return self._read_pieces(now_s) if 0 in self._has else self._close(now_s)

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
