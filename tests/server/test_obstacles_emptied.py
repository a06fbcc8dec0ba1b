"""Maps that are emptied by order: a real node's worker and the server's copy, and between them what the bus carries."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest

from server.obstacles.obstacle_desk import ObstacleDesk
from server.obstacles.obstacle_watch import Watch
from server.obstacles.surroundings import seen_maps
from telemetry.perception.inbox import Inbox
from telemetry.perception.map_worker import DELTA_S, MapWorker
from telemetry.perception.sensor_kinds import RADAR
from telemetry.topics.obstacles import MapDelta, PerceptionSettings
from tests.server.fakes import Told
from tests.telemetry import perception_flights as flights

T0_MONO_S, T0_UTC_S = 1000.0, 1_700_000_000.0


class Node:
    """The radar's, flown along a wall; what it tells waits in ``told``."""

    def __init__(self, began_s: float = 0.0) -> None:
        self.now_s, self.told = T0_MONO_S + began_s, list[MapDelta]()
        nothing: Any = lambda *_: None  # noqa: E731
        self.worker = MapWorker(
            RADAR, Inbox(backlog=1), give=nothing, tell_map=self.told.extend, tell_flight_map=nothing,
            ask_ground=nothing, look_ahead=nothing, run="test", clock=lambda: self.now_s, utc=lambda: T0_UTC_S,
        )  # fmt: skip

    def fly(self, from_s: float, to_s: float) -> None:
        for k in range(round(from_s * 20), round(to_s * 20)):
            t_s, self.now_s = k / 20, T0_MONO_S + k / 20 + 0.01
            self.worker.perceiver.on_state(flights.state_at(t_s, T0_MONO_S, T0_UTC_S))
            if k % 2 == 0:
                self.worker.perceiver.work(flights.radar_frame(t_s, k, T0_MONO_S, T0_UTC_S), lambda: self.now_s)
        self.tell()

    def tell(self) -> None:
        self.now_s += DELTA_S
        self.worker._tell_changes()


class Station:
    def __init__(self, folder: Path) -> None:
        nobody = cast(Any, None)
        self.watch, self.published = Watch("live", Told()), list[PerceptionSettings]()
        bus = cast(Any, self)
        self.desk = ObstacleDesk(
            folder, {"live": self.watch}, nobody, nobody, nobody, nobody, nobody, nobody, bus
        )  # fmt: skip

    def publish(self, _topic: str, settings: PerceptionSettings) -> None:
        self.published.append(settings)

    async def hears(self, node: Node) -> None:
        for part in node.told:
            await self.watch.on_map(part)
        node.told.clear()

    async def sees(self) -> int:
        return sum(int((~voxels.explained).sum()) for voxels in await seen_maps(self.watch))


@pytest.mark.parametrize("is_restarted", [False, True], ids=["its map", "what is kept, too"])
def test_an_order_empties_the_map_and_what_is_kept(tmp_path: Path, *, is_restarted: bool) -> None:
    async def scenario() -> None:
        station, node = Station(tmp_path), Node()
        await station.desk.start()
        for flies in (False, True):
            await station.watch.on_flight(flies=flies)
        node.fly(0.0, 9.0)
        await station.hears(node)
        assert await station.sees() > 0
        if is_restarted:
            before, node = await station.sees(), Node(9.0)
            node.fly(9.0, 9.5)
            await station.hears(node)
            assert await station.sees() >= before
            assert station.watch.mirrors["radar"].kept_count > 0
        node.fly(9.5, 10.0)  # on its way while the order is given
        await station.desk.clear()
        await station.hears(node)
        assert await station.sees() == 0
        node.worker.perceiver.on_settings(station.published[-1])
        node.tell()
        assert node.told[0].whole
        await station.hears(node)
        assert await station.sees() == 0
        mirror = station.watch.mirrors["radar"]
        assert (mirror.kept_count, mirror.has_forgotten, mirror.is_complete) == (0, False, True)
        said = node.worker.perceiver.tick(lambda: node.now_s, feed=True).status
        assert said.clear_count == station.published[-1].clear_count
        node.fly(10.0, 11.0)
        await station.hears(node)
        assert await station.sees() > 0, "what is seen after the order counts"

    asyncio.run(scenario())


def test_an_order_that_a_node_has_nothing_to_empty_for_is_answered_too(tmp_path: Path) -> None:
    async def scenario() -> None:
        station, node = Station(tmp_path), Node()
        await station.desk.start()
        node.worker.perceiver.on_state(replace(flights.state_at(0.0, T0_MONO_S, T0_UTC_S)))
        node.worker.perceiver.tick(lambda: node.now_s, feed=True)
        node.tell()
        await station.desk.clear()
        await station.hears(node)
        assert station.watch.mirrors["radar"].origin is None
        node.worker.perceiver.on_settings(station.published[-1])
        node.tell()
        await station.hears(node)
        assert station.watch.mirrors["radar"].origin is not None
        assert await station.sees() == 0

    asyncio.run(scenario())
