"""Kinds of the fence that may not act: judged as they are after the reading, and held against the start."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from server.errors import CheckNeededError
from server.flying.check_task import Checked
from server.flying.starting import Ready, check_start
from server.schemas import PreflightDoc, StartFlight
from server.work.jobs import Lane
from telemetry.topics.obstacles import AvoidanceStatus
from telemetry.topics.requests import ReadParameters
from tests.server.flying_desk_bench import ME, Bench, Made

CEILING = 1


def test_kinds_that_the_checks_own_reading_shows_are_in_its_row(
    made: Made, lanes: tuple[Lane, Lane], runner: asyncio.Runner, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def scenario() -> None:
        bench = Bench(made, tmp_path / "onboard.json", lanes)
        bench.vehicle.parameters |= {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 5.0, "FENCE_ALT_MAX": 90.0}
        await bench.desk.upload(ME, 3)
        bench.live.state = made.standing()
        answered = bench.vehicle.call

        async def call(request: Any) -> Any:
            answer = await answered(request)
            if isinstance(request, ReadParameters):
                bench.live.state = replace(bench.live.state, fence_kinds_untaken=CEILING)
            return answer

        monkeypatch.setattr(bench.vehicle, "call", call)
        state = await bench.desk.check(ME)
        assert state.preflight is not None
        (row,) = [row for row in state.preflight.rows if row.code == "fence"]
        assert row.state == "accept"
        assert "given more kinds while the fence is on (ceiling)" in row.text

    runner.run(scenario())


def test_a_start_is_refused_where_they_have_changed_since_the_check(made: Made) -> None:
    state = made.standing()
    doc = PreflightDoc(
        ok=True, rows=[], home_shift_m=None, rereferenced=False, min_distance_m=None, checked_utc="2026-01-01T00:00:00Z"
    )
    ready = Ready(Checked(doc, "", None), "digest", "vehicle", state, 100.0)
    body = StartFlight(way="auto", digest="digest", accept=["avoidance"])

    def start(untaken: int) -> None:
        now = replace(state, fence_kinds_untaken=untaken)
        check_start(ready, body, now, AvoidanceStatus(), None, now_mono_s=101.0, utc_minus_mono_s=0.0)

    with pytest.raises(CheckNeededError, match=r"Which kinds of the vehicle's fence act has changed") as raised:
        start(CEILING)
    assert raised.value.advice == "Press Check again."
    start(0)
