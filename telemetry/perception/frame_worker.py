"""The thread that works on a sensor's frames: what any such node does, whatever it makes of them."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from typing import Any

from mapping.sensor_frames import SensorFrame
from telemetry.perception.inbox import Inbox
from telemetry.perception.perceiver import GroundWanted, Perceiver
from telemetry.perception.status import Outcome
from telemetry.topics.messages import Published, Topic

_log = logging.getLogger(__name__)

TICK_S = 1.0
_REFUSED_S = 0.1
"""Frames that are refused may come in floods: they are told of at most so often."""
_FRAMES_IN_A_ROW = 8

Give = Callable[[str, Published], None]

STATE, CAMERA, SETTINGS, PLAN, FLIGHT, AVOIDANCE, NOTICE = (
    "state",
    "camera",
    "settings",
    "plan",
    "flight",
    "avoidance",
    "notice",
)
GROUND, WHOLE, CONFLICT = "ground", "whole", "conflict"


class FrameWorker:
    """``run`` is the thread. ``give`` gets what is to be published, ``ask_ground`` what ground is wanted: from here."""

    def __init__(
        self,
        perceiver: Perceiver,
        inbox: Inbox,
        *,
        status: Topic,
        give: Give,
        ask_ground: Callable[[GroundWanted], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.perceiver = perceiver
        self._inbox, self._clock = inbox, clock
        self._status, self._give, self._ask_ground = status, give, ask_ground
        self._told_s = clock()
        self._asked = GroundWanted(None, None)
        self._handlers: Mapping[str, Callable[[Any], None]] = {
            STATE: perceiver.on_state,
            SETTINGS: perceiver.on_settings,
            PLAN: perceiver.on_plan,
            NOTICE: perceiver.on_ground,
            GROUND: self._on_ground,
        }

    def _work(self, frame: Any) -> Outcome[Any]:
        """One frame."""
        raise NotImplementedError

    def _tick(self) -> Outcome[Any]:
        """A second without a frame."""
        raise NotImplementedError

    def _once_told(self, frame: SensorFrame) -> None:
        """What of a frame can wait until it has been told."""

    def _beside(self, now_s: float) -> None:
        """What else is due by then, beside the frames."""

    def _due_s(self) -> float:
        return self._told_s + TICK_S

    def run(self) -> None:
        """Until the inbox is closed. An error of ours costs one frame, not the node."""
        while not self._inbox.closed:
            self._inbox.wait(self._due_s())
            try:
                self.step()
            except Exception:
                _log.exception("A frame could not be worked on")

    def step(self) -> None:
        """All that is due now."""
        self._take_messages()
        for _ in range(_FRAMES_IN_A_ROW):
            frame = self._inbox.frame(self.perceiver.pose_t_mono_s)
            if frame is None:
                break
            self._take_messages()
            self._tell(self._work(frame))
            self._once_told(frame)
        now_s = self._clock()
        if now_s >= self._told_s + TICK_S:
            self._tell(self._tick())
        self._beside(now_s)
        if (wanted := self.perceiver.ground_wanted) != self._asked:
            self._asked = wanted
            self._ask_ground(wanted)

    def _take_messages(self) -> None:
        if skipped := self._inbox.skipped():
            self.perceiver.skip(skipped)
        for kind, message in self._inbox.messages():
            if kind in self._handlers:
                self._handlers[kind](message)

    def _tell(self, outcome: Outcome[Any]) -> None:
        now_s = self._clock()
        if not outcome.accepted and not outcome.alerts and now_s < self._told_s + _REFUSED_S:
            return
        for alert in outcome.alerts:
            self._give(Topic.ALERT, alert)
        self._told_s = now_s
        self._give(self._status, outcome.status)

    def _on_ground(self, message: Any) -> None:
        wanted, grid, why_none = message
        if wanted == self.perceiver.ground_wanted:
            self.perceiver.set_ground(grid, why_none)
