"""Sees that the vehicle is still armed and in a flight mode that the script has asked for."""

from __future__ import annotations

from telemetry.topics.vehicle import VehicleState


class ModeWatch:
    def __init__(self) -> None:
        self.seen = False
        """Whether the mode that was asked for last has shown."""
        self._asked: frozenset[str] = frozenset()
        self._before: frozenset[str] = frozenset()
        self._was_armed = False

    def expect(self, modes: frozenset[str], *, before: frozenset[str]) -> None:
        """From now on any of ``modes``; until one of them shows, those of ``before`` too."""
        self._asked, self._before, self.seen = modes, before, False

    def interruption(self, state: VehicleState) -> str:
        """Why the script must end; empty while all is well."""
        self._was_armed |= state.armed
        if self._was_armed and not state.armed:
            return "The vehicle has disarmed."
        if state.mode in self._asked:
            self.seen = True
            return ""
        if not self.seen and state.mode in self._before:
            return ""
        if state.critical:
            return f"The vehicle has changed to {state.mode} by itself: a failsafe is active."
        return f"The flight mode was changed to {state.mode}: the pilot took over."
