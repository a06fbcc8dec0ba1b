"""Publishes the link's status once a second, and at once when something in it is another."""

from __future__ import annotations

from collections.abc import Callable

from telemetry.messages import LinkStatus

EVERY_S = 1.0


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
    mission = (status.mission_state, status.mission_digest)
    return (lines, status.candidates, status.adopted, status.state, mission, status.warnings)
