"""What a perception node hears on the bus, and hands to its thread."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from typing import Any

from telemetry.bus import Bus
from telemetry.perception.frame_worker import AVOIDANCE, CAMERA, FLIGHT, NOTICE, PLAN, SETTINGS, STATE
from telemetry.perception.inbox import Inbox
from telemetry.perception.sensor_kinds import SensorKind
from telemetry.topics.messages import RecorderStatus, Topic
from telemetry.topics.vehicle import VehicleState

_MOST_UNREAD = 2000
_LATEST = {
    Topic.PERCEPTION_SETTINGS: SETTINGS,
    Topic.PLAN: PLAN,
    Topic.FLIGHT: FLIGHT,
    Topic.AVOIDANCE: AVOIDANCE,
    Topic.GROUND: NOTICE,
}


class Listening:
    def __init__(self, bus: Bus, inbox: Inbox, kind: SensorKind, *, recording_began: Callable[[], None]) -> None:
        self._bus, self._inbox, self._kind = bus, inbox, kind
        self._recording_began = recording_began
        self._recording: str | None = None
        self.flying_mono_s: float | None = None
        """When the vehicle was last heard of; None: it was not armed then."""

    def parts(self) -> list[Coroutine[Any, Any, None]]:
        """To be run side by side until cancelled."""
        parts: list[Coroutine[Any, Any, None]] = [self._frames(), self._states(), self._recorder()]
        parts += [self._messages(topic, kind, each=False) for topic, kind in _LATEST.items()]
        if self._kind.uses_camera:
            parts.append(self._messages(Topic.SLAM_POSE, CAMERA, each=True))
        return parts

    async def _frames(self) -> None:
        # Of large clouds the bus keeps the newest only: no others must be fetched.
        each = self._kind.backlog > 1
        async for _, frame in self._bus.subscribe(self._kind.frames, keep_all=each, limit=_MOST_UNREAD):
            self._inbox.put_frame(frame)

    async def _states(self) -> None:
        async for _, state in self._bus.subscribe(Topic.VEHICLE, keep_all=True, limit=_MOST_UNREAD):
            if isinstance(state, VehicleState):
                self.flying_mono_s = time.monotonic() if state.armed else None
            self._inbox.put(STATE, state)

    async def _messages(self, topic: Topic, kind: str, *, each: bool) -> None:
        async for _, message in self._bus.subscribe(topic, keep_all=each, limit=_MOST_UNREAD):
            self._inbox.put(kind, message)

    async def _recorder(self) -> None:
        async for _, status in self._bus.subscribe(Topic.RECORDER):
            if isinstance(status, RecorderStatus):
                began = status.recording and status.name != self._recording
                self._recording = status.name if status.recording else None
                if began:
                    self._recording_began()
