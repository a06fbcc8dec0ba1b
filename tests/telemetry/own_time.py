"""Time of a test's own: where everybody waits, the clock goes on to what is due next.

For coroutines that do all they test in one process, over real sockets. What a busy machine does not get done in time
is in time here: computing takes next to none. Threads that a test starts itself are not seen.
"""

from __future__ import annotations

import asyncio
import contextlib
import gc
import selectors
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from typing import Any, TypeVar
from unittest import mock

from tests.telemetry.bus_runs import bounded

REST_EVERY_S, REST_S = 0.025, 0.001
"""After so much time of its own, so much real time for what the kernel still carries from socket to socket."""
TURN_S = 1e-5
"""Of each turn of the loop: who answer each other for ever use up the test's time."""
HELD_UP_S = 0.5
"""A turn that computes for longer counts: nobody else is served meanwhile. What blocks without computing is seen in
real time alone (``bus_runs.run``)."""
T = TypeVar("T")


def run(whole: Callable[[], Awaitable[T]]) -> T:
    clock = _Clock()
    gc.freeze()  # to look through all that other tests left would hold up a turn
    try:
        with clock.told(), asyncio.Runner(loop_factory=lambda: _Loop(clock)) as runner:
            return runner.run(bounded(whole))
    finally:
        gc.unfreeze()


class _Clock:
    def __init__(self) -> None:
        self.now_s, self._real_s = time.monotonic(), time.monotonic
        self._utc_ahead_ns = time.time_ns() - round(self.now_s * 1e9)
        self._turned_s = time.thread_time()

    @contextlib.contextmanager
    def told(self) -> Iterator[None]:
        """To all who ask the time module."""
        told: dict[str, Callable[[], float]] = {
            "monotonic": lambda: self.now_s,
            "monotonic_ns": lambda: round(self.now_s * 1e9),
            "time": lambda: self._utc_ns() / 1e9,
            "time_ns": self._utc_ns,
        }
        with contextlib.ExitStack() as stack:
            for name, clock in told.items():
                stack.enter_context(mock.patch.object(time, name, clock))
            yield

    def _utc_ns(self) -> int:
        return round(self.now_s * 1e9) + self._utc_ahead_ns

    def turn(self) -> None:
        """The loop has done what was due."""
        held_s = time.thread_time() - self._turned_s
        self.now_s += held_s if held_s > HELD_UP_S else TURN_S

    def turned(self) -> None:
        self._turned_s = time.thread_time()

    @contextlib.contextmanager
    def as_real(self) -> Iterator[None]:
        """It goes on by the time that the block really takes."""
        began_s = self._real_s()
        yield
        self.now_s += self._real_s() - began_s


class _Loop(asyncio.SelectorEventLoop):
    def __init__(self, clock: _Clock) -> None:
        self._selecting = _Selector(clock)
        super().__init__(self._selecting)
        self._threads = ThreadPoolExecutor()
        self.set_default_executor(self._threads)

    def run_in_executor(self, executor: Executor | None, func: Callable[..., T], *args: Any) -> asyncio.Future[T]:
        """Counted until it is done, also where nobody waits for it any more."""
        done = (executor or self._threads).submit(func, *args)
        self._selecting.working.add(done)
        done.add_done_callback(self._has_ended)
        return asyncio.wrap_future(done, loop=self)

    def _has_ended(self, done: Future[Any]) -> None:
        """In its thread."""
        self._selecting.working.discard(done)
        with contextlib.suppress(RuntimeError):  # the loop has ended before
            self.call_soon_threadsafe(lambda: None)


class _Selector(selectors.DefaultSelector):
    """Waits for sockets as others do, but not for the clock."""

    def __init__(self, clock: _Clock) -> None:
        super().__init__()
        self._clock, self._rested_s = clock, clock.now_s
        self.working = set[Future[Any]]()

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        self._clock.turn()
        try:
            return self._select(timeout)
        finally:
            self._clock.turned()

    def _select(self, timeout: float | None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None or self.working:  # a thread's work takes as long as it takes
            with self._clock.as_real():
                return super().select(timeout)
        until_s = self._clock.now_s + timeout
        ready = super().select(0)
        while not ready and self._clock.now_s < until_s:
            self._clock.now_s = min(until_s, self._rested_s + REST_EVERY_S)
            if self._clock.now_s >= self._rested_s + REST_EVERY_S:
                self._rested_s = self._clock.now_s
                ready = super().select(REST_S)
        return ready
