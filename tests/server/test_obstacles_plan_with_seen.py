"""Planning against what was seen: all that counts in this flight, with words for what is not drawn any more."""

from __future__ import annotations

import asyncio
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.errors import NotReadyError
from server.obstacles.obstacle_desk import ObstacleDesk
from server.obstacles.obstacle_watch import Watch
from server.scene.mirror import Voxels
from server.schemas import PlanWithSeen
from tests.server.fakes import Told
from tests.server.obstacle_messages import delta, status

CRANE, MAST, TREE = (4, 0, 20), (9, 0, 12), (2, 7, 3)


class Desk:
    """In flight; what is planned against is written down."""

    def __init__(self, folder: Path) -> None:
        self.watch, self.planned = Watch("live", Told()), list[tuple[set[tuple[int, ...]], str]]()
        self.lacks = list[str]()
        me, nobody = cast(Any, self), cast(Any, None)
        self.live = SimpleNamespace(state=None, track=SimpleNamespace(states=[]))
        self.desk = ObstacleDesk(folder, {"live": self.watch}, nobody, me, nobody, me, nobody, nobody, nobody)

    async def plan_with_seen(self, maps: list[Voxels], _state: Any, _took_off: Any, words: str, lacks: str) -> None:
        self.lacks.append(lacks)
        self.planned.append(({tuple(key) for voxels in maps for key in voxels.keys.tolist()}, words))

    async def plans(self, *sensors: Any) -> tuple[set[tuple[int, ...]], str]:
        await self.desk.plan_with_seen(PlanWithSeen(seen=True, sensors=list(sensors)))
        return self.planned[-1]


def test_what_was_seen_before_a_map_began_anew_is_planned_against_and_named(tmp_path: Path) -> None:
    async def scenario() -> None:
        desk = Desk(tmp_path)
        watch = desk.watch
        with pytest.raises(NotReadyError, match="Nothing was seen"):
            await desk.plans("radar", "vision")
        await watch.on_flight(flies=True)
        await watch.on_map(delta([CRANE], whole=True, began_mono_s=1.0))
        await watch.on_map(delta([TREE], whole=True, began_mono_s=1.0, sensor="vision"))
        assert await desk.plans("radar", "vision") == ({CRANE, TREE}, "Plan against what was seen")
        await watch.on_map(delta([], whole=True, began_mono_s=2.0))
        words = "Plan against what was seen, also before the radar map began anew"
        assert await desk.plans("radar", "radar") == ({CRANE}, words), "its node has seen nothing again yet"
        await watch.on_map(delta([MAST], since=1, revision=2, began_mono_s=2.0))
        assert await desk.plans("radar", "vision") == ({CRANE, MAST, TREE}, words)
        assert await desk.plans("vision") == ({TREE}, "Plan against what was seen")
        await watch.on_map(delta([], whole=True, began_mono_s=2.0, sensor="vision"))
        both = await desk.plans("radar", "vision")
        assert both == ({CRANE, MAST, TREE}, words.replace("radar map", "radar map and the vision map"))
        await watch.on_flight(flies=False)
        assert await desk.plans("radar", "vision") == ({MAST}, "Plan against what was seen")

    asyncio.run(scenario())


def test_a_plan_against_half_of_what_was_seen_says_what_it_lacks(tmp_path: Path) -> None:
    async def scenario() -> None:
        desk = Desk(tmp_path)
        watch, words = desk.watch, "Plan against what was seen"
        await watch.on_flight(flies=True)
        watch.on_status(status(voxels_occupied=1))
        with pytest.raises(NotReadyError, match="and parts of the radar map are missing") as refused:
            await desk.plans("radar", "vision")
        assert "plan again" in refused.value.advice
        await watch.on_map(delta([TREE], whole=True, began_mono_s=1.0, sensor="vision"))
        lacks = f"{words}, but not all: parts of the radar map are missing"
        assert await desk.plans("radar", "vision") == ({TREE}, lacks), "nothing of it has come"
        assert await desk.plans("vision") == ({TREE}, words)
        assert desk.lacks == ["Parts of the radar map are missing.", ""]
        await watch.on_map(delta([CRANE], whole=True, began_mono_s=12.0))
        (lost,) = [each.alert.text for each in watch.state.alerts if each.alert.id.startswith("forgot-radar")]
        assert "plans against what was seen are without it" in lost
        assert await desk.plans("radar") == ({CRANE}, lacks), "it is lost"
        await watch.dismiss(1)
        await watch.on_map(delta([CRANE], whole=True, revision=2, parts=2, began_mono_s=12.0, clear_count=1))
        assert await desk.plans("radar") == ({CRANE}, lacks), "half of it has come"
        await watch.on_map(delta([MAST], whole=True, revision=2, part=1, parts=2, began_mono_s=12.0, clear_count=1))
        assert await desk.plans("radar") == ({CRANE, MAST}, words)
        watch.awaited.add("radar")
        assert await desk.plans("radar") == ({CRANE, MAST}, lacks), "its node has not spoken to this server yet"

    asyncio.run(scenario())


def test_a_plan_says_that_only_the_cameras_newest_frame_is_in_it_where_it_saw_more(tmp_path: Path) -> None:
    async def scenario() -> None:
        desk = Desk(tmp_path)
        watch = desk.watch
        await watch.on_flight(flies=True)
        before: Any = {"sensor": "vision_flight", "whole": True, "began_mono_s": 1.0}
        await watch.on_map(delta([TREE], whole=True, began_mono_s=1.0, sensor="vision"))
        await watch.on_map(delta([TREE], **before))
        await desk.plans("radar", "vision")
        await watch.on_map(delta([TREE, CRANE], revision=2, **before))
        await desk.plans("radar", "vision")
        await watch.on_map(delta([CRANE], whole=True, began_mono_s=1.0))
        await desk.plans("radar", "vision")
        await desk.plans("radar")
        newest = "What the camera saw before its newest frame is not in it."
        assert desk.lacks == ["", newest, "", ""], "the radar has seen the same crane"

    asyncio.run(scenario())
