"""Guesses of passwords: they wait, one at a time, are remembered within bounds, and refuse nobody else."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import pytest

from server.door.tries import FROM_ONE_PLACE_MAX, IN_LINE_MAX, REMEMBERED_MAX, WRONG_MAX, Tries, place_of
from server.errors import TooManyTriesError

HERE, THERE = "192.0.2.1", "198.51.100.7"


class Waits:
    """Tries on a clock of their own, where ``waited`` counts those that were made to wait."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.tries, self.waited = Tries(clock_mono_s=lambda: 0.0, wait_s=0.001), 0
        sleep = asyncio.sleep

        async def slept(seconds: float) -> None:
            self.waited += 1
            await sleep(seconds)

        monkeypatch.setattr(asyncio, "sleep", slept)

    async def guess(self, address: str, *, right: bool = False, known: bool = False, name: str = "anna") -> bool:
        return await self.tries.check(address, name, known=known, matches=lambda: right)


@pytest.fixture
def waits(monkeypatch: pytest.MonkeyPatch) -> Waits:
    return Waits(monkeypatch)


def test_wrong_ones_make_the_next_from_there_wait_and_refuse_nobody(waits: Waits) -> None:
    async def whole() -> list[int]:
        counted = []
        for _ in range(WRONG_MAX + 2):
            assert not await waits.guess(HERE)
        counted.append(waits.waited)
        assert await waits.guess(THERE, right=True)
        counted.append(waits.waited)
        assert await waits.guess(HERE, right=True)  # the operator beside the guesser: later, but in
        counted.append(waits.waited)
        assert await waits.guess(HERE, right=True)
        return [*counted, waits.waited]

    assert asyncio.run(whole()) == [2, 2, 3, 3]


def test_guesses_from_everywhere_hold_up_no_address_that_the_account_is_known_at(waits: Waits) -> None:
    async def whole() -> tuple[int, int]:
        for k in range(40):
            await waits.guess(f"203.0.113.{k}")
        before = waits.waited
        assert await waits.guess(HERE, right=True, known=True)
        assert await waits.guess(THERE, right=True, name="ben")
        known = waits.waited - before
        assert await waits.guess(THERE, right=True)
        return known, waits.waited - before - known

    assert asyncio.run(whole()) == (0, 1)


def test_a_flood_is_looked_at_one_at_a_time_and_bounded(waits: Waits) -> None:
    at_once = most = 0

    def slow() -> bool:
        nonlocal at_once, most
        at_once += 1
        most = max(most, at_once)
        at_once -= 1
        return False

    async def whole() -> list[Any]:
        flood = [waits.tries.check(f"10.0.{k // 250}.{k % 250}", "anna", known=False, matches=slow) for k in range(300)]
        asked = asyncio.gather(*flood, return_exceptions=True)
        await asyncio.sleep(0)
        assert await waits.guess(HERE, right=True, known=True)
        return await asked

    ended = asyncio.run(whole())
    assert most == 1
    assert sum(isinstance(each, TooManyTriesError) for each in ended) >= 300 - IN_LINE_MAX


def test_guesses_of_clients_that_go_away_are_not_looked_at_beside_each_other(waits: Waits) -> None:
    """Each takes its memory until it is done, whoever has gone meanwhile."""
    go_on, began = threading.Event(), threading.Semaphore(0)
    at_once = most = 0

    def held() -> bool:
        nonlocal at_once, most
        at_once += 1
        most = max(most, at_once)
        began.release()
        assert go_on.wait(60)
        at_once -= 1
        return False

    async def whole() -> bool:
        gone = []
        for k in range(4):
            gone.append(asyncio.ensure_future(waits.tries.check(f"203.0.113.{k}", "anna", known=False, matches=held)))
            if k == 0:
                await asyncio.to_thread(began.acquire)
            await asyncio.sleep(0)
            gone[-1].cancel()
        await asyncio.gather(*gone, return_exceptions=True)
        right = asyncio.ensure_future(waits.guess(HERE, right=True))
        done, _ = await asyncio.wait([right], timeout=0.2)
        assert not done, "looked at beside the one that is still under way"
        go_on.set()
        return await right

    assert asyncio.run(whole())
    assert most == 1


def test_one_address_cannot_stand_in_line_for_all(waits: Waits) -> None:
    async def whole() -> list[Any]:
        return await asyncio.gather(*(waits.guess(HERE) for _ in range(10)), return_exceptions=True)

    assert sum(each is False for each in asyncio.run(whole())) == FROM_ONE_PLACE_MAX


def test_what_is_remembered_of_guessers_is_bounded(waits: Waits) -> None:
    async def whole() -> None:
        for k in range(REMEMBERED_MAX + 50):
            await waits.guess(f"2001:db8:{k:x}::1", name=f"name {k}")

    asyncio.run(whole())
    assert len(waits.tries._wrong) == REMEMBERED_MAX


def test_an_ipv6_host_is_one_place() -> None:
    assert place_of("2001:db8::1") == place_of("2001:db8::ffff:1")
    assert place_of("2001:db8:0:1::1") != place_of("2001:db8::1")
    assert place_of("::ffff:192.0.2.1") == place_of("192.0.2.1")
    assert place_of("nonsense") == place_of("")
