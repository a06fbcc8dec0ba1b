"""Publishes the vehicle's state: a new position at once, the rest at most 20 times a second."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from telemetry.topics.messages import LinkStatus
from telemetry.topics.vehicle import VehicleState

PERIOD_S = 0.05
SOONEST_S = 0.04
"""Between two positions: a vehicle that was asked for 20 a second does not send them at even intervals."""


class StatePublisher:
    def __init__(self, publish: Callable[[VehicleState], None]) -> None:
        self._publish = publish
        self._waiting: VehicleState | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._last: VehicleState | None = None
        self._last_s = self._last_position_s = float("-inf")

    def offer(self, state: VehicleState) -> None:
        """Latest wins. The first one, and a new position, does not wait."""
        loop = asyncio.get_running_loop()
        due_s = self._last_position_s + SOONEST_S if self._has_moved(state) else self._last_s + PERIOD_S
        self._waiting = state
        if loop.time() >= due_s:
            self._flush()
        elif self._timer is None or self._timer.when() > due_s:
            self._stop_timer()
            self._timer = loop.call_at(due_s, self._flush)

    def close(self) -> None:
        self._stop_timer()

    def _flush(self) -> None:
        self._stop_timer()
        if self._waiting is not None:
            state, self._waiting = self._waiting, None
            self._last_s = asyncio.get_running_loop().time()
            if self._has_moved(state):
                self._last_position_s = self._last_s
            self._last = state
            self._publish(state)

    def _has_moved(self, state: VehicleState) -> bool:
        return self._last is None or state.position_t_mono_s != self._last.position_t_mono_s

    def _stop_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
