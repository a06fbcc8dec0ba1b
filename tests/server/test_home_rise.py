"""How high home lies over the planned one, for floor and ceiling: what makes it void, and what does not."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from server.flying.uploading.fence_heights_desk import NOT_CHECKED, FenceHeights
from server.schemas import FenceDoc
from server.work.jobs import Lane
from telemetry.topics.messages import LinkStatus
from tests.server.flying_desk_bench import ME, QUAD, Bench, Made

pytestmark = pytest.mark.xdist_group("flying-desk")
CEILING_M = 60.0


def test_it_survives_parameters_that_are_written_and_nothing_else(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    """Or the second of two writings of floor and ceiling would take home for the planned one."""

    def other_vehicle(bench: Bench) -> None:
        other = replace(QUAD, id="udp/2/1", system_id=2)
        bench.desk.on_link(LinkStatus(time.monotonic(), adopted=other, state="live"))

    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        assert bench.desk.home_rises_m is None
        await bench.desk.upload(ME, 3)
        bench.live.state = made.standing(north_m=14.0)
        voids: tuple[Callable[[Bench], None], ...] = (
            lambda it: it.desk.on_disarmed(), lambda it: it.desk.on_home_set(), other_vehicle,
        )  # fmt: skip
        for void in voids:
            state = await bench.desk.check(ME)
            assert state.preflight is not None
            rises_m = bench.desk.home_rises_m
            assert rises_m is not None
            assert abs(rises_m) > 0.3
            bench.desk.on_parameters()
            assert bench.desk.state.preflight is None
            assert bench.desk.home_rises_m == rises_m
            void(bench)
            assert bench.desk.home_rises_m is None

    runner.run(scenario())


def test_a_ceiling_that_is_looked_at_again_after_a_writing_is_moved_as_before(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        plan = bench.plan.document.model_copy(update={"fence": FenceDoc(ceiling_rel_home_m=CEILING_M)})
        bench.plan = bench.plan.model_copy(update={"document": plan})
        bench.vehicle.parameters |= {
            "FENCE_ENABLE": 0.0, "FENCE_TYPE": 0.0, "FENCE_ACTION": 1.0, "FENCE_ALT_MAX": 100.0,
            "FENCE_ALT_MIN": -10.0, "FENCE_MARGIN": 2.0,
        }  # fmt: skip
        await bench.desk.upload(ME, 3)
        rising = next(m for m in (14.0, -14.0, 25.0) if _rises_m(made, m) > 0.5)
        bench.live.state = made.standing(north_m=rising)
        link: Any = bench.vehicle
        live: Any = bench.live
        heights = FenceHeights(
            link, live, bench.aboard, lambda: bench.desk.home_rises_m, lambda written: bench.desk.on_parameters()
        )
        assert NOT_CHECKED in (await heights.look()).notes
        await bench.desk.check(ME)
        shown = await heights.look()
        top_m = shown.changes[0].after
        assert (shown.changes[0].name, NOT_CHECKED in shown.notes) == ("FENCE_ALT_MAX", False)
        assert top_m == pytest.approx(CEILING_M - (bench.desk.home_rises_m or 0.0), abs=0.011)
        assert top_m < CEILING_M - 0.3
        bench.desk.on_parameters()
        again = await heights.look()
        assert (again.changes[0].after, NOT_CHECKED in again.notes) == (top_m, False)

    runner.run(scenario())


def _rises_m(made: Made, north_m: float) -> float:
    there, planned = made.standing(north_m=north_m).home_alt_amsl_m, made.standing().home_alt_amsl_m
    assert there is not None
    assert planned is not None
    return there - planned
