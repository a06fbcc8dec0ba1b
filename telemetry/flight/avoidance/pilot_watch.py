"""Sees that a person takes over: a flight mode that nobody here asked for, or a stick that is moved."""

from __future__ import annotations

from collections import defaultdict

from telemetry.mavlink.actions import Message
from telemetry.topics.vehicle import VehicleState

ASKED_S = 15.0
"""A mode that was asked for longer ago than this and shows only now was chosen by somebody else."""
LATE_S = 3.0
"""Of several orders of one mode the others show within this time after the first, or were repetitions of it."""
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
        self._expected_until_s: defaultdict[str, list[float]] = defaultdict(list)
        """When each order of a mode that has not shown yet stops being expected."""
        self._sticks_us: tuple[int, ...] | None = None

    def begin(self) -> None:
        """Another flight: sticks are where they are, and the mode is what it is."""
        self.words = ""
        self._mode = self._sticks_us = None

    def asked(self, mode: str, now_s: float) -> None:
        """This ground station has commanded this mode."""
        # Orders that no mode has shown in time, and will not.
        for each, until_s in list(self._expected_until_s.items()):
            if kept := [at_s for at_s in until_s if now_s <= at_s]:
                self._expected_until_s[each] = kept
            else:
                del self._expected_until_s[each]
        self._expected_until_s[mode].append(now_s + ASKED_S)

    @property
    def expected(self) -> int:
        """Orders whose mode has not shown yet."""
        return sum(len(until_s) for until_s in self._expected_until_s.values())

    def on_state(self, state: VehicleState, now_s: float) -> None:
        before, self._mode = self._mode, state.mode
        if before is None or state.mode == before:
            return
        if self._was_expected(state.mode, now_s) or self.words or _is_its_own(before, state):
            return
        if state.critical:
            self.words = f"The vehicle has changed to {state.mode} by itself: a failsafe is active."
        else:
            self.words = f"The flight mode was changed to {state.mode}: the pilot took over."

    def _was_expected(self, mode: str, now_s: float) -> bool:
        expected_until_s = [until_s for until_s in self._expected_until_s.pop(mode, ()) if now_s <= until_s]
        if others := expected_until_s[1:]:
            self._expected_until_s[mode] = [min(until_s, now_s + LATE_S) for until_s in others]
        return bool(expected_until_s)

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


def _is_its_own(before: str, state: VehicleState) -> bool:
    """PX4 leaves its mission, once all of it is flown, for RTL or HOLD, and its take-off for HOLD."""
    if state.autopilot != "px4":
        return False
    items, reached = state.mission_items, state.mission_reached
    is_flown = items is not None and reached is not None and reached >= items - 1
    return (before == "MISSION" and is_flown and state.mode in ("RTL", "HOLD")) or (
        before == "TAKEOFF" and state.mode == "HOLD"
    )


def _is_used(message: Message) -> bool:
    """Ground stations send both kinds with nothing in them, to say that they could."""
    if message.get_type() == "MANUAL_CONTROL":
        axes = (message.x, message.y, message.r)
        return any(value not in (0, UNUSED_AXIS) for value in axes)
    return any(LOWEST_US <= getattr(message, name) <= HIGHEST_US for name in STICKS)
