"""A TCP line that is slow, far and lossy, in user space: what crosses it is whole and in order, and late.

The kernel here has no netem. Loss is therefore played as TCP shows it to those who use it: of every hundred segments
some hold up all that come after them until they have been sent again, one round trip later or, for one in five of
them, after a whole retransmission timeout.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
from collections import Counter, deque
from dataclasses import dataclass

SEGMENT_BYTES, HEADERS_BYTES = 1400, 40
"""Of TCP and IPv4, on each segment."""
_TIMEOUT_SHARE, _TIMEOUT_S = 0.2, 0.6


@dataclass(frozen=True, slots=True)
class Bad:
    delay_s: float = 0.1
    """One way, of each of the two lines between stations and their router."""
    loss: float = 0.05
    bytes_per_s: float = 32_000.0
    """Each way"""


class BadLine:
    """Listens on ``port``, leads to ``target``; ``carried`` counts bytes with their headers, "up" and "down"."""

    def __init__(self, target: int, bad: Bad, seed: int) -> None:
        self._target, self._bad, self._drawn = target, bad, random.Random(seed)
        self.carried = Counter[str]()
        self.port = 0
        self._server: asyncio.Server | None = None

    async def open(self) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        self.port = self._server.sockets[0].getsockname()[1]

    def close(self) -> None:
        if self._server is not None:
            self._server.close()

    async def _serve(self, near_in: asyncio.StreamReader, near_out: asyncio.StreamWriter) -> None:
        """Both ends are closed also where the loop ends meanwhile: nobody else would close their sockets."""
        outs, tasks = [near_out], list[asyncio.Future[None]]()
        try:
            with contextlib.suppress(OSError, asyncio.IncompleteReadError):
                far_in, far_out = await asyncio.open_connection("127.0.0.1", self._target)
                outs.append(far_out)
                ways = [self._carry(near_in, far_out, "up"), self._carry(far_in, near_out, "down")]
                tasks += [asyncio.ensure_future(way) for way in ways]
                await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
                for task in tasks:
                    task.cancel()
                await asyncio.gather(*tasks, return_exceptions=True)
        except asyncio.CancelledError:
            for out in outs:
                out.transport.abort()
            raise
        finally:
            for out in outs:
                out.close()

    async def _carry(self, source: asyncio.StreamReader, sink: asyncio.StreamWriter, way: str) -> None:
        """Read at the line's rate, so that what is too much waits at its sender, as it does on a real line."""
        clock, under_way, ready = asyncio.get_running_loop().time, deque[tuple[float, bytes]](), asyncio.Event()

        async def deliver() -> None:
            while True:
                await ready.wait()
                if not under_way:
                    ready.clear()
                    continue
                due_s, data = under_way.popleft()
                await asyncio.sleep(max(0.0, due_s - clock()))
                sink.write(data)
                await sink.drain()

        delivering = asyncio.ensure_future(deliver())
        last_s = 0.0
        try:
            while data := await source.read(SEGMENT_BYTES):
                size = len(data) + HEADERS_BYTES
                self.carried[way] += size
                last_s = max(last_s, clock() + self._bad.delay_s + self._held_s())
                under_way.append((last_s, data))
                ready.set()
                await asyncio.sleep(size / self._bad.bytes_per_s)
        finally:
            delivering.cancel()
            await asyncio.gather(delivering, return_exceptions=True)

    def _held_s(self) -> float:
        """What a segment and all behind it wait for, because it was lost."""
        if self._drawn.random() >= self._bad.loss:
            return 0.0
        return _TIMEOUT_S if self._drawn.random() < _TIMEOUT_SHARE else 2.0 * self._bad.delay_s
