"""Reading a stretch of one file, sans-IO: a burst brings most of it, what was lost is read piece by piece."""

from __future__ import annotations

from typing import Literal

from telemetry.errors import RefusedError, SilentError, TelemetryError, TransferError
from telemetry.mavlink.actions import Action, Done, Failed, Message
from telemetry.mavlink.logs.ftp.payload import MOST_DATA, FtpPayload, Nak, Opcode
from telemetry.mavlink.logs.ftp.questions import SILENT_S, Numbers, Questions, as_path, is_newer
from telemetry.mavlink.logs.on_the_ground import armed_meanwhile
from telemetry.topics.vehicle import VehicleState

LONGEST_S = 150.0
WINDOW = 4
"""Pieces that are asked for at once; ArduPilot keeps five requests."""
CLOSINGS = 4
"""A session that stays open nevertheless is closed by the next that finds none free."""


class FtpRead:
    """Ends in Done(bytes): of ``size`` bytes from ``offset`` on what the file has, as its size was at opening."""

    def __init__(self, path: str, offset: int, size: int, *, target: tuple[int, int], numbers: Numbers) -> None:
        self._path, self._encoded = path, as_path(path)
        self._offset, self._size = offset, size
        self._questions = Questions(target, numbers)
        self._phase: Literal["open", "reset", "burst", "pieces", "close", "over"] = "open"
        self._session, self._opened_seq = 0, 0
        self._is_open = self._has_reset = False
        self._content = self._has = bytearray()
        """``_has``: 1 for each byte that has come."""
        self._furthest = 0
        self._pieces: dict[int, float] = {}
        """Where each begins that was asked for, and when."""
        self._asked_again: set[int] = set()
        self._started_s = self._heard_s = self._came_s = self._asked_s = 0.0

    def start(self, now_s: float) -> list[Action]:
        self._started_s = self._came_s = now_s
        return self._open(now_s)

    def _open(self, now_s: float) -> list[Action]:
        self._phase = "open"
        return self._questions.ask(now_s, Opcode.OPEN_TO_READ, data=self._encoded)

    def on_message(self, message: Message, now_s: float) -> list[Action]:
        heard = None if self._phase == "over" else self._questions.hear(message)
        if heard is None:
            return []
        if self._questions.is_answer(heard, now_s):
            return self._on_answer(heard, now_s)
        is_of_this = heard.session == self._session and is_newer(heard.seq, self._opened_seq)
        if self._phase not in ("burst", "pieces") or not is_of_this:
            return []
        if heard.answers not in (Opcode.READ_FILE, Opcode.BURST_READ_FILE):
            return []
        self._heard_s = now_s
        self._questions.follow(heard.seq)
        return self._on_refusal(heard, now_s) if heard.opcode == Opcode.NAK else self._on_data(heard, now_s)

    def _on_answer(self, heard: FtpPayload, now_s: float) -> list[Action]:
        self._came_s = now_s
        if self._phase == "close":
            return self._end(Done(bytes(self._content)))
        if self._phase == "reset":
            return self._open(now_s)
        if heard.is_refusal(Nak.NO_SESSIONS_AVAILABLE) and not self._has_reset:
            # One that nobody closes any more, most likely: its closing was lost. PX4 has one only.
            self._phase, self._has_reset = "reset", True
            return self._questions.ask(now_s, Opcode.RESET_SESSIONS)
        if heard.opcode == Opcode.NAK:
            what = f"The vehicle does not open {self._path}: {heard.refusal}."
            return self._fail(RefusedError(what, advice="Ask for the list again: it may be gone."))
        self._session, self._opened_seq, self._is_open = heard.session, heard.seq, True
        if len(heard.data) < 4:
            what = f"The vehicle does not say how large {self._path} is."
            return self._fail(TransferError(what, advice="Read it another way."))
        size = self._size_to_read(int.from_bytes(heard.data[:4], "little"))
        self._content, self._has = bytearray(size), bytearray(size)
        return self._burst(now_s) if size else self._close(now_s)

    def _size_to_read(self, said: int) -> int:
        """Of a file that is so large, as the vehicle says."""
        return max(0, min(self._size, said - self._offset))

    def _on_refusal(self, heard: FtpPayload, now_s: float) -> list[Action]:
        if heard.answers == Opcode.BURST_READ_FILE:
            # Where the file ends, or from a vehicle without bursts.
            return self._read_pieces(now_s) if self._phase == "burst" else []
        what = f"The vehicle does not read {self._path}: {heard.refusal}."
        return self._fail(RefusedError(what, advice="Ask for the list again: it may be another file by now."))

    def _on_data(self, heard: FtpPayload, now_s: float) -> list[Action]:
        begin = heard.offset - self._offset
        data = heard.data[: max(0, len(self._content) - begin)] if begin >= 0 else b""
        if data:
            self._keep(begin, data, now_s)
        if 0 not in self._has:
            return self._close(now_s)
        if self._phase == "pieces":
            return self._read_pieces(now_s)
        return self._go_on(now_s) if heard.is_burst_over or self._furthest >= len(self._content) else []

    def _keep(self, begin: int, data: bytes, now_s: float) -> None:
        end = begin + len(data)
        asked_s = self._pieces.pop(begin, None)
        if asked_s is not None and begin not in self._asked_again:
            self._questions.round_trip.measure(now_s - asked_s)
        if 0 in self._has[begin:end]:
            self._came_s = now_s
        self._content[begin:end], self._has[begin:end] = data, b"\1" * len(data)
        self._furthest = max(end, self._furthest)

    def _go_on(self, now_s: float) -> list[Action]:
        """After a burst: another one where it ended, or what was lost of it."""
        return self._burst(now_s) if self._furthest < len(self._content) else self._read_pieces(now_s)

    def _burst(self, now_s: float) -> list[Action]:
        self._phase, self._asked_s = "burst", now_s
        where = self._offset + self._furthest
        return [self._questions.send(Opcode.BURST_READ_FILE, session=self._session, offset=where, size=MOST_DATA)]

    def _read_pieces(self, now_s: float) -> list[Action]:
        self._phase = "pieces"
        out: list[Action] = []
        at = 0
        while len(self._pieces) < WINDOW and (begin := self._has.find(0, at)) >= 0:
            end = self._has.find(1, begin)
            at = min(begin + MOST_DATA, end if end >= 0 else len(self._has))
            if begin not in self._pieces:
                self._pieces[begin] = now_s
                out.append(self._ask_piece(begin, at - begin))
        return out

    def _ask_piece(self, begin: int, size: int) -> Action:
        where = self._offset + begin
        return self._questions.send(Opcode.READ_FILE, session=self._session, offset=where, size=size)

    def on_state(self, state: VehicleState, now_s: float) -> list[Action]:
        return [] if self._phase == "over" or not state.armed else self._fail(armed_meanwhile())

    def on_tick(self, now_s: float) -> list[Action]:
        if self._phase == "over":
            return []
        if self._phase == "close" and self._questions.repeated >= CLOSINGS:
            return self._end(Done(bytes(self._content)))
        if now_s - self._came_s > SILENT_S or now_s - self._started_s > LONGEST_S:
            return self._fail(self._gap())
        if self._phase == "burst":
            is_quiet = now_s - max(self._heard_s, self._asked_s) >= self._questions.round_trip.patience_s
            return self._go_on(now_s) if is_quiet else []
        return self._ask_pieces_again(now_s) if self._phase == "pieces" else self._questions.on_tick(now_s)

    def _ask_pieces_again(self, now_s: float) -> list[Action]:
        patience_s = self._questions.round_trip.patience_s
        late = [begin for begin, asked_s in self._pieces.items() if now_s - asked_s >= patience_s]
        for begin in late:
            del self._pieces[begin]
        self._asked_again.update(late)
        return self._read_pieces(now_s) if late else []

    def cancel(self) -> list[Action]:
        error = TransferError("Reading the file was ended: a mission is being transferred.", advice="Read it later.")
        return [] if self._phase == "over" else self._fail(error)

    def _gap(self) -> SilentError:
        missing = self._has.count(0)
        what = f"{missing} bytes of {self._path} did not come." if missing else f"Nothing of {self._path} comes."
        return SilentError(what, advice="Check the link, then read it again.")

    def _close(self, now_s: float) -> list[Action]:
        self._phase = "close"
        return self._questions.ask(now_s, Opcode.TERMINATE_SESSION, session=self._session)

    def _fail(self, error: TelemetryError) -> list[Action]:
        closing = self._questions.send(Opcode.TERMINATE_SESSION, session=self._session)
        return [*([closing] if self._is_open else []), *self._end(Failed(error))]

    def _end(self, end: Done | Failed) -> list[Action]:
        self._phase = "over"
        return [end]
