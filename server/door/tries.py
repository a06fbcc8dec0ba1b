"""Passwords are tried one at a time, and wrong ones make the next ones from there wait.

Nobody is refused because others have guessed: who has guessed wrong waits longer, from a place whence this account has
signed in before nobody waits for what others have guessed, and the queues are bounded, so that a flood costs one
processor's time and little memory. The printed link needs none of this.
"""

from __future__ import annotations

import asyncio
import ipaddress
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from server.errors import TooManyTriesError

WRONG_MAX, WRONG_OF_ACCOUNT_MAX, WINDOW_S = 5, 20, 60.0
WAIT_S = 5.0
"""Before each further try is looked at."""
IN_LINE_MAX, WAITING_MAX, FROM_ONE_PLACE_MAX = 16, 64, 2
REMEMBERED_MAX = 1024
T = TypeVar("T")


class Tries:
    def __init__(self, *, clock_mono_s: Callable[[], float] = time.monotonic, wait_s: float = WAIT_S) -> None:
        self._clock_mono_s, self._wait_s = clock_mono_s, wait_s
        self._wrong: OrderedDict[str, deque[float]] = OrderedDict()
        self._under_way: dict[str, int] = {}
        self._in_line = {True: 0, False: 0}
        self._waiting = 0
        self._one_at_a_time = ThreadPoolExecutor(1, thread_name_prefix="passwords")
        """Whoever goes away meanwhile leaves its work in it: hashes never take their memory twice at once."""

    async def check(self, address: str, account: str, *, known: bool, matches: Callable[[], bool]) -> bool:
        """What ``matches`` says, called in a thread; ``known``: this account has come in from this address before.

        Raises TooManyTriesError where too many wait already.
        """
        place, of_account = f"from {place_of(address)}", f"of {account.casefold()}"
        if self._under_way.get(place, 0) >= FROM_ONE_PLACE_MAX:
            raise _too_many("from your address")
        self._under_way[place] = self._under_way.get(place, 0) + 1
        try:
            guessed_here = self._count(place) >= WRONG_MAX
            if guessed_here or (not known and self._count(of_account) >= WRONG_OF_ACCOUNT_MAX):
                await self._wait()
            right = await self._in_turn(matches, known=known)
        finally:
            self._under_way[place] -= 1
            if not self._under_way[place]:
                del self._under_way[place]
        if right:
            self._wrong.pop(place, None)
        else:
            self._note(place)
            self._note(of_account)
        return right

    async def _wait(self) -> None:
        if self._waiting >= WAITING_MAX:
            raise _too_many("after wrong ones")
        self._waiting += 1
        try:
            await asyncio.sleep(self._wait_s)
        finally:
            self._waiting -= 1

    async def _in_turn(self, matches: Callable[[], bool], *, known: bool) -> bool:
        if self._in_line[known] >= IN_LINE_MAX:
            raise _too_many("from everywhere")
        self._in_line[known] += 1
        try:
            return await self.alone(matches)
        finally:
            self._in_line[known] -= 1

    async def alone(self, work: Callable[[], T]) -> T:
        """What ``work`` says, which hashes a password: after those that stand in line."""
        return await asyncio.get_running_loop().run_in_executor(self._one_at_a_time, work)

    def _count(self, key: str) -> int:
        since = self._clock_mono_s() - WINDOW_S
        return sum(at >= since for at in self._wrong.get(key, ()))

    def _note(self, key: str) -> None:
        times = self._wrong.setdefault(key, deque(maxlen=WRONG_OF_ACCOUNT_MAX))
        times.append(self._clock_mono_s())
        self._wrong.move_to_end(key)
        if len(self._wrong) > REMEMBERED_MAX:
            self._wrong.popitem(last=False)


def place_of(address: str) -> str:
    """An IPv6 host has 2^64 addresses of its own."""
    try:
        parsed = ipaddress.ip_address(address.partition("%")[0])
    except ValueError:
        return "somewhere"
    if parsed.version == 6:
        return str(parsed.ipv4_mapped or ipaddress.ip_network((parsed, 64), strict=False))
    return str(parsed)


def _too_many(whence: str) -> TooManyTriesError:
    return TooManyTriesError(
        f"Too many passwords {whence} wait to be looked at.",
        advice="Try again in a few seconds, or open a sign-in link: hedgehop account link prints one.",
    )
