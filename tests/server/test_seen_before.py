"""What the camera saw before its newest frame: it does not count for ways and returns, and that is said near it."""

from __future__ import annotations

import asyncio
from typing import Any

from server.obstacles.obstacle_watch import Watch
from server.obstacles.surroundings import SEEN_BEFORE, SEEN_BEFORE_LOST, seen_before_near, seen_maps
from tests.server.fakes import Told
from tests.server.obstacle_messages import ORIGIN, delta, status

MAST, FAR = [(4, 3, 0), (4, 3, 1)], [(4, 300, 0)]
WITHIN_M = 10.0
EAST = [(ORIGIN.lat_deg, ORIGIN.lon_deg), (ORIGIN.lat_deg, ORIGIN.lon_deg + 0.0005)]
"""44 m, past the mast."""


def flight_map(keys: Any, **more: Any) -> Any:
    return delta(keys, sensor="vision_flight", whole=True, began_mono_s=more.pop("began_mono_s", 1.0), **more)


def frame(keys: Any) -> Any:
    return delta(keys, sensor="vision", whole=True, began_mono_s=1.0)


async def said(watch: Watch) -> str | None:
    return await seen_before_near(watch, await seen_maps(watch), EAST, WITHIN_M)


def test_what_only_older_frames_show_near_a_line_is_said() -> None:
    async def scenario() -> None:
        watch = Watch("live", Told())
        await watch.on_flight(flies=True)
        assert await said(watch) is None
        await watch.on_map(flight_map(FAR))
        assert await said(watch) is None, "far from the line"
        watch.on_status(status("vision", divergence_m=295.0))
        assert await said(watch) == SEEN_BEFORE, "the camera's path and GNSS have parted so far"
        watch.on_status(status("vision", divergence_m=1.0))
        await watch.on_map(flight_map(MAST, explained=1, revision=2))
        assert await said(watch) is None, "the surface model knows it"
        await watch.on_map(flight_map(MAST, revision=3))
        assert await said(watch) == SEEN_BEFORE
        await watch.on_map(frame(MAST))
        assert await said(watch) is None, "the newest frame shows it: it counts"
        await watch.on_map(frame(FAR))
        assert await said(watch) == SEEN_BEFORE, "the nose has turned away"

    asyncio.run(scenario())


def test_a_new_part_of_the_flights_map_hides_nothing_until_the_maps_are_emptied() -> None:
    async def scenario() -> None:
        watch = Watch("live", Told())
        await watch.on_flight(flies=True)
        await watch.on_map(flight_map(MAST))
        await watch.on_map(flight_map(FAR, began_mono_s=2.0))
        assert await said(watch) == SEEN_BEFORE
        await watch.dismiss(1)
        assert await said(watch) is None

    asyncio.run(scenario())


def test_where_not_all_of_it_is_here_that_is_said() -> None:
    async def scenario() -> None:
        watch = Watch("live", Told())
        await watch.on_flight(flies=True)
        await watch.on_map(flight_map(FAR, parts=2))
        assert await said(watch) == SEEN_BEFORE_LOST
        await watch.on_map(flight_map(MAST, parts=2, part=1))
        assert await said(watch) == SEEN_BEFORE

    asyncio.run(scenario())
