"""The mission protocol as ArduCopter speaks it for each of its lists, as a machine without sockets or clock."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any, Protocol

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

REQUEST_AGAIN_S = 1.0
GIVE_UP_S = 8.0
Target = tuple[int, int]
"""System and component of a ground station."""
Reply = tuple[Hashable, MAVLink_message]
"""Where to, and what."""
ItemInt = wire.MAVLink_mission_item_int_message


class ItemStore(Protocol):
    """What the vehicle keeps of one list; results are MAV_MISSION_RESULTs, 0 is well."""

    mission_type: int
    received: str
    """Said when a list has come."""
    in_parts: bool
    """A part of it may be replaced."""

    @property
    def capacity(self) -> int: ...
    @property
    def count(self) -> int: ...
    def begin(self, count: int) -> None:
        """A list of so many items is coming; 0 clears."""
        ...

    def put(self, seq: int, item: ItemInt) -> int: ...
    def finish(self) -> int:
        """All have come."""
        ...

    def message(self, seq: int, target: Target) -> ItemInt | None:
        """None: there is no such item."""
        ...

    def may_clear(self) -> bool: ...


@dataclass(slots=True)
class _Upload:
    peer: Hashable
    target: Target
    count: int
    next_seq: int
    heard_s: float
    asked_s: float


class ItemProtocol:
    """Takes the items of one list one by one, and gives them back in any order."""

    def __init__(self, store: ItemStore, say: Callable[[int, str], None]) -> None:
        self._store, self._say = store, say
        self._upload: _Upload | None = None

    def on_message(self, message: Any, peer: Hashable, now_s: float) -> list[Reply]:
        target = (message.get_srcSystem(), message.get_srcComponent())
        handler = {
            "MISSION_COUNT": self._on_count,
            "MISSION_ITEM_INT": self._on_item,
            "MISSION_ITEM": self._on_item,
            "MISSION_REQUEST_LIST": self._on_list,
            "MISSION_REQUEST": self._on_request,
            "MISSION_REQUEST_INT": self._on_request,
            "MISSION_CLEAR_ALL": self._on_clear,
            "MISSION_WRITE_PARTIAL_LIST": self._on_partial,
        }.get(message.get_type())
        return [(peer, answer) for answer in handler(message, target, peer, now_s)] if handler else []

    def on_tick(self, now_s: float) -> list[Reply]:
        upload = self._upload
        if upload is None:
            return []
        if now_s - upload.heard_s >= GIVE_UP_S:
            self._upload = None
            self._say(4, "Mission upload timeout")
            return [(upload.peer, self._ack(upload.target, wire.MAV_MISSION_OPERATION_CANCELLED))]
        if now_s - upload.asked_s < REQUEST_AGAIN_S:
            return []
        upload.asked_s = now_s
        return [(upload.peer, self._ask(upload))]

    def _on_count(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        if self._upload and (self._upload.peer, self._upload.target) != (peer, target):
            return [self._ack(target, wire.MAV_MISSION_DENIED)]
        self._upload = None
        if message.count > self._store.capacity:
            self._say(4, f"Only {self._store.capacity} items are supported")
            return [self._ack(target, wire.MAV_MISSION_NO_SPACE)]
        self._store.begin(message.count)
        if message.count == 0:
            return [self._ack(target, wire.MAV_MISSION_ACCEPTED)]
        self._upload = _Upload(peer, target, message.count, 0, now_s, now_s)
        return [self._ask(self._upload)]

    def _on_item(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        upload = self._upload
        if upload is None or (upload.peer, upload.target) != (peer, target):
            return [self._ack(target, wire.MAV_MISSION_ERROR)]
        upload.heard_s = now_s
        if message.seq != upload.next_seq:
            return [self._ack(target, wire.MAV_MISSION_INVALID_SEQUENCE)]
        if refusal := self._store.put(upload.next_seq, as_int(message)):
            self._upload = None
            return [self._ack(target, refusal)]
        upload.next_seq, upload.asked_s = upload.next_seq + 1, now_s
        if upload.next_seq < upload.count:
            return [self._ask(upload)]
        self._upload = None
        result = self._store.finish()
        if result == wire.MAV_MISSION_ACCEPTED:
            self._say(6, self._store.received)
        return [self._ack(target, result)]

    def _on_list(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        return [self._count(target)]

    def _on_request(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        item = self._store.message(message.seq, target)
        if item is None:
            return [self._count(target), self._ack(target, wire.MAV_MISSION_INVALID_SEQUENCE)]
        return [as_float(item) if message.get_type() == "MISSION_REQUEST" else item]

    def _on_clear(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        if self._upload or not self._store.may_clear():
            return [self._ack(target, wire.MAV_MISSION_ERROR)]
        self._store.begin(0)
        return [self._ack(target, wire.MAV_MISSION_ACCEPTED)]

    def _on_partial(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        last = self._store.count - 1 if self._store.in_parts else -1
        if message.start_index > message.end_index or message.end_index > last:
            return [self._ack(target, wire.MAV_MISSION_ERROR)]
        self._upload = _Upload(peer, target, message.end_index + 1, message.start_index, now_s, now_s)
        return [self._ask(self._upload)]

    def _ask(self, upload: _Upload) -> MAVLink_message:
        return wire.MAVLink_mission_request_message(*upload.target, upload.next_seq, self._store.mission_type)

    def _count(self, target: Target) -> MAVLink_message:
        return wire.MAVLink_mission_count_message(*target, self._store.count, self._store.mission_type)

    def _ack(self, target: Target, result: int) -> MAVLink_message:
        return wire.MAVLink_mission_ack_message(*target, result, self._store.mission_type)


def as_int(item: Any) -> ItemInt:
    if isinstance(item, ItemInt):
        return item
    fields = {name: getattr(item, name) for name in item.fieldnames}
    fields["x"], fields["y"] = _e7(fields["x"]), _e7(fields["y"])
    return ItemInt(**fields)


def _e7(degrees: float) -> int:
    """Out of every range when it is no angle at all."""
    return round(degrees * 1e7) if abs(degrees) <= 200 else 2_000_000_000


def as_float(item: ItemInt) -> wire.MAVLink_mission_item_message:
    fields = {name: getattr(item, name) for name in item.fieldnames}
    fields["x"], fields["y"] = item.x / 1e7, item.y / 1e7
    return wire.MAVLink_mission_item_message(**fields)
