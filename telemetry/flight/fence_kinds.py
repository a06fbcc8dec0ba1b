"""Kinds of an ArduPilot's fence that were named while it was on: since 4.6 it may not act on them yet.

FENCE_TYPE reads back as set, and what it names is taken only when the fence is switched on, or when the vehicle starts.
The floor is taken by itself, after each take-off. Older versions act at once: which it is does not show.
"""

from __future__ import annotations

from collections.abc import Mapping

from telemetry.flight.fence_actions import CEILING_BIT, CIRCLE_BIT, FLOOR_BIT, SHAPES_BIT

NAMES = ("FENCE_ENABLE", "FENCE_TYPE")
KINDS = {CEILING_BIT: "ceiling", CIRCLE_BIT: "circle around home", SHAPES_BIT: "shapes"}
SWITCH = "Set FENCE_ENABLE to 0 and to 1 again under Parameters, or accept it."


class KindsSeen:
    """Of one vehicle, from what it told of its parameters, in that order."""

    def __init__(self) -> None:
        self.untaken = 0
        """Bits of FENCE_TYPE that were added while the fence was on."""
        self._enabled: float | None = None
        self._kinds: int | None = None

    def take(self, parameters: Mapping[str, float | None]) -> None:
        """Any that were read, written or heard. What was not told says nothing."""
        enabled, kinds = (parameters.get(name) for name in NAMES)
        was_on, self._enabled = self._enabled == 1, self._enabled if enabled is None else enabled
        if kinds is not None:
            added = 0 if self._kinds is None else int(kinds) & ~self._kinds & ~FLOOR_BIT
            self._kinds = int(kinds)
            # Off and on between two readings looks the same as never off: the worse end.
            self.untaken = (self.untaken | (added if was_on else 0)) & self._kinds
        if self._enabled == 0:
            self.untaken = 0

    def forget(self) -> None:
        """The vehicle restarted: it takes all of them then."""
        self.untaken, self._enabled, self._kinds = 0, None, None


def untaken_words(untaken: int) -> str:
    """Empty: there are none."""
    names = [name for bit, name in KINDS.items() if untaken & bit]
    if not names:
        return ""
    what = f"FENCE_TYPE was given more kinds while the fence is on ({', '.join(names)})"
    return f"{what}: since ArduPilot 4.6 it may not act on them until it is switched off and on, or started again."
