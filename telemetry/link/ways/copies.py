"""What comes over several ways is used once: answers and words, counted by what they say.

Sequence numbers cannot tell: radios and autopilots number each way anew. So of everything that says the same, each
way's first is the first, its second the second; the n-th is new on the way that brings it first. A vehicle that really
says the same thing twice is heard twice.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from telemetry.mavlink.actions import Message

ANSWERS = frozenset(
    {
        "COMMAND_ACK",
        "FILE_TRANSFER_PROTOCOL",
        "LOG_DATA",
        "LOG_ENTRY",
        "MISSION_ACK",
        "MISSION_COUNT",
        "MISSION_ITEM",
        "MISSION_ITEM_INT",
        "MISSION_REQUEST",
        "MISSION_REQUEST_INT",
        "PARAM_VALUE",
        "STATUSTEXT",
    }
)
"""Taken from every way that holds nothing back; what tells the vehicle's state from the one in use alone."""
KEEP_S = 10.0
"""A slow way brings its copy later than this at worst as an answer to something that is over."""
MOST = 2048

Content = tuple[int, int, int, bytes]
"""System, component, message, payload."""


@dataclass(slots=True)
class _Counted:
    since_s: float
    used: int = 0
    by_way: dict[str, int] = field(default_factory=dict)


class Copies:
    def __init__(self) -> None:
        self._counted: OrderedDict[Content, _Counted] = OrderedDict()

    def is_new(self, address: str, message: Message, now_s: float) -> bool:
        """Also counts it."""
        self._forget(now_s)
        counted = self._counted.setdefault(_content(message), _Counted(now_s))
        nth = counted.by_way[address] = counted.by_way.get(address, 0) + 1
        if nth <= counted.used:
            return False
        counted.used = nth
        return True

    def _forget(self, now_s: float) -> None:
        while self._counted:
            oldest = next(iter(self._counted.values()))
            if now_s - oldest.since_s <= KEEP_S and len(self._counted) < MOST:
                return
            self._counted.popitem(last=False)


def _content(message: Message) -> Content:
    # MAVLink 2 leaves out zeros at the end, MAVLink 1 does not: two ways may speak one each.
    frame = bytes(message.get_msgbuf())
    begin = 6 if frame[0] == mavlink.PROTOCOL_MARKER_V1 else 10
    payload = frame[begin : begin + frame[1]].rstrip(b"\0")
    return message.get_srcSystem(), message.get_srcComponent(), message.get_msgId(), payload
