"""The mission protocol as PX4 speaks it, for all its lists one after the other: a machine without sockets or clock.

It asks with MISSION_REQUEST_INT, again every quarter of a second, and gives up after five. What it holds is read in
order only: another request ends the reading. While it takes or gives a list it clears none.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire
from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot
from telemetry.simulation.simulator.protocol.item_protocol import ItemInt, Reply, Target, as_float, as_int
from telemetry.simulation.simulator.protocol.px4.px4_items import FenceItems, MissionItems, RallyItems, back

REQUEST_AGAIN_S, GIVE_UP_S = 0.25, 5.0
ERROR, NO_SPACE = wire.MAV_MISSION_ERROR, wire.MAV_MISSION_NO_SPACE
ALL = 255
ADDRESSED = (0, wire.MAV_COMP_ID_AUTOPILOT1, wire.MAV_COMP_ID_MISSIONPLANNER)
"""Components as whose missions it takes what is sent to it."""
Items = MissionItems | FenceItems | RallyItems


@dataclass(slots=True)
class _Taking:
    peer: Hashable
    target: Target
    items: Items
    count: int
    heard_s: float
    asked_s: float
    arrived: list[ItemInt] = field(default_factory=list[ItemInt])


@dataclass(slots=True)
class _Giving:
    peer: Hashable
    target: Target
    items: Items
    heard_s: float
    next_seq: int = 0


class Px4Missions:
    def __init__(self, pilot: Px4Pilot) -> None:
        self._pilot = pilot
        lists: tuple[Items, ...] = (MissionItems(pilot), FenceItems(pilot), RallyItems())
        self._lists: dict[int, Items] = {items.mission_type: items for items in lists}
        self._busy: _Taking | _Giving | None = None
        self._last_taken = -1
        """Number behind that of the last item of the last upload."""

    def on_message(self, message: Any, peer: Hashable, now_s: float) -> list[Reply]:
        target = (message.get_srcSystem(), message.get_srcComponent())
        kind = message.get_type()
        if message.target_component not in ADDRESSED:
            return []
        if kind in ("MISSION_ITEM_INT", "MISSION_ITEM"):
            return [(peer, answer) for answer in self._on_item(as_int(message), target, now_s)]
        if kind in ("MISSION_REQUEST_INT", "MISSION_REQUEST"):
            return [(peer, answer) for answer in self._on_request(message, target, now_s)]
        if kind == "MISSION_ACK":
            self._on_ack(message, target)
            return []
        if kind == "MISSION_CLEAR_ALL":
            return [(peer, answer) for answer in self._on_clear(message, target)]
        items = self._lists.get(message.mission_type)
        if items is None:
            return [(peer, _ack(target, wire.MAV_MISSION_UNSUPPORTED, message.mission_type))]
        if kind == "MISSION_COUNT":
            return [(peer, answer) for answer in self._on_count(message, items, target, peer, now_s)]
        if kind == "MISSION_REQUEST_LIST" and not isinstance(self._busy, _Taking):
            self._busy = _Giving(peer, target, items, now_s)
            return [(peer, wire.MAVLink_mission_count_message(*target, len(items.kept), items.mission_type))]
        return []

    def on_tick(self, now_s: float) -> list[Reply]:
        busy = self._busy
        if busy is not None and now_s - busy.heard_s > GIVE_UP_S:
            self._busy = busy = None
        if not isinstance(busy, _Taking) or now_s - busy.asked_s < REQUEST_AGAIN_S:
            return []
        return [(busy.peer, self._ask(busy, now_s))]

    def _on_count(
        self, message: Any, items: Items, target: Target, peer: Hashable, now_s: float
    ) -> list[MAVLink_message]:
        busy = self._busy
        if isinstance(busy, _Taking) and (busy.arrived or busy.target != target):
            return []
        if message.count > items.capacity:
            return [_ack(target, NO_SPACE, items.mission_type)]
        if message.count == 0:
            return [self._clear(items.mission_type, target)]
        self._busy = taking = _Taking(peer, target, items, message.count, now_s, now_s)
        return [self._ask(taking, now_s)]

    def _on_item(self, item: ItemInt, target: Target, now_s: float) -> list[MAVLink_message]:
        busy = self._busy
        if busy is None:  # the last one once more: its answer was lost
            return [_ack(target, 0 if item.seq + 1 == self._last_taken else ERROR, item.mission_type)]
        if isinstance(busy, _Giving) or busy.items.mission_type != item.mission_type:
            return [_ack(target, ERROR, item.mission_type)]
        if busy.target != target or item.seq != len(busy.arrived):
            return []
        busy.heard_s = now_s
        if refusal := busy.items.refusal(item):
            self._busy = None
            return [_ack(target, refusal, item.mission_type)]
        busy.arrived.append(item)
        self._last_taken = len(busy.arrived)
        if len(busy.arrived) < busy.count:
            return [self._ask(busy, now_s)]
        self._busy = None
        return [_ack(target, busy.items.replace(busy.arrived), item.mission_type)]

    def _on_request(self, message: Any, target: Target, now_s: float) -> list[MAVLink_message]:
        busy = self._busy
        if not isinstance(busy, _Giving) or busy.target != target or busy.items.mission_type != message.mission_type:
            return []
        busy.heard_s, seq = now_s, message.seq
        if seq not in (busy.next_seq, busy.next_seq - 1) or not 0 <= seq < len(busy.items.kept):
            self._busy = None
            return [_ack(target, ERROR, message.mission_type)]
        busy.next_seq = seq + 1
        is_current = busy.items.mission_type == 0 and seq == self._pilot.mission.current
        item = back(busy.items.kept[seq], target, seq, current=is_current)
        return [as_float(item) if message.get_type() == "MISSION_REQUEST" else item]

    def _on_ack(self, message: Any, target: Target) -> None:
        """Ends the giving of a list whatever it says, the taking of one if it cancels."""
        busy = self._busy
        if busy is None or (busy.target, busy.items.mission_type) != (target, message.mission_type):
            return
        if isinstance(busy, _Giving) or message.type == wire.MAV_MISSION_OPERATION_CANCELLED:
            self._busy = None

    def _on_clear(self, message: Any, target: Target) -> list[MAVLink_message]:
        if self._busy is not None:
            self._pilot.say(2, "WPM: IGN CLEAR_ALL: Busy")
            return []
        return [self._clear(message.mission_type, target)]

    def _clear(self, mission_type: int, target: Target) -> MAVLink_message:
        for number, items in self._lists.items():
            if mission_type in (number, ALL):
                items.replace([])
        return _ack(target, 0, mission_type)

    def _ask(self, busy: _Taking, now_s: float) -> MAVLink_message:
        busy.asked_s = now_s
        return wire.MAVLink_mission_request_int_message(*busy.target, len(busy.arrived), busy.items.mission_type)


def _ack(target: Target, result: int, mission_type: int) -> MAVLink_message:
    return wire.MAVLink_mission_ack_message(*target, result, mission_type)
