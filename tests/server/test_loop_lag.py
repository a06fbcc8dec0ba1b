"""How late the loop is, by made-up clocks and by a loop that really is held up; and what an import does to it."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable

import pytest

from server.work.loop_lag import LONG_S, TICK_S, LoopLag

PATIENCE_S = 30.0


def test_what_comes_late_is_counted_and_what_comes_early_is_not() -> None:
    now = [0.0]
    meter = LoopLag(now_s=lambda: now[0])
    for late_s in [0.0] * 98 + [-0.005, 0.05]:
        now[0] += TICK_S + late_s
        meter.note(now[0])
    assert meter.lag.longest_s == pytest.approx(0.05)
    assert meter.lag.p99_s == pytest.approx(0.05)
    meter.note(now[0] + TICK_S)
    assert meter.lag.longest_utc


def test_the_loops_own_work_is_told_apart_from_a_busy_machine() -> None:
    now_s, worked_s = [0.0], [0.0]
    meter = LoopLag(now_s=lambda: now_s[0], worked_s=lambda: worked_s[0])
    for late_s, own_s in ((0.5, 0.001), (0.0, 0.012), (0.03, 0.004)):
        now_s[0] += TICK_S + late_s
        worked_s[0] += own_s
        meter.note(now_s[0])
    assert meter.lag.longest_s == pytest.approx(0.5)
    assert meter.lag.longest_work_s == pytest.approx(0.012)


def hold_up_the_loop(seconds: float, until: Callable[[], bool]) -> None:
    """For longer where the processor was elsewhere for so long that nobody could look."""
    started = time.monotonic()
    while (held_s := time.monotonic() - started) < seconds or (not until() and held_s < PATIENCE_S):
        pass


def test_what_holds_the_loop_up_is_named_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    async def use() -> LoopLag:
        meter = LoopLag()
        measuring = asyncio.create_task(meter.run())
        await asyncio.sleep(0.0)  # It measures, and nothing was late before: only the first in ten seconds is logged.
        hold_up_the_loop(4 * LONG_S, until=lambda: bool(meter.was_at))
        await asyncio.sleep(2 * TICK_S)
        measuring.cancel()
        return meter

    with caplog.at_level(logging.WARNING, "hedgehop.loop"):
        meter = asyncio.run(use())
    assert meter.lag.longest_s > 2 * LONG_S
    assert 0.0 < meter.lag.longest_work_s <= meter.lag.longest_s + TICK_S + 0.01
    assert "hold_up_the_loop" in caplog.text
    assert __file__ in caplog.text
