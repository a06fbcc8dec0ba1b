"""Pieces of work in a few threads, a few ahead of who takes the answers: memory is bounded, order is kept."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
R = TypeVar("R")


def ahead(function: Callable[[A], R], pieces: Iterable[A], threads: int) -> Iterator[R]:
    """``function`` of each piece, in order; at most ``threads`` pieces are held besides the one being made.

    Raises what ``function`` raises; what was begun then, or when nobody takes the rest, is brought to its end first.
    """
    waiting: deque[Future[R]] = deque()
    with ThreadPoolExecutor(threads) as pool:
        try:
            for piece in pieces:
                waiting.append(pool.submit(function, piece))
                del piece
                if len(waiting) >= threads:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()


class Behind:
    """Calls that go on in a few threads behind who makes them; no more than ``threads`` are unfinished."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads)
        self._waiting: deque[Future[None]] = deque()

    def call(self, function: Callable[..., None], *given: object) -> None:
        """Waits where too many are unfinished. Raises what an earlier one raised."""
        self._waiting.append(self._pool.submit(function, *given))
        if len(self._waiting) >= self._threads:
            self._waiting.popleft().result()

    def finish(self) -> None:
        """Returns once all are done. Raises what one of them raised."""
        while self._waiting:
            self._waiting.popleft().result()

    def __enter__(self) -> Behind:
        return self

    def __exit__(self, *about: object) -> None:
        self._pool.shutdown(cancel_futures=True)
