"""Which chunks are drawn when: the near ones first, no more than pages can take, coarser where there are too many."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from server.obstacles import drawing
from server.obstacles.drawing import MapDrawing, fitting_detail
from server.obstacles.obstacle_watch import Watch
from server.scene.layers.sights import MapLook, Sights
from server.scene.mirror import ChunkKey, MapMirror, Voxels
from telemetry.topics.obstacles import MapName, MapOrigin
from tests.server.fakes import Told
from tests.server.obstacle_messages import ORIGIN, delta
from tests.server.test_scene_obstacles import placed


class FakeStage(Sights):
    """Keeps what it was given; every chunk costs ``cost`` bytes."""

    def __init__(self, cost: int = 100) -> None:
        self.cost = cost
        self.drawn: list[tuple[ChunkKey, int]] = []
        self.dropped = 0
        self.view: dict[str, Any] = {"with_ground": True, "visible": True}
        self._placed = placed()[0]

    def look(self, name: MapName, origin: MapOrigin | None) -> MapLook | None:
        return None if origin is None else MapLook(self._placed, origin, **self.view)

    def draw_cloud(self, source: Any, look: Any) -> None:
        raise AssertionError("maps only")

    def draw_now(self, source: Any, origin: Any, statuses: Any, routes: Any, tracks: Any = None) -> None:
        raise AssertionError("maps only")

    def draw_chunks(self, name: MapName, look: MapLook, chunks: Mapping[ChunkKey, Voxels | None]) -> int:
        self.drawn += [(key, 0 if voxels is None else len(voxels.keys)) for key, voxels in chunks.items()]
        return self.cost

    def drop_chunks(self, name: MapName) -> None:
        self.dropped += 1


class NoRoutes:
    routes: tuple[Any, ...] = ()


def made() -> MapDrawing:
    watches = {source: Watch(source, Told()) for source in ("live", "replay")}
    return MapDrawing(None, watches, NoRoutes(), {})  # pyright: ignore[reportArgumentType]


def test_only_what_changed_is_drawn_again() -> None:
    stage, mirror, maps = FakeStage(), MapMirror("radar"), made()
    mirror.fold(delta([(0, 0, 0), (40, 0, 0)]))
    maps.draw(stage, "radar", mirror)
    assert sorted(stage.drawn) == [((0, 0, 0), 1), ((1, 0, 0), 1)]
    stage.drawn.clear()
    mirror.fold(delta([(41, 0, 0)]))
    maps.draw(stage, "radar", mirror)
    assert stage.drawn == [((1, 0, 0), 2)]
    stage.drawn.clear()
    stage.view["with_ground"] = False
    maps.draw(stage, "radar", mirror)
    assert len(stage.drawn) == 2
    described = maps.drawn()[0]
    assert (described.voxels, described.drawn, described.detail, described.sent_bytes) == (3, 3, 1, 500)


def test_near_chunks_come_first_and_far_ones_less_often() -> None:
    stage, mirror, maps = FakeStage(), MapMirror("radar"), made()
    here = (5.0, 5.0, 5.0)
    mirror.fold(delta([(320, 0, 0), (0, 0, 0)]))
    maps.draw(stage, "radar", mirror, here)
    assert [key for key, _ in stage.drawn] == [(0, 0, 0), (10, 0, 0)]
    stage.drawn.clear()
    mirror.fold(delta([(321, 0, 0), (1, 0, 0)]))
    maps.draw(stage, "radar", mirror, here)
    assert [key for key, _ in stage.drawn] == [(0, 0, 0)]


def test_beyond_the_allowance_the_rest_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "RATE_BYTES_S", 0.0)
    stage, mirror, maps = FakeStage(cost=int(drawing.BURST_BYTES)), MapMirror("radar"), made()
    mirror.fold(delta([(40 * n, 0, 0) for n in range(5)]))
    maps.draw(stage, "radar", mirror)
    assert len(stage.drawn) == 1
    stage.drawn.clear()
    maps.draw(stage, "radar", mirror)
    assert stage.drawn == []


def test_a_map_of_too_many_boxes_is_drawn_coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "BOXES_MAX", {"radar": 300, "vision": 10, "ranges": 10})
    stage, mirror, maps = FakeStage(), MapMirror("radar"), made()
    e, n = np.meshgrid(np.arange(30), np.arange(30))
    mirror.fold(delta(np.column_stack([e.ravel(), n.ravel(), np.zeros(900, int)])))
    maps.draw(stage, "radar", mirror)
    assert stage.drawn == [((0, 0, 0), 225)]
    described = maps.drawn()[0]
    assert (described.voxels, described.drawn, described.detail) == (900, 225, 2)
    assert "2 x 2 x 2" in described.text


def test_detail_comes_back_only_with_room_to_grow() -> None:
    boxes = (90, 40, 20, 10, 5)
    assert fitting_detail(boxes, 100, 1) == 1
    assert fitting_detail(boxes, 50, 1) == 2
    assert fitting_detail(boxes, 100, 2) == 2
    assert fitting_detail(boxes, 160, 2) == 1
    assert fitting_detail((10**9,) * 5, 100, 1) == 16


def test_another_map_takes_the_place_of_the_one_before() -> None:
    stage, maps = FakeStage(), made()
    live, replayed = MapMirror("radar"), MapMirror("radar")
    live.fold(delta([(0, 0, 0)]))
    maps.draw(stage, "radar", live)
    replayed.fold(delta([(0, 0, 0), (1, 0, 0)]))
    maps.draw(stage, "radar", replayed)
    assert stage.dropped == 2
    assert stage.drawn[-1] == ((0, 0, 0), 2)
    stage.drawn.clear()
    replayed.clear()
    maps.draw(stage, "radar", replayed)
    maps.draw(stage, "radar", live)
    assert stage.drawn == [((0, 0, 0), 1)]
    assert live.origin == ORIGIN


class Threads(FakeStage):
    """Which thread draws what moves, and whether a map may."""

    def __init__(self) -> None:
        super().__init__()
        self.drew: dict[str, int] = {}

    def draw_now(self, source: Any, origin: Any, statuses: Any, routes: Any, tracks: Any = None) -> None:
        self.drew["now"] = threading.get_ident()

    def draw_cloud(self, source: Any, look: Any) -> None:
        self.drew["cloud"] = threading.get_ident()


def test_the_event_loop_draws_nothing_of_what_moves() -> None:
    stage = Threads()
    watches = {source: Watch(source, Told()) for source in ("live", "replay")}
    nothing = {source: SimpleNamespace(status=None) for source in ("live", "replay")}
    maps = MapDrawing(stage, watches, NoRoutes(), nothing)  # pyright: ignore[reportArgumentType]

    async def draw() -> None:
        drawing = asyncio.create_task(maps.run())
        async with asyncio.timeout(60):
            while len(stage.drew) < 2:
                await asyncio.sleep(0.01)
        drawing.cancel()

    asyncio.run(draw())
    assert threading.get_ident() not in stage.drew.values()
