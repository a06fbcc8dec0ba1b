"""Notices that a vehicle has started anew: its clock of milliseconds since boot runs backwards."""

from __future__ import annotations

from telemetry.mavlink.actions import Message

BACKWARDS_MS = 5000
"""More than messages can be late."""


class BootClock:
    def __init__(self) -> None:
        self._newest_ms: int | None = None

    def has_restarted(self, message: Message) -> bool:
        """Whether this message of the vehicle is younger than an earlier one."""
        t_boot_ms = getattr(message, "time_boot_ms", None)
        if t_boot_ms is None:
            return False
        if self._newest_ms is not None and t_boot_ms < self._newest_ms - BACKWARDS_MS:
            return True
        self._newest_ms = max(t_boot_ms, self._newest_ms or 0)
        return False
