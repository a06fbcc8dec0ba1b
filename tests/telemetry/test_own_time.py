"""Tests that wait for each other alone: their clock goes on by itself, and sockets and threads come before it."""

import asyncio
import socket
import threading
import time

import pytest

from tests.telemetry import bus_runs
from tests.telemetry.own_time import HELD_UP_S, TURN_S, run


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
                async with asyncio.timeout(20 * TURN_S):
                    assert await receiving == b"x"
            return loop.time() - began_s

    assert run(whole) < 10_000 * TURN_S


def test_a_thread_s_work_takes_as_long_as_it_takes() -> None:
    async def whole() -> float:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        async with asyncio.timeout(bus_runs.PATIENCE_S / 2):
            await asyncio.to_thread(time.sleep, 1.0)
        return loop.time() - began_s

    # It is counted from when the loop waits, which a busy machine has it do later, but not each time.
    assert any(0.3 <= run(whole) < bus_runs.PATIENCE_S / 2 for _ in range(5))


def test_who_waits_for_what_never_comes_is_told_within_the_bound() -> None:
    with pytest.raises(TimeoutError):
        run(asyncio.Event().wait)


def test_who_holds_up_the_loop_is_late_as_he_really_is() -> None:
    held_s = HELD_UP_S + 0.1

    def compute() -> None:
        end_s = time.thread_time() + held_s
        while time.thread_time() < end_s:
            pass

    async def whole() -> float:
        began_s = time.monotonic()
        asyncio.get_running_loop().call_later(1.0, compute)
        await asyncio.sleep(2.0)
        return time.monotonic() - began_s

    assert run(whole) >= 1.0 + held_s


def test_who_answer_each_other_for_ever_are_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bus_runs, "PATIENCE_S", 0.2)

    async def whole() -> None:
        loop = asyncio.get_running_loop()

        def again() -> None:
            loop.call_soon(again)

        again()
        await asyncio.Event().wait()

    with pytest.raises(TimeoutError):
        run(whole)


def test_a_thread_that_nobody_waits_for_any_more_still_takes_its_time() -> None:
    given_up, ended = threading.Event(), threading.Event()

    def work() -> None:
        given_up.wait()
        time.sleep(0.2)
        ended.set()

    async def whole() -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.05):
                await asyncio.to_thread(work)
        given_up.set()
        await asyncio.sleep(10.0)
        assert ended.is_set()

    run(whole)
