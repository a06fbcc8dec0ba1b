"""The mission protocol as ArduCopter speaks it, as a machine without sockets or clock."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.autopilot import Autopilot
from telemetry.simulation.simulator.autopilot.mission_steps import Step
from telemetry.simulation.simulator.protocol.kept_items import KeptItem, keep

CAPACITY = 650
REQUEST_AGAIN_S = 1.0
GIVE_UP_S = 8.0
Target = tuple[int, int]
"""System and component of a ground station."""
Reply = tuple[Hashable, MAVLink_message]
"""Where to, and what."""


@dataclass(slots=True)
class _Upload:
    peer: Hashable
    target: Target
    count: int
    next_seq: int
    heard_s: float
    asked_s: float


class MissionProtocol:
    """Takes missions item by item, replacing IN PLACE what was on board: a broken-off upload leaves a mixture.

    ``peer`` names the way a message came and its answer goes. Times are the ground station's: seconds
    of any monotonic clock.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self._kept: list[KeptItem] = []
        self._upload: _Upload | None = None

    @property
    def total(self) -> int:
        """Items without home, as MISSION_CURRENT counts."""
        return max(0, len(self._kept) - 1)

    def on_message(self, message: Any, peer: Hashable, now_s: float) -> list[Reply]:
        target = (message.get_srcSystem(), message.get_srcComponent())
        mission_type = getattr(message, "mission_type", 0)
        if mission_type != 0:
            return [(peer, answer) for answer in self._other_type(message, target, mission_type)]
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
            self._autopilot.say(4, "Mission upload timeout")
            return [(upload.peer, _ack(upload.target, wire.MAV_MISSION_OPERATION_CANCELLED))]
        if now_s - upload.asked_s < REQUEST_AGAIN_S:
            return []
        upload.asked_s = now_s
        return [(upload.peer, self._ask(upload))]

    def _on_count(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        if self._upload and (self._upload.peer, self._upload.target) != (peer, target):
            return [_ack(target, wire.MAV_MISSION_DENIED)]
        self._upload = None
        capacity = CAPACITY if self._autopilot.ready else 0
        if message.count > capacity:
            self._autopilot.say(4, f"Only {capacity} items are supported")
            return [_ack(target, wire.MAV_MISSION_NO_SPACE)]
        self._truncate(message.count)
        if message.count == 0:
            return [_ack(target, wire.MAV_MISSION_ACCEPTED)]
        self._upload = _Upload(peer, target, message.count, 0, now_s, now_s)
        return [self._ask(self._upload)]

    def _on_item(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        upload = self._upload
        if upload is None or (upload.peer, upload.target) != (peer, target):
            return [_ack(target, wire.MAV_MISSION_ERROR)]
        upload.heard_s = now_s
        if message.seq != upload.next_seq:
            return [_ack(target, wire.MAV_MISSION_INVALID_SEQUENCE)]
        kept = keep(_as_int(message))
        if isinstance(kept, int):
            self._upload = None
            return [_ack(target, kept)]
        self._put(upload.next_seq, kept)
        upload.next_seq, upload.asked_s = upload.next_seq + 1, now_s
        if upload.next_seq < upload.count:
            return [self._ask(upload)]
        self._upload = None
        self._autopilot.say(6, "Flight plan received")
        return [_ack(target, wire.MAV_MISSION_ACCEPTED)]

    def _on_list(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        return [wire.MAVLink_mission_count_message(*target, len(self._kept))]

    def _on_request(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        seq, as_float = message.seq, message.get_type() == "MISSION_REQUEST"
        if seq >= len(self._kept) and seq > 0:
            count = wire.MAVLink_mission_count_message(*target, len(self._kept))
            return [count, _ack(target, wire.MAV_MISSION_INVALID_SEQUENCE)]
        item = (self._home() if seq == 0 else self._kept[seq]).message(seq, target)
        return [_as_float(item) if as_float else item]

    def _on_clear(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        if self._autopilot.mode is self._autopilot.auto and self._autopilot.flying:
            return [_ack(target, wire.MAV_MISSION_ERROR)]
        self._upload = None
        self._truncate(0)
        return [_ack(target, wire.MAV_MISSION_ACCEPTED)]

    def _on_partial(self, message: Any, target: Target, peer: Hashable, now_s: float) -> list[MAVLink_message]:
        if message.start_index > message.end_index or message.end_index >= len(self._kept):
            return [_ack(target, wire.MAV_MISSION_ERROR)]
        self._upload = _Upload(peer, target, message.end_index + 1, message.start_index, now_s, now_s)
        return [self._ask(self._upload)]

    def _other_type(self, message: Any, target: Target, mission_type: int) -> list[MAVLink_message]:
        """Fence (1) and rally points (2): there are none, and none are taken."""
        kind = message.get_type()
        if kind == "MISSION_ACK":
            return []
        if mission_type in (1, 2):
            if kind == "MISSION_REQUEST_LIST":
                return [wire.MAVLink_mission_count_message(*target, 0, mission_type)]
            if kind == "MISSION_CLEAR_ALL" or (kind == "MISSION_COUNT" and message.count == 0):
                return [_ack(target, wire.MAV_MISSION_ACCEPTED, mission_type)]
        return [_ack(target, wire.MAV_MISSION_UNSUPPORTED, mission_type)]

    def _ask(self, upload: _Upload) -> MAVLink_message:
        return wire.MAVLink_mission_request_message(*upload.target, upload.next_seq)

    def _put(self, seq: int, kept: KeptItem) -> None:
        step = Step("home") if seq == 0 else kept.step()
        steps = self._autopilot.mission.steps
        if seq < len(self._kept):
            self._kept[seq], steps[seq] = kept, step
        else:
            self._kept.append(kept)
            steps.append(step)
        self._autopilot.parameters.set("MIS_TOTAL", len(self._kept))

    def _truncate(self, count: int) -> None:
        mission = self._autopilot.mission
        del self._kept[count:], mission.steps[count:]
        if mission.current >= max(count, 1):
            mission.restart()
        self._autopilot.parameters.set("MIS_TOTAL", len(self._kept))

    def _home(self) -> KeptItem:
        lat, lon, alt_m = self._autopilot.frame.geodetic_from_neu(self._autopilot.home_neu)
        return KeptItem(16, 0, (0.0, 0.0, 0.0, 0.0), int(lat * 1e7), int(lon * 1e7), int(alt_m * 100))


def _ack(target: Target, result: int, mission_type: int = 0) -> MAVLink_message:
    return wire.MAVLink_mission_ack_message(*target, result, mission_type)


def _as_int(item: Any) -> wire.MAVLink_mission_item_int_message:
    if isinstance(item, wire.MAVLink_mission_item_int_message):
        return item
    fields = {name: getattr(item, name) for name in item.fieldnames}
    fields["x"], fields["y"] = _e7(fields["x"]), _e7(fields["y"])
    return wire.MAVLink_mission_item_int_message(**fields)


def _e7(degrees: float) -> int:
    """Out of every range when it is no angle at all."""
    return round(degrees * 1e7) if abs(degrees) <= 200 else 2_000_000_000


def _as_float(item: wire.MAVLink_mission_item_int_message) -> wire.MAVLink_mission_item_message:
    fields = {name: getattr(item, name) for name in item.fieldnames}
    fields["x"], fields["y"] = item.x / 1e7, item.y / 1e7
    return wire.MAVLink_mission_item_message(**fields)
