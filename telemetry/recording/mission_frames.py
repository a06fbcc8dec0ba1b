"""Missions out of recorded mission frames, sent to the vehicle or read back from it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from planning.basics.mav_cmd import MavCmd
from planning.basics.plan_model import Firmware, Home, Mission, MissionItem
from planning.formats.commands import POSITIONED, home_or_first_place, plain_frame

_MISSION, _ACCEPTED = 0, 0
_GUIDED_CURRENT = (2, 3)
"""MISSION_ITEM.current of "go there now" and "change altitude": no part of a mission."""
_LOCAL_FRAMES = (1, 4, 7, 8, 9, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21)


@dataclass(slots=True)
class ItemSet:
    """The items of one transfer. ``by_vehicle``: read back from the vehicle."""

    by_vehicle: bool
    count: int
    t_utc_s: float
    items: dict[int, MissionItem] = field(default_factory=dict)

    @property
    def complete(self) -> bool:
        return 0 < self.count == len(self.items)


class MissionFrames:
    """Follows MISSION_COUNT, MISSION_ITEM(_INT) and MISSION_ACK in both directions."""

    def __init__(self, vehicle: tuple[int, int]) -> None:
        self._vehicle = vehicle
        self._open: dict[tuple[int, int], ItemSet] = {}
        self.finished: list[ItemSet] = []

    def on_message(self, message: Any, t_utc_s: float) -> None:
        if getattr(message, "mission_type", _MISSION) != _MISSION:
            return
        source, kind = (message.get_srcSystem(), message.get_srcComponent()), message.get_type()
        if source != self._vehicle and getattr(message, "target_system", 0) not in (0, self._vehicle[0]):
            return
        if kind == "MISSION_COUNT":
            self._open[source] = ItemSet(source == self._vehicle, message.count, t_utc_s)
        elif kind in ("MISSION_ITEM_INT", "MISSION_ITEM") and source in self._open:
            self._add(self._open[source], message, t_utc_s)
        elif kind == "MISSION_ACK" and source == self._vehicle and message.type != _ACCEPTED:
            self._refused(t_utc_s)

    def _add(self, transfer: ItemSet, message: Any, t_utc_s: float) -> None:
        if message.current in _GUIDED_CURRENT or message.seq >= transfer.count:
            return
        was_complete = transfer.complete
        transfer.items[message.seq] = item_of(message)
        transfer.t_utc_s = t_utc_s
        if transfer.complete and not was_complete:
            self.finished.append(transfer)

    def _refused(self, t_utc_s: float) -> None:
        """An upload that the vehicle did not take, though all of it was sent, is not what it flies."""
        if self.finished and not self.finished[-1].by_vehicle and t_utc_s - self.finished[-1].t_utc_s < 10.0:
            self.finished.pop()

    def newest(self, before_utc_s: float = math.inf) -> ItemSet | None:
        """The last whole mission that was there before a time; the first one when all came later."""
        earlier = [transfer for transfer in self.finished if transfer.t_utc_s <= before_utc_s]
        return earlier[-1] if earlier else next(iter(self.finished), None)


def item_of(message: Any) -> MissionItem:
    """A MISSION_ITEM or MISSION_ITEM_INT, its frame without the obsolete spelling."""
    x, y, frame = float(message.x), float(message.y), plain_frame(message.frame)
    if message.get_type() == "MISSION_ITEM_INT" and message.command in POSITIONED:
        scale = 1e4 if message.frame in _LOCAL_FRAMES else 1e7
        x, y = x / scale, y / scale
    params = (message.param1, message.param2, message.param3, message.param4)
    return MissionItem(message.command, frame, params, x, y, float(message.z), bool(message.autocontinue))


def mission_of(transfer: ItemSet, firmware: Firmware, home: Home | None) -> Mission:
    """The transfer as a mission. ArduPilot's row 0 is its home; elsewhere ``home`` is what the vehicle reported."""
    items, warnings = [transfer.items[number] for number in range(transfer.count)], list[str]()
    if firmware == "ardupilot" and items[0].command == MavCmd.NAV_WAYPOINT:
        row = items.pop(0)
        if row.lat_deg or row.lon_deg:
            home = Home(row.lat_deg, row.lon_deg, row.alt_m)
    return Mission(home_or_first_place(home, items, warnings), tuple(items), firmware, warnings=tuple(warnings))
