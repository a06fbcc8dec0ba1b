"""The thread that works on radar frames: tracks and approach alerts, and what is told of them."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import Any

from telemetry.messages import Published, Topic
from telemetry.perception.inbox import Inbox
from telemetry.perception.perceiver import GroundWanted
from telemetry.perception.worker import GROUND, NOTICE, PLAN, SETTINGS, STATE, TICK_S
from telemetry.tracking.following import Following, Told

_log = logging.getLogger(__name__)

_REFUSED_S = 0.1
"""Frames that are refused may come in floods: they are told of at most so often."""
_FRAMES_IN_A_ROW = 8


class TracksWorker:
    """``run`` is the thread. ``give`` gets what is to be published, ``ask_ground`` what ground is wanted: from here."""

    def __init__(
        self,
        inbox: Inbox,
        *,
        give: Callable[[str, Published], None],
        ask_ground: Callable[[GroundWanted], None],
        run: str,
        clock: Callable[[], float] = time.monotonic,
        utc: Callable[[], float] = time.time,
    ) -> None:
        self._inbox, self._clock, self._give, self._ask_ground = inbox, clock, give, ask_ground
        self.following = Following(run=run, utc_minus_mono_s=utc() - clock())
        self._told_s = clock()
        self._asked = GroundWanted(None, None)
        perceiver = self.following.perceiver
        self._handlers: dict[str, Callable[[Any], None]] = {
            STATE: perceiver.on_state,
            SETTINGS: self.following.on_settings,
            PLAN: self.following.on_plan,
            NOTICE: perceiver.on_ground,
            GROUND: self._on_ground,
        }

    def run(self) -> None:
        """Until the inbox is closed. An error of ours costs one frame, not the node."""
        while not self._inbox.closed:
            self._inbox.wait(self._told_s + TICK_S)
            try:
                self.step()
            except Exception:
                _log.exception("A frame could not be followed")

    def step(self) -> None:
        """All that is due now."""
        self._take_messages()
        for _ in range(_FRAMES_IN_A_ROW):
            frame = self._inbox.frame(self.following.perceiver.pose_t_mono_s)
            if frame is None:
                break
            self._take_messages()
            self._tell(self.following.work(frame, self._clock))
        if self._clock() >= self._told_s + TICK_S:
            self._tell(self.following.tick(self._clock))
        if (wanted := self.following.perceiver.ground_wanted) != self._asked:
            self._asked = wanted
            self._ask_ground(wanted)

    def _take_messages(self) -> None:
        if skipped := self._inbox.skipped():
            self.following.perceiver.skip(skipped)
        for kind, message in self._inbox.messages():
            if kind in self._handlers:
                self._handlers[kind](message)

    def _tell(self, told: Told) -> None:
        now_s = self._clock()
        if not told.accepted and not told.alerts and now_s < self._told_s + _REFUSED_S:
            return
        for alert in told.alerts:
            self._give(Topic.ALERT, alert)
        self._told_s = now_s
        self._give(Topic.TRACKS, told.status)

    def _on_ground(self, message: Any) -> None:
        wanted, grid, why_none = message
        if wanted == self.following.perceiver.ground_wanted:
            self.following.perceiver.set_ground(grid, why_none)
