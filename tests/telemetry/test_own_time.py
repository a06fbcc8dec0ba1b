"""Tests that wait for each other alone: their clock goes on by itself, and sockets and threads come before it."""

import asyncio
import socket
import time

import pytest

from tests.telemetry import bus_runs
from tests.telemetry.own_time import REST_EVERY_S, REST_S, run


def test_waiting_takes_no_time_and_every_clock_agrees() -> None:
    async def whole() -> tuple[float, float, float]:
        mono_s, utc_s, loop_s = time.monotonic(), time.time(), asyncio.get_running_loop().time()
        await asyncio.sleep(bus_runs.PATIENCE_S / 2)
        ns = time.time_ns() / 1e9
        assert ns == pytest.approx(time.time(), abs=1e-3)
        assert time.monotonic_ns() / 1e9 == pytest.approx(time.monotonic(), abs=1e-3)
        return time.monotonic() - mono_s, time.time() - utc_s, asyncio.get_running_loop().time() - loop_s

    real_s = time.thread_time()
    passed = run(whole)
    assert passed == pytest.approx((bus_runs.PATIENCE_S / 2,) * 3, abs=1e-3)
    assert time.thread_time() - real_s < bus_runs.PATIENCE_S / 4


def test_the_real_clock_is_back_afterwards() -> None:
    clocks = (time.monotonic, time.monotonic_ns, time.time, time.time_ns)

    async def broken() -> None:
        assert time.monotonic is not clocks[0]
        raise ValueError("as any test may")

    with pytest.raises(ValueError, match="as any test may"):
        run(broken)
    assert (time.monotonic, time.monotonic_ns, time.time, time.time_ns) == clocks


def test_what_is_due_comes_in_its_order() -> None:
    async def whole() -> list[int]:
        came: list[int] = []

        async def after(tenths: int) -> None:
            await asyncio.sleep(tenths / 10)
            came.append(tenths)

        await asyncio.gather(*map(after, (7, 2, 50, 1)))
        return came

    assert run(whole) == [1, 2, 7, 50]


def test_what_is_on_its_way_through_a_socket_comes_before_the_clock_goes_on() -> None:
    async def whole() -> float:
        near, far = socket.socketpair()
        with near, far:
            for end in (near, far):
                end.setblocking(False)
            loop = asyncio.get_running_loop()
            began_s = loop.time()
            for _ in range(1000):
                receiving = asyncio.create_task(loop.sock_recv(far, 1))
                await asyncio.sleep(0)
                await loop.sock_sendall(near, b"x")
                async with asyncio.timeout(REST_EVERY_S / 1000):
                    assert await receiving == b"x"
            return loop.time() - began_s

    assert run(whole) == 0.0


def test_a_thread_s_work_takes_as_long_as_it_takes() -> None:
    async def whole() -> float:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        async with asyncio.timeout(bus_runs.PATIENCE_S / 2):
            await asyncio.to_thread(time.sleep, 20 * REST_S)
        return loop.time() - began_s

    assert 20 * REST_S <= run(whole) < bus_runs.PATIENCE_S / 2


def test_who_waits_for_what_never_comes_is_told_within_the_bound() -> None:
    with pytest.raises(TimeoutError):
        run(asyncio.Event().wait)
