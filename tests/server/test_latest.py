"""A slider that is dragged asks for many frames: those it has left behind are not worked out."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from server.errors import JobCancelledError
from server.studies.latest import Latest


class SlowLane:
    """Answers when it is let; keeps what it was asked."""

    def __init__(self) -> None:
        self.asked: list[int] = []
        self.go_on = asyncio.Event()
        self.cancelled = 0

    async def call(self, function: Any, number: int) -> int:
        self.asked.append(number)
        await self.go_on.wait()
        if self.cancelled:
            self.cancelled -= 1
            raise JobCancelledError("The job was cancelled.")
        return number

    def cancel(self) -> None:
        self.cancelled += 1
        self.go_on.set()


def nothing() -> None:
    """Stands for a job."""


async def asked(latest: Latest, page: str, number: int) -> asyncio.Task[Any]:
    task = asyncio.create_task(latest.call(page, nothing, number))
    await asyncio.sleep(0)
    return task


def test_what_a_page_has_left_behind_is_dropped_before_its_turn() -> None:
    async def run() -> None:
        lane: Any = SlowLane()
        latest = Latest(lane)
        tasks = [await asked(latest, "a", number) for number in range(4)]
        other = await asked(latest, "b", 9)
        lane.go_on.set()
        found = await asyncio.gather(*tasks, other, return_exceptions=True)
        assert [found[0], found[3], found[4]] == [0, 3, 9]
        assert all(isinstance(one, JobCancelledError) for one in found[1:3])
        assert lane.asked == [0, 3, 9]
        assert await latest.call("a", nothing, 5) == 5

    asyncio.run(run())


def test_a_call_that_takes_long_is_ended_by_the_next_of_its_page_alone() -> None:
    async def run() -> None:
        lane: Any = SlowLane()
        latest = Latest(lane, supersede_after_s=-1.0)
        first = await asked(latest, "a", 0)
        other = await asked(latest, "b", 1)
        assert lane.cancelled == 0
        second = await asked(latest, "a", 2)
        with pytest.raises(JobCancelledError):
            await first
        assert await other == 1
        assert await second == 2

    asyncio.run(run())
