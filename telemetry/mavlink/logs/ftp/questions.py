"""Questions of MAVLink FTP, one at a time, repeated until they are answered; sans-IO."""

from __future__ import annotations

from telemetry.errors import NotAllowedError
from telemetry.mavlink.actions import Action, Message, Send
from telemetry.mavlink.conversation import Endpoints, RoundTrip
from telemetry.mavlink.logs.ftp.payload import MOST_DATA, NUMBERS, FtpPayload, Opcode, read_payload

SILENT_S = 8.0
"""A vehicle may have to look for a file on its card first."""


class Numbers:
    """Of the messages to one vehicle, from one machine to the next: what is late of an earlier one is known by it."""

    def __init__(self) -> None:
        self._newest = 0

    def take(self) -> int:
        self._newest = (self._newest + 1) % NUMBERS
        return self._newest

    @property
    def newest(self) -> int:
        return self._newest

    def hear(self, seq: int) -> None:
        """The vehicle counts on."""
        if is_newer(seq, self._newest):
            self._newest = seq


def is_newer(seq: int, than: int) -> bool:
    return 0 < (seq - than) % NUMBERS < NUMBERS // 2


def as_path(path: str) -> bytes:
    """Raises NotAllowedError for one that no vehicle can be asked for."""
    encoded = path.encode()
    if not 0 < len(encoded) < MOST_DATA or "\0" in path or ".." in path.split("/"):
        what = f'"{path[:80]}" is no path of a file on a vehicle.'
        raise NotAllowedError(what, advice=f'Give one of 1 to {MOST_DATA - 1} bytes without "..".')
    return encoded


class Questions:
    def __init__(self, target: tuple[int, int], numbers: Numbers) -> None:
        self._endpoints, self._numbers = Endpoints(target), numbers
        self.round_trip = RoundTrip(unknown_s=0.5, shortest_s=0.2, longest_s=1.0)
        self._open: FtpPayload | None = None
        self._asked_s = 0.0
        self.repeated = 0

    def send(self, opcode: Opcode, *, session: int = 0, offset: int = 0, size: int = 0, data: bytes = b"") -> Send:
        """Without waiting for an answer."""
        return Send(self._payload(opcode, session, offset, size, data).message(self._endpoints.vehicle))

    @property
    def awaited_seq(self) -> int:
        """Of the answer to what was sent just now."""
        return (self._numbers.newest + 1) % NUMBERS

    def ask(
        self, now_s: float, opcode: Opcode, *, session: int = 0, offset: int = 0, data: bytes = b""
    ) -> list[Action]:
        self._open, self._asked_s, self.repeated = self._payload(opcode, session, offset, len(data), data), now_s, 0
        return [Send(self._open.message(self._endpoints.vehicle))]

    def hear(self, message: Message) -> FtpPayload | None:
        """What the vehicle says to us."""
        if message.get_type() != "FILE_TRANSFER_PROTOCOL" or not self._endpoints.is_for_us(message):
            return None
        heard = read_payload(message)
        if heard is None or heard.opcode not in (Opcode.ACK, Opcode.NAK):
            return None
        return heard

    def is_answer(self, heard: FtpPayload, now_s: float) -> bool:
        """To the open question, which is settled then."""
        asked = self._open
        if asked is None or heard.answers != asked.opcode or heard.seq != (asked.seq + 1) % NUMBERS:
            return False
        if not self.repeated:
            self.round_trip.measure(now_s - self._asked_s)
        self._open = None
        self._numbers.hear(heard.seq)
        return True

    def follow(self, seq: int) -> None:
        """A burst's messages count on by themselves."""
        self._numbers.hear(seq)

    def on_tick(self, now_s: float) -> list[Action]:
        """The question again, under its old number: the vehicle then repeats its answer."""
        if self._open is None or now_s - self._asked_s < self.round_trip.patience_s:
            return []
        self._asked_s = now_s
        self.repeated += 1
        self.round_trip.repeats()
        return [Send(self._open.message(self._endpoints.vehicle))]

    def _payload(self, opcode: Opcode, session: int, offset: int, size: int, data: bytes) -> FtpPayload:
        return FtpPayload(self._numbers.take(), opcode, session, offset, size, data)
