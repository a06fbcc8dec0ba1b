"""Vehicles that serve parameters as ArduPilot and PX4 do, on the test's clock."""

from __future__ import annotations

import math
import struct
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

KEPT_REQUESTS = 20
"""ArduPilot drops what comes above."""
LAYOUTS = {1: "<B3x", 2: "<b3x", 3: "<H2x", 4: "<h2x", 5: "<I", 6: "<i"}


class ArduPilotParameters:
    """Streams its list, queues few requests, answers names and changes without a number, rounds whole numbers."""

    per_tick = 100

    def __init__(self, table: dict[str, tuple[float, int]]) -> None:
        """Value and MAV_PARAM_TYPE by name."""
        self.table = dict(table)
        self._listing: int | None = None
        self._requests: list[Any] = []
        self.dropped = 0

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        kind = message.get_type()
        if kind == "PARAM_REQUEST_LIST":
            self._listing = 0
        elif kind == "PARAM_REQUEST_READ":
            if len(self._requests) >= KEPT_REQUESTS:
                self.dropped += 1
            else:
                self._requests.append(message)
        elif kind == "PARAM_SET":
            return self.on_set(message)
        return []

    def on_set(self, message: Any) -> list[Any]:
        name = message.param_id
        if name not in self.table or not math.isfinite(message.param_value):
            return []
        kind = self.table[name][1]
        value = float(round(message.param_value)) if kind < 9 else message.param_value
        self.table[name] = (value, kind)
        return [self.value(name, 65535)]

    def on_tick(self, now_s: float) -> list[Any]:
        answers = [answer for request in self._requests for answer in self._read(request)]
        self._requests.clear()
        if self._listing is not None:
            begin, end = self._listing, self._listing + self.per_tick
            names = list(self.table)
            answers += [self.value(name, begin + at) for at, name in enumerate(names[begin:end])]
            self._listing = end if end < len(names) else None
        return answers

    def _read(self, request: Any) -> list[Any]:
        names = list(self.table)
        if request.param_index >= 0:
            index = request.param_index
            return [self.value(names[index], index)] if index < len(names) else []
        return [self.value(request.param_id, 65535)] if request.param_id in self.table else []

    def value(self, name: str, index: int) -> Any:
        value, kind = self.table[name]
        return mavlink.MAVLink_param_value_message(
            name.encode(), self.encode(value, kind), kind, len(self.table), index
        )

    def encode(self, value: float, kind: int) -> float:
        return value


class Px4Parameters(ArduPilotParameters):
    """Integers bytewise, a hash before the list, PARAM_ERROR for what it does not have, echoes with the number."""

    per_tick = 20

    def on_message(self, message: Any, now_s: float) -> list[Any]:
        answers = super().on_message(message, now_s)
        if message.get_type() == "PARAM_REQUEST_LIST":
            answers.append(mavlink.MAVLink_param_value_message(b"_HASH_CHECK", 1.5, 5, len(self.table), 65535))
        name = getattr(message, "param_id", "")
        if name and name not in self.table:
            answers.append(mavlink.MAVLink_param_error_message(255, 190, name.encode(), -1, 1))
        return answers

    def on_set(self, message: Any) -> list[Any]:
        name = message.param_id
        if name not in self.table:
            return []
        kind = self.table[name][1]
        value = message.param_value
        if kind in LAYOUTS:
            value = float(struct.unpack(LAYOUTS[kind], struct.pack("<f", value))[0])
        self.table[name] = (value, kind)
        return [self.value(name, list(self.table).index(name))]

    def encode(self, value: float, kind: int) -> float:
        layout = LAYOUTS.get(kind)
        return value if layout is None else struct.unpack("<f", struct.pack(layout, int(value)))[0]


def table(count: int) -> dict[str, tuple[float, int]]:
    """Whole numbers of all sizes and fractions, by turns."""
    kinds = (1, 2, 3, 4, 5, 6, 9, 9)
    values = (200.0, -3.0, 60_000.0, -300.0, 3_000_000_000.0, -1.0, 0.1, 1500.0)
    return {f"P{number:04}": (values[number % 8], kinds[number % 8]) for number in range(count)}


def ardupilot_table(count: int) -> dict[str, tuple[float, int]]:
    """What ArduPilot's floats carry unchanged."""
    return {name: (value if abs(value) < 2**24 else 70_000.0, kind) for name, (value, kind) in table(count).items()}
