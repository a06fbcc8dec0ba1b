"""Sees that a person takes over: a flight mode that nobody here asked for, or a stick that is moved."""

from __future__ import annotations

import math

from telemetry.mavlink.actions import Message
from telemetry.topics.vehicle import VehicleState

ASKED_S = 15.0
"""A mode that was asked for longer ago than this and shows only now was chosen by somebody else."""
STICK_US = 100
"""Sticks tremble; a radio's trims move them a little."""
LOWEST_US, HIGHEST_US = 950, 2100
"""A receiver without signal says 0, 65535 or less than any stick gives."""
STICKS = ("chan1_raw", "chan2_raw", "chan3_raw", "chan4_raw")
BY_HAND = ("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE")
UNUSED_AXIS = 32767


class PilotWatch:
    """``words`` say who has taken over, once somebody has; empty until then."""

    def __init__(self) -> None:
        self.words = ""
        self._mode: str | None = None
        self._asked_s: dict[str, float] = {}
        self._sticks_us: tuple[int, ...] | None = None

    def begin(self) -> None:
        """Another flight: sticks are where they are, and the mode is what it is."""
        self.words = ""
        self._mode = self._sticks_us = None

    def asked(self, mode: str, now_s: float) -> None:
        """This ground station has commanded this mode."""
        self._asked_s[mode] = now_s

    def on_state(self, state: VehicleState, now_s: float) -> None:
        before, self._mode = self._mode, state.mode
        if before is None or state.mode == before:
            return
        asked_s = self._asked_s.pop(state.mode, -math.inf)
        if now_s - asked_s <= ASKED_S or self.words:
            return
        if state.critical:
            self.words = f"The vehicle has changed to {state.mode} by itself: a failsafe is active."
        else:
            self.words = f"The flight mode was changed to {state.mode}: the pilot took over."

    def on_message(self, message: Message) -> None:
        kind = message.get_type()
        if kind in BY_HAND and _is_used(message):
            self.words = self.words or "The vehicle is flown by hand: the pilot took over."
        elif kind == "RC_CHANNELS":
            self._on_sticks(tuple(getattr(message, name) for name in STICKS))

    def _on_sticks(self, sticks_us: tuple[int, ...]) -> None:
        if any(not LOWEST_US <= value <= HIGHEST_US for value in sticks_us):
            return
        if self._sticks_us is None:
            self._sticks_us = sticks_us
        elif any(abs(now - then) > STICK_US for now, then in zip(sticks_us, self._sticks_us, strict=True)):
            self.words = self.words or "A stick was moved: the pilot took over."


def _is_used(message: Message) -> bool:
    """Ground stations send both kinds with nothing in them, to say that they could."""
    if message.get_type() == "MANUAL_CONTROL":
        axes = (message.x, message.y, message.r)
        return any(value not in (0, UNUSED_AXIS) for value in axes)
    return any(LOWEST_US <= getattr(message, name) <= HIGHEST_US for name in STICKS)
