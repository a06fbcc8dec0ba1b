"""Time of a test's own: where everybody waits, the clock goes on to what is due next.

For coroutines that do all they test in one process, over real sockets. What a busy machine does not get done in time
is in time here: computing takes none.
"""

from __future__ import annotations

import asyncio
import contextlib
import selectors
import time
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import Executor
from typing import Any, TypeVar
from unittest import mock

from tests.telemetry.bus_runs import bounded

REST_EVERY_S, REST_S = 0.025, 0.001
"""After so much time of its own, so much real time for what the kernel still carries from socket to socket."""
T = TypeVar("T")


def run(whole: Callable[[], Awaitable[T]]) -> T:
    clock = _Clock()
    with clock.told(), asyncio.Runner(loop_factory=lambda: _Loop(clock)) as runner:
        return runner.run(bounded(whole))


class _Clock:
    def __init__(self) -> None:
        self.now_s, self._real_s = time.monotonic(), time.monotonic
        self._utc_ahead_ns = time.time_ns() - round(self.now_s * 1e9)

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

    def run_in_executor(self, executor: Executor | None, func: Callable[..., T], *args: Any) -> asyncio.Future[T]:
        done = super().run_in_executor(executor, func, *args)
        self._selecting.threads += 1
        done.add_done_callback(self._has_ended)
        return done

    def _has_ended(self, _: asyncio.Future[Any]) -> None:
        self._selecting.threads -= 1


class _Selector(selectors.DefaultSelector):
    """Waits for sockets as others do, but not for the clock."""

    def __init__(self, clock: _Clock) -> None:
        super().__init__()
        self._clock, self._rested_s, self.threads = clock, clock.now_s, 0

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is None or self.threads:  # a thread's work takes as long as it takes
            with self._clock.as_real():
                return super().select(timeout)
        if (ready := super().select(0)) or timeout <= 0:
            return ready
        if self._clock.now_s + timeout - self._rested_s > REST_EVERY_S:
            self._rested_s = self._clock.now_s + timeout
            if ready := super().select(REST_S):
                return ready
        self._clock.now_s += timeout
        return []
