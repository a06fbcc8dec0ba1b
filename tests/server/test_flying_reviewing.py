"""When the replay node is asked to open a recording: when an operator opens it, and when the node has lost it."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from server.flying.review import review
from server.flying.review_task import Reviewed
from server.flying.reviewing import Reviewing
from server.heard.channel import Channel
from server.heard.present import Present
from server.obstacles.replayed import Replayed
from server.schemas import OpenReview, PlanDoc
from telemetry.topics.messages import ReplayStatus
from telemetry.topics.recording_requests import OpenRecording, ReplayRequest
from tests.server.fakes import Told
from tests.server.flight_logs import START_UTC_S, log_of, positions
from tests.server.test_review import RECORDING


@dataclass
class Surroundings:
    """Shelf, screen and replay node, and what the node was asked."""

    document: PlanDoc = field(default_factory=PlanDoc)
    asked: list[ReplayRequest] = field(default_factory=list)

    def path(self, recording_id: str) -> Path:
        return Path(recording_id)

    def doc(self, recording_id: str) -> object:
        return RECORDING

    def show_review(self, terrain_id: str | None, scene: object) -> None:
        """Nothing to see."""

    async def ask_replay(self, request: ReplayRequest) -> None:
        self.asked.append(request)

    async def run(self, label: str, work: object) -> Any:
        return Reviewed(review(log_of(positions()), RECORDING), START_UTC_S, None, None, None)


def test_it_is_opened_again_by_a_node_that_has_lost_it_and_not_for_a_status_from_before() -> None:
    around: Any = Surroundings()
    present = Present(Told())
    channel = Channel("replay", present)
    reviewing = Reviewing(cast(Any, None), around, around, channel, around, around, Replayed(present), present)

    async def act() -> None:
        before_s = time.monotonic()
        await reviewing.open(OpenReview(recording_id="flight"))
        await reviewing.on_status(ReplayStatus(t_mono_s=before_s))
        assert around.asked == [OpenRecording("flight")]
        await reviewing.on_status(ReplayStatus(t_mono_s=time.monotonic() + 1.0))
        assert around.asked == 2 * [OpenRecording("flight")]

    asyncio.run(act())
