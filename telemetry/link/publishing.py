"""What is published, and how often: of the vehicle's state a new position at once, the rest at most 20 times a second.

The link's status once a second, and at once when something in it is another.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from telemetry.topics.messages import LinkStatus
from telemetry.topics.vehicle import VehicleState

PERIOD_S = 0.05
SOONEST_S = 0.04
"""Between two positions: a vehicle that was asked for 20 a second does not send them at even intervals."""
EVERY_S = 1.0


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


class StatusTeller:
    def __init__(self, publish: Callable[[LinkStatus], None]) -> None:
        self._publish = publish
        self._told: tuple[object, ...] = ()
        self._told_s = float("-inf")

    def offer(self, status: LinkStatus) -> None:
        shape = _shape(status)
        if shape != self._told or status.t_mono_s - self._told_s >= EVERY_S:
            self._told, self._told_s = shape, status.t_mono_s
            self._publish(status)


def _shape(status: LinkStatus) -> tuple[object, ...]:
    """All but the figures that change all the time."""
    lines = tuple((line.address, line.state, line.error and line.error.what) for line in status.connections)
    ways = tuple((way.address, way.peer, way.identity, way.in_use) for way in status.ways)
    mission = (status.mission_state, status.mission_digest)
    return (
        lines,
        ways,
        status.candidates,
        status.adopted,
        status.state,
        mission,
        status.warnings,
        status.again,
        status.signing.mode,
    )
