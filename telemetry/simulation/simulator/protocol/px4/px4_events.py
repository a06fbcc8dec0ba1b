"""The simulated PX4's events: what it says by texts it says by these as well, and by these alone what keeps it
from arming."""

from __future__ import annotations

import re
import struct
from collections import deque
from typing import Any

from pymavlink.dialects.v20.ardupilotmega import MAVLink_message

from telemetry.mavlink.texts.event_messages import (
    ARGUMENT_BYTES,
    RESET,
    CurrentEventSequence,
    EventMessage,
    ResponseEventError,
)
from telemetry.mavlink.texts.event_words import ARMING_SUMMARY, HEALTH_SUMMARY, MODES, REASONS, event_id
from telemetry.simulation.simulator.autopilot.pilot import Text
from telemetry.simulation.simulator.autopilot.px4.px4_autopilot import Px4Pilot

KEPT = 32
SEQUENCE_S = 3.0
"""How often it says which is the newest."""
NUMBERS = 1 << 16
CRITICAL, ERROR, INFO, PROTOCOL = 2, 3, 6, 8
ALL_MODES = 0xFFFFFFFF
FLOWN = 1 << 3 | 1 << 4 | 1 << 5 | 1 << 17 | 1 << 18
"""Modes that want a global position: Mission, Hold, Return, Take-off, Land."""
MISSION = 1 << 3
GLOBAL_POSITION, SYSTEM = 24, 20
CHECKS: dict[str, tuple[int, int, int]] = {
    "check_modes_global_pos": (ERROR, FLOWN, GLOBAL_POSITION),
    "check_modes_mission": (INFO, MISSION, SYSTEM),
    "check_modes_cannot_takeoff": (INFO, ALL_MODES, SYSTEM),
}
"""Log level, modes that it keeps from, and what it is about."""
_MODE_NUMBERS = {name.casefold(): number for number, name in MODES.items()} | {"rtl": 5}
_REASON_NUMBERS = {name: number for number, name in REASONS.items()}


class Px4Events:
    """Numbered and kept for those who ask again."""

    def __init__(self, pilot: Px4Pilot) -> None:
        self._pilot = pilot
        self._kept: deque[Any] = deque(maxlen=KEPT)
        self._next, self._told_s = 0, 0.0
        self._reported: tuple[str, ...] | None = None
        self._asked = 0
        """How often the checks had been asked for when they were last reported."""

    def on_text(self, text: Text) -> list[MAVLink_message]:
        made = _event_of(text.text)
        return [] if made is None else [self._event(made[0], text.severity, made[1])]

    def on_request(self, message: Any) -> list[MAVLink_message]:
        """Each event that is kept, and one error for those that are not any more."""
        kept = {event.sequence: event for event in self._kept}
        count = min((message.last_sequence - message.first_sequence) % NUMBERS + 1, KEPT)
        wanted = [(message.first_sequence + k) % NUMBERS for k in range(count)]
        replies: list[MAVLink_message] = [kept[number] for number in wanted if number in kept]
        gone = [number for number in wanted if number not in kept]
        if gone:
            oldest = self._kept[0].sequence if self._kept else self._next
            sender = message.get_srcSystem(), message.get_srcComponent()
            replies.insert(0, ResponseEventError(*sender, gone[0], oldest, 0))
        return replies

    def on_slice(self) -> list[MAVLink_message]:
        """A report when what keeps from arming is another or was asked for; from time to time the newest number."""
        out: list[MAVLink_message] = []
        failing = self._pilot.failing_checks
        if (failing, self._pilot.checks_asked) != (self._reported, self._asked):
            self._reported, self._asked = failing, self._pilot.checks_asked
            out += self._report(failing)
        if self._pilot.now_s - self._told_s >= SEQUENCE_S:
            self._told_s = self._pilot.now_s
            newest = (self._next - 1) % NUMBERS
            out.append(CurrentEventSequence(newest, 0 if self._kept else RESET))
        return out

    def _report(self, failing: tuple[str, ...]) -> list[MAVLink_message]:
        errors = barred = 0
        checks: list[tuple[str, int, bytes]] = []
        for name in failing:
            level, modes, about = CHECKS[name]
            errors, barred = errors | 1 << about, barred | modes
            checks.append((name, level, struct.pack("<IB", modes, about)))
        summary = struct.pack("<BQQI", 0, errors, 0, ALL_MODES & ~barred)
        first = self._event(ARMING_SUMMARY, PROTOCOL, summary)
        reasons = [self._event(event_id(name), level, arguments) for name, level, arguments in checks]
        return [first, *reasons, self._event(HEALTH_SUMMARY, PROTOCOL, struct.pack("<BQQQ", 0, 0, 0, 0))]

    def _event(self, number: int, level: int, arguments: bytes) -> MAVLink_message:
        filled = arguments.ljust(ARGUMENT_BYTES, b"\0")
        t_boot_ms = int(self._pilot.now_s * 1000)
        event = EventMessage(0, 0, number, t_boot_ms, self._next, level << 4 | level, filled)
        self._next = (self._next + 1) % NUMBERS
        self._kept.append(event)
        return event


def _event_of(text: str) -> tuple[int, bytes] | None:
    """Number and arguments of the event that says the same; None: it is said by text alone."""
    plain = {
        "Takeoff detected": "commander_takeoff_detected",
        "Landing detected": "commander_landing_detected",
        "Disarming denied: not landed": "commander_disarm_denied_not_landed",
    }
    if text in plain:
        return event_id(plain[text]), b""
    if (found := re.fullmatch(r"(Armed|Disarmed) by (.+)", text)) and found[2] in _REASON_NUMBERS:
        return event_id(f"commander_{found[1].lower()}_by"), bytes([_REASON_NUMBERS[found[2]]])
    found = re.fullmatch(r"Switching to (.+) is currently not available", text)
    if found and (number := _MODE_NUMBERS.get(found[1].casefold())) is not None:
        return event_id("commander_modeswitch_not_avail"), struct.pack("<IB", 0, number)
    return None
