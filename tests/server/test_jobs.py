import asyncio
import os
import time

import pytest

from planning.errors import PoiError
from server.errors import JobCancelledError, WorkerDiedError
from server.jobs import Lane


def _double(value, *, report):
    report("half way", 0.5)
    return 2 * value


def _refuse(*, report):
    raise PoiError("POI 3 lies outside.", where="row 4", advice="Move it.")


def _die(*, report):
    os._exit(9)


def _sleep(seconds, *, report):
    report("asleep", None)
    time.sleep(seconds)


async def _with_lane(use):
    lane = Lane("test")
    try:
        return await use(lane)
    finally:
        await lane.close()


def test_answers_and_reports_progress():
    seen = []

    async def use(lane):
        return await lane.call(_double, 21, progress=lambda step, share: seen.append((step, share)))

    assert asyncio.run(_with_lane(use)) == 42
    assert seen == [("half way", 0.5)]


def test_planning_errors_cross_with_every_field():
    async def use(lane):
        with pytest.raises(PoiError) as caught:
            await lane.call(_refuse)
        return caught.value

    error = asyncio.run(_with_lane(use))
    assert (error.what, error.where, error.advice) == ("POI 3 lies outside.", "row 4", "Move it.")


def test_a_dead_worker_is_said_and_replaced():
    async def use(lane):
        with pytest.raises(WorkerDiedError):
            await lane.call(_die)
        return await lane.call(_double, 1)

    assert asyncio.run(_with_lane(use)) == 2


def test_cancel_ends_the_call_at_once_and_the_lane_goes_on():
    async def use(lane):
        started = asyncio.Event()
        task = asyncio.create_task(lane.call(_sleep, 60, progress=lambda *_: started.set()))
        await asyncio.wait_for(started.wait(), 30)
        lane.cancel()
        with pytest.raises(JobCancelledError):
            await asyncio.wait_for(task, 10)
        return await lane.call(_double, 3)

    assert asyncio.run(_with_lane(use)) == 6
