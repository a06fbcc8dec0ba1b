"""What a FILE_TRANSFER_PROTOCOL message carries, as it lies on the wire, and what a vehicle's refusals mean."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message

_HEADER = struct.Struct("<HBBBBBxI")
"""Number, session, opcode, size, opcode that is answered, whether a burst is over, offset."""
MOST_DATA = 239
PAYLOAD_BYTES = _HEADER.size + MOST_DATA
NUMBERS = 1 << 16


class Opcode(IntEnum):
    TERMINATE_SESSION = 1
    RESET_SESSIONS = 2
    LIST_DIRECTORY = 3
    OPEN_TO_READ = 4
    READ_FILE = 5
    BURST_READ_FILE = 15
    ACK = 128
    NAK = 129


class Nak(IntEnum):
    FAIL = 1
    INVALID_DATA_SIZE = 3
    INVALID_SESSION = 4
    NO_SESSIONS_AVAILABLE = 5
    END_OF_FILE = 6
    UNKNOWN_COMMAND = 7
    FILE_NOT_FOUND = 10


_WORDS = {
    1: "it failed",
    2: "its file system failed",
    3: "the request's size is wrong",
    4: "the session is not open",
    5: "it has no session free",
    6: "the file ends before",
    7: "it does not know the command",
    8: "the file exists",
    9: "the file is protected",
    10: "there is no such file",
}


@dataclass(frozen=True, slots=True)
class FtpPayload:
    seq: int
    opcode: int
    session: int = 0
    offset: int = 0
    size: int = 0
    """Of the data; in a request to read, how much is wanted."""
    data: bytes = b""
    answers: int = 0
    """The opcode that is answered."""
    is_burst_over: bool = False

    def message(self, target: tuple[int, int]) -> Message:
        head = (self.seq, self.session, self.opcode, self.size, self.answers, self.is_burst_over, self.offset)
        content = (_HEADER.pack(*head) + self.data).ljust(PAYLOAD_BYTES, b"\0")
        return mavlink.MAVLink_file_transfer_protocol_message(0, *target, list(content))

    @property
    def refusal(self) -> str:
        code = self.data[0] if self.data else 0
        return _WORDS.get(code, f"error {code}")

    def is_refusal(self, *codes: Nak) -> bool:
        """For one of these reasons."""
        return self.opcode == Opcode.NAK and bool(self.data) and self.data[0] in codes


def read_payload(message: Message) -> FtpPayload | None:
    """None: it says that it carries more than it can."""
    content = bytes(message.payload)
    seq, session, opcode, size, answers, is_burst_over, offset = _HEADER.unpack_from(content)
    if size > MOST_DATA:
        return None
    data = content[_HEADER.size : _HEADER.size + size]
    return FtpPayload(seq, opcode, session, offset, size, data, answers, bool(is_burst_over))
