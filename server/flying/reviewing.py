"""Review: one recording is open at a time, judged by a worker and played by the replay node.

What is replayed is only looked at: nothing here can command a vehicle.
"""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from pathlib import Path

from server.errors import NotReadyError
from server.flying import review_task
from server.flying.review_task import FlownTerrain, Reviewed
from server.heard.channel import Channel
from server.heard.node_states import Nodes
from server.heard.plan_follower import Followed, Follower
from server.heard.present import Present
from server.library import Library
from server.library.recording_list import RecordingShelf
from server.library.terrain_of import FlownOver, terrain_of
from server.obstacles.replayed import Replayed
from server.plan.on_show import OnShow
from server.schemas import (
    OpenReview,
    PlanDoc,
    PlayReview,
    RecordingDoc,
    ReplayMessage,
    ReviewMessage,
)
from server.work.job_board import JobBoard
from server.work.jobs import Lane, Progress
from telemetry.topics.messages import ReplayStatus
from telemetry.topics.recording_requests import CloseRecording, OpenRecording, Play

_SEEK_S = 2.0
"""A jump of the clock beyond what playing explains."""


@dataclass(frozen=True, slots=True)
class _Open:
    path: Path
    reviewed: Reviewed


class Reviewing:
    """``channel`` and ``seen`` are the replay's; ``screen`` shows a recording instead of the plan."""

    def __init__(
        self,
        library: Library,
        shelf: RecordingShelf,
        screen: OnShow,
        channel: Channel,
        nodes: Nodes,
        board: JobBoard,
        seen: Replayed,
        present: Present,
    ) -> None:
        self._library, self._shelf, self._screen, self._channel = library, shelf, screen, channel
        self._nodes, self._board, self._seen, self._watch, self._present = nodes, board, seen, seen.watch, present
        self._open: _Open | None = None
        self._opening = asyncio.Lock()
        self._last: ReplayStatus | None = None
        self._last_mono_s = self._asked_mono_s = 0.0

    @property
    def path(self) -> Path | None:
        """Of the recording that is open."""
        return None if self._open is None else self._open.path

    async def open(self, body: OpenReview) -> None:
        """Raises NotFoundError, RecordingError, NotReadyError."""
        async with self._opening:
            path = await asyncio.to_thread(self._shelf.path, body.recording_id)
            doc = await asyncio.to_thread(self._shelf.doc, body.recording_id)
            plan = self._screen.document if body.use_open_plan else None
            terrain_id = plan.terrain_id if plan is not None else body.terrain_id

            async def work(lane: Lane, progress: Progress) -> Reviewed:
                return await self._reviewed(lane, progress, path, doc, plan, terrain_id)

            reviewed = await self._board.run(f"Opening {doc.name}", work)
            followed = await asyncio.to_thread(self._followed, reviewed)
            await self._ask_to_open(path)
            self._show(_Open(path, reviewed), Follower(followed))

    async def close(self) -> None:
        async with self._opening:
            if self._open is None:
                return
            self._open = None
            self._screen.show_review(None, None)
            self._forget()
            self._present.publish(ReviewMessage(review=None))
            await self._nodes.ask_replay(CloseRecording())

    async def play(self, body: PlayReview) -> None:
        if self._open is None:
            raise NotReadyError("No recording is open.", advice="Open one first.")
        start_s = self._open.reviewed.start_utc_s
        at_utc_s = None if body.at_s is None else start_s + body.at_s
        await self._nodes.ask_replay(Play(body.playing, at_utc_s, body.speed))

    async def on_status(self, status: ReplayStatus) -> None:
        """Where the replay is. A replay node that was started again gets its recording again."""
        before, before_mono_s, now_mono_s = self._last, self._last_mono_s, time.monotonic()
        self._last, self._last_mono_s = status, now_mono_s
        self._present.publish(ReplayMessage(now_mono_s=now_mono_s, replay=status))
        if self._opening.locked():
            return
        if self._open is None:
            if status.recording is not None:
                # Of a server before this one.
                await self._nodes.ask_replay(CloseRecording())
            return
        if status.recording is None and status.error is None:
            # One told before it was asked would have it open again from the start, and stop what plays by now.
            if status.t_mono_s > self._asked_mono_s:
                await self._ask_to_open(self._open.path)
        elif before is None or _jumped(before, status, now_mono_s - before_mono_s):
            self._watch.forget_alerts()
            self._cut_track(self._open.reviewed, status.at_utc_s)

    async def _ask_to_open(self, path: Path) -> None:
        await self._nodes.ask_replay(OpenRecording(str(path)))
        self._asked_mono_s = time.monotonic()

    async def _reviewed(
        self,
        lane: Lane,
        progress: Progress,
        path: Path,
        doc: RecordingDoc,
        plan: PlanDoc | None,
        terrain_id: str | None,
    ) -> Reviewed:
        if terrain_id is None:
            flown: FlownOver = await lane.call(review_task.flown_over, path, progress=progress)
            found = terrain_of(flown, self._library.terrains())
            terrain_id = None if found is None else found.id
        terrain = None if terrain_id is None else self._terrain(terrain_id)
        return await lane.call(review_task.review, path, doc, terrain, plan, progress=progress)

    def _terrain(self, terrain_id: str) -> FlownTerrain:
        directory = self._library.terrain_dir(terrain_id)
        doc = next(doc for doc in self._library.terrains() if doc.id == terrain_id)
        return FlownTerrain(terrain_id, doc.name, directory)

    def _followed(self, reviewed: Reviewed) -> Followed | None:
        if reviewed.reference is None:
            return None
        if reviewed.terrain_id is not None:
            return Followed.over(reviewed.reference, self._library.load_terrain(reviewed.terrain_id))
        own = None if reviewed.scene is None else reviewed.scene.ground
        return None if own is None else Followed.over(reviewed.reference, own)

    def _show(self, opened: _Open, follower: Follower) -> None:
        self._open, self._last = opened, None
        reviewed = opened.reviewed
        self._forget()
        self._channel.follower = follower
        self._screen.show_review(reviewed.terrain_id, reviewed.scene)
        self._present.publish(ReviewMessage(review=reviewed.doc))
        self._cut_track(reviewed, reviewed.start_utc_s)

    def _forget(self) -> None:
        """Another recording, or none."""
        self._seen.forget()
        self._present.forget_replay()
        self._channel.forget()

    def _cut_track(self, reviewed: Reviewed, at_utc_s: float) -> None:
        """After a seek the path behind the vehicle is the one that was flown until then."""
        self._channel.follower.begin_again()
        self._channel.track.load(reviewed.doc.series, reviewed.start_utc_s, until_utc_s=at_utc_s)
        self._channel.publish_track()


def _jumped(before: ReplayStatus, now: ReplayStatus, after_s: float) -> bool:
    explained_s = before.speed * after_s if before.playing else 0.0
    away_s = abs(now.at_utc_s - before.at_utc_s - explained_s)
    return now.recording != before.recording or away_s > _SEEK_S * max(1.0, before.speed, now.speed)
