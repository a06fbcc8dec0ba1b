"""Moving objects of one source, live or replayed, as the pages see them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

from server.obstacles.obstacle_watch import DEAD_S, RATE_HZ, Watch
from server.schemas import Pages, Source, TracksMessage
from telemetry.topics.obstacles import ObstacleAlert
from telemetry.topics.tracks import TracksStatus, VelocityProposal

OLD_S = 1.0
"""A velocity that was proposed for a frame measured longer ago is not flown, whenever it arrived."""
HELD_S = 0.5
"""So long a proposal outlives its frame while newer ones have none."""
_LOST = "Nothing is heard of moving objects any more: their node may have died. It is started again."


class TracksWatch:
    """The latest status. A node that falls silent leaves no tracks behind: objects that move are somewhere else now.

    ``watch`` is told when the node falls silent and when it is back.
    """

    def __init__(
        self,
        source: Source,
        pages: Pages,
        watch: Watch,
        *,
        now_mono_s: Callable[[], float] = time.monotonic,
        now_utc_s: Callable[[], float] = time.time,
    ) -> None:
        self._source: Source = source
        self._pages, self._watch, self._now_mono_s, self._now_utc_s = pages, watch, now_mono_s, now_utc_s
        self._heard_mono_s = self._told_mono_s = self._proposed_mono_s = float("-inf")
        self._proposal: VelocityProposal | None = None
        self._lost: ObstacleAlert | None = None
        self.status: TracksStatus | None = None

    def on_status(self, status: TracksStatus) -> None:
        now_s = self._now_mono_s()
        before, self.status, self._heard_mono_s = self.status, status, now_s
        if status.proposal is not None:
            self._proposed_mono_s, self._proposal = status.t_mono_s, status.proposal
        changed = before is None or before.state != status.state
        if changed or now_s - self._told_mono_s >= 0.8 / RATE_HZ:
            self._tell_status()
        if (lost := self._lost) is not None:
            self._lost = None
            self._say(replace(lost, phase="ends", text="The tracks node is back."))

    def tick(self) -> None:
        """Once a second: a node that has died tells nothing, so its silence is noted here."""
        status, now_s = self.status, self._now_mono_s()
        if status is None or self._lost is not None or now_s - self._heard_mono_s <= DEAD_S:
            return
        waits = status.state == "waiting"
        self.status = replace(status, state="stale", text=_LOST, tracks=(), hidden=0, cones=(), proposal=None)
        self._tell_status()
        if waits:
            return
        self._lost = ObstacleAlert(f"lost-tracks-{now_s:.1f}", "radar", "sensor", "begins", now_s, 0.0, now_s, _LOST)
        self._say(self._lost)

    def fresh(self) -> TracksStatus | None:
        """What a manoeuvre may be made from: None unless the node runs and its newest frame is of now.

        On the edge of a collision course a proposal comes and goes from frame to frame, so it stands for a few frames
        that have none. It is for the place and the velocity of its own frame: its age counts from when that was
        measured, as the newest frame's does, so that nothing that is offered is more than ``OLD_S`` behind. Whoever
        makes a way of it checks it again from where vehicle and objects are by then.
        """
        status, now_s = self.status, self._now_mono_s()
        if status is None or status.state != "running" or now_s - status.t_mono_s > OLD_S:
            return None
        if status.proposal is None and not status.no_proposal and self._holds(status, now_s):
            return replace(status, proposal=self._proposal)
        return status

    def _holds(self, status: TracksStatus, now_s: float) -> bool:
        return status.t_mono_s - self._proposed_mono_s <= HELD_S and now_s - self._proposed_mono_s <= OLD_S

    def forget(self) -> None:
        """Another recording, or none."""
        if self.status is not None:
            self.status, self._lost = None, None
            self._heard_mono_s = self._told_mono_s = self._proposed_mono_s = float("-inf")
            self._tell_status()

    def _tell_status(self) -> None:
        now_s = self._told_mono_s = self._now_mono_s()
        self._pages.publish(TracksMessage(source=self._source, now_mono_s=now_s, status=self.status))

    def _say(self, alert: ObstacleAlert) -> None:
        now_s = self._now_mono_s()
        self._watch.on_alert(replace(alert, t_mono_s=now_s, t_utc_s=self._now_utc_s(), done_t_mono_s=now_s))
