"""The vehicle's files for ground stations, by MAVLink FTP: its logs, and what it makes when it is read.

Nothing is written.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

from telemetry.mavlink.logs.ftp.payload import MOST_DATA, NUMBERS, FtpPayload, Nak, Opcode, read_payload
from telemetry.simulation.simulator.own_logs.keeping import OwnLogs
from telemetry.simulation.simulator.protocol.item_protocol import Reply
from telemetry.simulation.simulator.protocol.made_files import MadeFile

EVERY_S, BLOCKS = 0.02, 20
BURST = 100
"""Messages of one burst; then the station asks for the next."""


@dataclass(slots=True)
class _Burst:
    seq: int
    offset: int
    size: int
    """Of each message."""
    left: int = BURST


@dataclass(slots=True)
class _Session:
    peer: Hashable
    to: tuple[int, int]
    content: bytes
    burst: _Burst | None = None


class FileProtocol:
    def __init__(
        self, own: OwnLogs, *, most_sessions: int, made: Callable[[str], MadeFile | None] = lambda _: None
    ) -> None:
        """``made``: files that are made when they are opened, by their paths."""
        self._own, self._most_sessions, self._made = own, most_sessions, made
        self._sessions: dict[tuple[Hashable, int], _Session] = {}
        """By station and the number that it opened the file with."""
        self._last: dict[Hashable, tuple[FtpPayload, FtpPayload]] = {}
        """The last question of each peer and its answer, which may have been lost."""
        self._sent_s = 0.0

    def on_message(self, message: Any, peer: Hashable) -> list[Reply]:
        asked = read_payload(message)
        if asked is None:
            return []
        to = (message.get_srcSystem(), message.get_srcComponent())
        last = self._last.get(peer)
        if last is not None and last[0] == asked:
            return [(peer, last[1].message(to))]
        answer = self._answer(asked, peer, to)
        if answer is None:
            return []
        self._last[peer] = (asked, answer)
        return [(peer, answer.message(to))]

    def on_tick(self, wall_s: float) -> list[Reply]:
        """The next messages of the bursts that were asked for."""
        if wall_s - self._sent_s < EVERY_S:
            return []
        self._sent_s = wall_s
        out: list[Reply] = []
        for (_, number), session in self._sessions.items():
            for _ in range(BLOCKS):
                if session.burst is not None:
                    out.append((session.peer, self._next_of_burst(number, session, session.burst).message(session.to)))
        return out

    def forget(self, peer: Hashable) -> None:
        self._sessions = {key: session for key, session in self._sessions.items() if key[0] != peer}
        self._last.pop(peer, None)

    def _answer(self, asked: FtpPayload, peer: Hashable, to: tuple[int, int]) -> FtpPayload | None:
        """None: a burst begins."""
        match asked.opcode:
            case Opcode.LIST_DIRECTORY:
                return self._list(asked)
            case Opcode.OPEN_TO_READ:
                return self._open(asked, peer, to)
            case Opcode.RESET_SESSIONS:
                self._sessions.clear()
                return _ack(asked)
            case Opcode.TERMINATE_SESSION | Opcode.READ_FILE | Opcode.BURST_READ_FILE:
                session = self._sessions.get((peer, asked.session))
                return self._of_session(asked, peer, session) if session else _nak(asked, Nak.INVALID_SESSION)
            case _:
                return _nak(asked, Nak.UNKNOWN_COMMAND)

    def _of_session(self, asked: FtpPayload, peer: Hashable, session: _Session) -> FtpPayload | None:
        if asked.opcode == Opcode.TERMINATE_SESSION:
            del self._sessions[peer, asked.session]
            return _ack(asked)
        size = min(asked.size or MOST_DATA, MOST_DATA)
        if asked.opcode == Opcode.BURST_READ_FILE:
            session.burst = _Burst((asked.seq + 1) % NUMBERS, asked.offset, size)
            return None
        data = session.content[asked.offset : asked.offset + size]
        return _ack(asked, data) if data else _nak(asked, Nak.END_OF_FILE)

    def _next_of_burst(self, number: int, session: _Session, burst: _Burst) -> FtpPayload:
        data = session.content[burst.offset : burst.offset + burst.size]
        answers = Opcode.BURST_READ_FILE
        if not data:
            session.burst = None
            end = bytes((Nak.END_OF_FILE,))
            return FtpPayload(burst.seq, Opcode.NAK, number, burst.offset, 1, end, answers)
        burst.left -= 1
        out = FtpPayload(burst.seq, Opcode.ACK, number, burst.offset, len(data), data, answers, not burst.left)
        burst.seq, burst.offset = (burst.seq + 1) % NUMBERS, burst.offset + len(data)
        if not burst.left:
            session.burst = None
        return out

    def _open(self, asked: FtpPayload, peer: Hashable, to: tuple[int, int]) -> FtpPayload:
        file = self._file(_path(asked))
        if file is None:
            return _nak(asked, Nak.FILE_NOT_FOUND)
        if (peer, asked.session) in self._sessions or len(self._sessions) >= self._most_sessions:
            return _nak(asked, Nak.NO_SESSIONS_AVAILABLE)
        self._sessions[peer, asked.session] = _Session(peer, to, file.content)
        return _ack(asked, file.said_bytes.to_bytes(4, "little"))

    def _file(self, path: str) -> MadeFile | None:
        log = self._own.files.get(path)
        return self._made(path) if log is None else MadeFile(bytes(log), len(log))

    def _list(self, asked: FtpPayload) -> FtpPayload:
        entries = self._entries(_path(asked))
        if entries is None:
            return _nak(asked, Nak.FILE_NOT_FOUND)
        data = b""
        for entry in entries[asked.offset :]:
            if len(data) + len(entry) > MOST_DATA:
                break
            data += entry
        return _ack(asked, data) if data else _nak(asked, Nak.END_OF_FILE)

    def _entries(self, folder: str) -> list[bytes] | None:
        """None: there is no such folder."""
        above, found = f"{folder.rstrip('/')}/", dict[str, bytes]()
        for path, content in self._own.files.items():
            if path.startswith(above):
                name, _, below = path.removeprefix(above).partition("/")
                found[name] = f"D{name}\0".encode() if below else f"F{name}\t{len(content)}\0".encode()
        root = f"{self._own.writer.folder}/"
        if not found and root.startswith(above) and root != above:
            name = root.removeprefix(above).partition("/")[0]
            found[name] = f"D{name}\0".encode()
        return list(found.values()) if found or root == above else None


def _path(asked: FtpPayload) -> str:
    path = asked.data.split(b"\0")[0].decode(errors="replace")
    return "/" + path.strip("/")


def _ack(asked: FtpPayload, data: bytes = b"") -> FtpPayload:
    seq = (asked.seq + 1) % NUMBERS
    return FtpPayload(seq, Opcode.ACK, asked.session, asked.offset, len(data), data, asked.opcode)


def _nak(asked: FtpPayload, why: Nak) -> FtpPayload:
    """Its offset is 0 whatever was asked for, as ArduPilot's is."""
    seq = (asked.seq + 1) % NUMBERS
    return FtpPayload(seq, Opcode.NAK, asked.session, 0, 1, bytes((why,)), asked.opcode)
