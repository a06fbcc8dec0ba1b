import asyncio
import errno
import os
import socket
import sys
import time
from pathlib import Path

import pytest

from planning.errors import PoiError
from planning.terrain.rasters.confinement import what_holds
from server.errors import BusyError, JobCancelledError, WorkerDiedError
from server.work.jobs import Lane


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


async def _with_own_lane(use):
    lane = Lane("test")
    try:
        return await use(lane)
    finally:
        await lane.close()


@pytest.fixture(scope="module")
def with_lane():
    """Runs with one lane for all: a worker takes seconds to start."""
    with asyncio.Runner() as runner:
        lane = Lane("test")
        yield lambda use: runner.run(use(lane))
        runner.run(lane.close())


def test_answers_and_reports_progress(with_lane):
    seen = []

    async def use(lane):
        return await lane.call(_double, 21, progress=lambda step, share: seen.append((step, share)))

    assert with_lane(use) == 42
    assert seen == [("half way", 0.5)]


def test_planning_errors_cross_with_every_field(with_lane):
    async def use(lane):
        with pytest.raises(PoiError) as caught:
            await lane.call(_refuse)
        return caught.value

    error = with_lane(use)
    assert (error.what, error.where, error.advice) == ("POI 3 lies outside.", "row 4", "Move it.")


def test_a_dead_worker_is_said_and_replaced(with_lane):
    async def use(lane):
        with pytest.raises(WorkerDiedError):
            await lane.call(_die)
        return await lane.call(_double, 1)

    assert with_lane(use) == 2


def test_cancel_ends_the_call_at_once_and_the_lane_goes_on(with_lane):
    async def use(lane):
        started = asyncio.Event()
        task = asyncio.create_task(lane.call(_sleep, 60, progress=lambda *_: started.set()))
        await asyncio.wait_for(started.wait(), 30)
        lane.cancel()
        with pytest.raises(JobCancelledError):
            await asyncio.wait_for(task, 60)
        return await lane.call(_double, 3)

    assert with_lane(use) == 6


def _raise_os_error(*, report):
    raise FileNotFoundError(2, "No such file", "elevation.npy")


class _StubbornError(Exception):
    def __init__(self, one, two):
        super().__init__(one)


def _raise_what_does_not_unpickle(*, report):
    raise _StubbornError(1, 2)


def _exhaust(*, report):
    raise MemoryError


def _pid(*, report):
    return os.getpid()


def _modules(*, report):
    return sorted(sys.modules)


def test_an_error_of_the_job_is_not_the_death_of_the_worker(with_lane):
    async def use(lane):
        first = await lane.call(_pid)
        with pytest.raises(FileNotFoundError) as caught:
            await lane.call(_raise_os_error)
        assert any("_raise_os_error" in note for note in caught.value.__notes__)
        with pytest.raises(RuntimeError, match="_StubbornError: 1"):
            await lane.call(_raise_what_does_not_unpickle)
        with pytest.raises(WorkerDiedError, match="not enough memory"):
            await lane.call(_exhaust)
        return first, await lane.call(_pid)

    first, last = with_lane(use)
    assert first == last


def test_a_cancel_before_the_worker_is_up_counts():
    async def use(lane):
        task = asyncio.create_task(lane.call(_sleep, 60))
        while not lane.running:
            await asyncio.sleep(0)
        lane.cancel()
        with pytest.raises(JobCancelledError):
            await asyncio.wait_for(task, 30)
        return await lane.call(_double, 3)

    assert asyncio.run(_with_own_lane(use)) == 6


def test_a_failing_progress_does_not_shift_the_answers(with_lane):
    def refuse(step, share):
        raise KeyError(step)

    async def use(lane):
        with pytest.raises(KeyError):
            await lane.call(_double, 1, progress=refuse)
        return await lane.call(_double, 5)

    assert with_lane(use) == 10


def test_an_abandoned_call_does_not_shift_the_answers(with_lane):
    async def use(lane):
        started = asyncio.Event()
        task = asyncio.create_task(lane.call(_sleep, 60, progress=lambda *_: started.set()))
        await started.wait()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        return await lane.call(_double, 4)

    assert with_lane(use) == 8


def test_closing_ends_the_running_call_and_refuses_the_waiting_one():
    async def whole():
        lane = Lane("test")
        started = asyncio.Event()
        running = asyncio.create_task(lane.call(_sleep, 60, progress=lambda *_: started.set()))
        waiting = asyncio.create_task(lane.call(_double, 1))
        await started.wait()
        await lane.close()
        return await asyncio.gather(running, waiting, lane.call(_double, 2), return_exceptions=True)

    assert [type(error) for error in asyncio.run(whole())] == [JobCancelledError, BusyError, BusyError]


def test_a_worker_does_not_load_what_only_the_server_needs(with_lane):
    async def use(lane):
        return await lane.call(_modules)

    assert not {"viser", "uvicorn", "typer"} & set(with_lane(use))


def _secrets_and_connections(port, *, report):
    tried = []
    for family, address in ((socket.AF_INET, ("127.0.0.1", port)), (socket.AF_UNIX, "\0nobody")):
        try:
            socket.socket(family).connect(address)
            tried.append("connected")
        except OSError as error:
            tried.append(error.errno)
    try:
        theirs = Path(f"/proc/{os.getppid()}/environ").read_bytes()
    except OSError:
        theirs = b""
    return os.environ.get("HEDGEHOP_PASSWORD"), tried, b"hunter2hunter2" in theirs


def test_a_worker_has_no_secrets_and_no_connections(monkeypatch):
    monkeypatch.setenv("HEDGEHOP_PASSWORD", "hunter2hunter2")
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        password, tried, seen = asyncio.run(_with_own_lane(lambda lane: lane.call(_secrets_and_connections, port)))
    assert password is None
    assert not seen
    assert tried == [errno.EPERM, errno.EPERM] or not what_holds().calls
