"""Vehicles that speak the mission protocol: as ArduCopter was recorded to do, and as PX4 does. Written for tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from tests.telemetry.lossy import STATION

ACCEPTED, ERROR, NO_SPACE, INVALID_SEQUENCE, DENIED, CANCELLED = 0, 1, 4, 13, 14, 15
PLACED = {16, 17, 18, 19, 21, 22, 82, 195, 201}
KEPT = {20: (), 178: (1, 2, 3), 206: (1, 3)}
"""Numbers of the parameters that ArduCopter has room for in some commands without a place."""
PLAIN_FRAMES: dict[Any, int] = {5: 0, 6: 3, 11: 10}
HOME = (-37.1244507, 175.6892878, 803.24)


def sender(message: Any) -> tuple[int, int]:
    return message.get_srcSystem(), message.get_srcComponent()


def ack(to: tuple[int, int], result: int) -> Any:
    return mavlink.MAVLink_mission_ack_message(*to, result, 0)


def text(words: str) -> Any:
    return mavlink.MAVLink_statustext_message(4, words.encode())


def row(to: tuple[int, int], seq: int, frame: int, command: int, *rest: Any) -> Any:
    """``rest``: autocontinue, four parameters, x, y, z."""
    autocontinue, p1, p2, p3, p4, x, y, z = rest
    return mavlink.MAVLink_mission_item_int_message(*to, seq, frame, command, 0, autocontinue, p1, p2, p3, p4, x, y, z)


class ArduCopter:
    """Requests without _INT, again once per second; gives up after 8 s; replaces items in place."""

    capacity = 650

    def __init__(self) -> None:
        self.stored: list[Any] = [self._home()]
        self.receiving = False
        self.owner = STATION
        self.next = self.last = 0
        self.received_s = self.requested_s = 0.0
        self.completed = 0

    def _home(self) -> Any:
        lat, lon, alt = HOME
        return row((0, 0), 0, 0, 16, 1, 0, 0, 0, 0, round(lat * 1e7), round(lon * 1e7), alt)

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        handler = getattr(self, f"_on_{message.get_type().lower()}", None)
        return [] if handler is None else handler(message, now_s)

    def on_tick(self, now_s: float) -> list[Any]:
        if not self.receiving:
            return []
        if now_s - self.received_s > 8.0:
            self.receiving = False
            return [ack(self.owner, CANCELLED), text("Mission upload timeout")]
        return self._request(now_s) if now_s - self.requested_s > 1.0 else []

    def _request(self, now_s: float) -> list[Any]:
        self.requested_s = now_s
        return [mavlink.MAVLink_mission_request_message(*self.owner, self.next, 0)]

    def _on_mission_count(self, message: Any, now_s: float) -> list[Any]:
        if self.receiving and sender(message) != self.owner:
            return [ack(sender(message), DENIED)]
        if message.count > self.capacity:
            return [ack(sender(message), NO_SPACE), text(f"Only {self.capacity} items are supported")]
        del self.stored[max(message.count, 1) :]
        self.receiving, self.owner, self.next, self.last = True, sender(message), 0, message.count - 1
        self.received_s = now_s
        return self._request(now_s)

    def _on_mission_item_int(self, message: Any, now_s: float) -> list[Any]:
        if not self.receiving:
            return [ack(sender(message), ERROR)]
        if message.seq != self.next:
            return [ack(sender(message), INVALID_SEQUENCE)]
        result = self.check(message)
        if result != ACCEPTED:
            self.receiving = False
            return [ack(sender(message), result)]
        kept = self._home() if message.seq == 0 else self.keep(message)
        self.stored[message.seq : message.seq + 1] = [kept]
        self.received_s, self.next = now_s, self.next + 1
        if self.next <= self.last:
            return self._request(now_s)
        self.receiving, self.completed = False, self.completed + 1
        return [ack(sender(message), ACCEPTED), text("Flight plan received")]

    def check(self, item: Any) -> int:
        if item.command in PLACED and item.frame not in (0, 3, 5, 6, 10, 11):
            return 2
        if item.command >= 5000:
            return 3
        params = (item.param1, item.param2, item.param3)
        bad = next((k for k, value in enumerate(params, start=6) if not np.isfinite(value)), None)
        if bad is not None:
            return bad
        if item.command in PLACED:
            if abs(item.x) > 900_000_000:
                return 10
            if abs(item.y) > 1_800_000_000:
                return 11
            if not np.isfinite(item.z):
                return 12
        return ACCEPTED

    def keep(self, item: Any) -> Any:
        """As its storage has room for it."""
        p1, p2, p3, p4 = (0.0 if np.isnan(v) else v for v in (item.param1, item.param2, item.param3, item.param4))
        kept = KEPT.get(item.command, (1, 2, 3, 4))
        p1, p2, p3, p4 = (value if k in kept else 0.0 for k, value in enumerate((p1, p2, p3, p4), start=1))
        frame: Any = 0
        z = float(item.z)
        if item.command in PLACED:
            frame = PLAIN_FRAMES.get(item.frame, item.frame)
            z = float(np.float32(np.trunc(np.float32(item.z) * np.float32(100)) / np.float32(100)))
            p2 = p3 = p4 = 0.0
            p1 = float(int(p1)) if item.command in (16, 19, 82) else 0.0
            if item.command == 19:
                p3 = -1.0 if item.param3 < 0 else 1.0
        return row((0, 0), item.seq, frame, item.command, 1, p1, p2, p3, p4, item.x, item.y, z)

    def _on_mission_request_list(self, message: Any, now_s: float) -> list[Any]:
        if self.receiving:
            return [ack(sender(message), DENIED)]
        return [mavlink.MAVLink_mission_count_message(*sender(message), len(self.stored), 0)]

    def _on_mission_request_int(self, message: Any, now_s: float) -> list[Any]:
        if self.receiving:
            return [ack(sender(message), DENIED)]
        if message.seq >= len(self.stored):
            return [ack(sender(message), INVALID_SEQUENCE)]
        return [copy_to(sender(message), message.seq, self.stored[message.seq])]


def copy_to(to: tuple[int, int], seq: int, item: Any) -> Any:
    params = (item.param1, item.param2, item.param3, item.param4)
    return row(to, seq, item.frame, item.command, item.autocontinue, *params, item.x, item.y, item.z)


class Px4:
    """Requests with _INT, again every 250 ms; gives up after 5 s; a new mission replaces the old one when complete.

    What it holds is read in order only: an unexpected request ends the reading.
    """

    capacity = 500

    def __init__(self) -> None:
        self.stored: list[Any] = []
        self.arriving: list[Any] = []
        self.state = "idle"
        self.partner = STATION
        self.count = self.expected = 0
        self.heard_s = self.requested_s = 0.0
        self.completed = 0

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        handler = getattr(self, f"_on_{message.get_type().lower()}", None)
        return [] if handler is None else handler(message, now_s)

    def on_tick(self, now_s: float) -> list[Any]:
        if self.state != "idle" and now_s - self.heard_s > 5.0:
            self.state = "idle"
        if self.state == "receiving" and now_s - self.requested_s >= 0.25:
            return self._request(now_s)
        return []

    def _request(self, now_s: float) -> list[Any]:
        self.requested_s = now_s
        return [mavlink.MAVLink_mission_request_int_message(*self.partner, len(self.arriving), 0)]

    def _on_mission_count(self, message: Any, now_s: float) -> list[Any]:
        if self.state == "receiving" and (self.arriving or sender(message) != self.partner):
            return []
        if message.count > self.capacity:
            return [ack(sender(message), NO_SPACE)]
        if message.count == 0:
            self.stored, self.state = [], "idle"
            return [ack(sender(message), ACCEPTED)]
        self.state, self.partner, self.count, self.arriving = "receiving", sender(message), message.count, []
        self.heard_s, self.expected = now_s, 0
        return self._request(now_s)

    def _on_mission_item_int(self, message: Any, now_s: float) -> list[Any]:
        if self.state == "idle":  # the last item once more, it assumes, also where it had given up before the end
            return [ack(sender(message), ACCEPTED if message.seq + 1 == self.expected else ERROR)]
        if self.state == "sending":
            return [ack(sender(message), ERROR)]
        if message.seq != len(self.arriving):
            return []
        self.heard_s = now_s
        self.arriving.append(message)
        self.expected = len(self.arriving)
        if len(self.arriving) < self.count:
            return self._request(now_s)
        self.stored, self.state, self.completed = self.arriving, "idle", self.completed + 1
        return [ack(sender(message), ACCEPTED)]

    def _on_mission_request_list(self, message: Any, now_s: float) -> list[Any]:
        if self.state == "receiving":
            return []
        self.state, self.partner, self.expected, self.heard_s = "sending", sender(message), 0, now_s
        return [mavlink.MAVLink_mission_count_message(*sender(message), len(self.stored), 0)]

    def _on_mission_request_int(self, message: Any, now_s: float) -> list[Any]:
        if self.state != "sending":
            return []
        self.heard_s = now_s
        if message.seq not in (self.expected, self.expected - 1) or message.seq >= len(self.stored):
            self.state = "idle"
            return [ack(sender(message), ERROR)]
        self.expected = message.seq + 1
        return [copy_to(sender(message), message.seq, self.stored[message.seq])]

    def _on_mission_ack(self, message: Any, now_s: float) -> list[Any]:
        if self.state == "sending":
            self.state = "idle"
        return []
