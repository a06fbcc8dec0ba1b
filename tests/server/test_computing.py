"""Answers follow the document: the latest wins, long ones are superseded, errors end nothing. Real workers."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from planning.errors import ParameterError
from server.errors import NotFoundError
from server.plan import tasks
from server.plan.computing import Computing
from server.schemas import Chart, Computation, PlanDoc, PoiDoc, ResultDoc, TradeRow
from server.work.jobs import Lane

POIS = [PoiDoc(id="a", lat_deg=1, lon_deg=2), PoiDoc(id="b", lat_deg=1, lon_deg=2.1)]
CHART = Chart(**{name: [] for name in Chart.model_fields})
RESULT = ResultDoc(
    certified=True,
    min_distance_m=5.0,
    min_vertical_m=6.0,
    required_clearance_m=3.0,
    worst=None,
    rtl_height_needed_m=20.0,
    rtl_height_m=30.0,
    home_column_clear=True,
    max_height_above_ground_m=9.0,
    reasons=[],
    warnings=[],
    length_m=100.0,
    duration_s=50.0,
    lspb_duration_s=45.0,
    endurance_s=1200.0,
    usable_endurance_s=900.0,
    samples=0,
    waypoints=3,
    items=5,
    max_items=650,
    excess_height_m=1.0,
    gsd_min_cm=None,
    gsd_max_cm=None,
    home_alt_dsm_m=100.0,
    vertical_datum=None,
    trade=[],
    chart=CHART,
    seconds={},
)
SOMEWHERE = Path("terrain")


def document(name: str, **changes: Any) -> PlanDoc:
    return PlanDoc(name=name, terrain_id="t", pois=POIS, **changes)


def fake_plan(directory: Path, doc: PlanDoc, *, report: Any) -> tuple[ResultDoc, str]:
    """Its name says what comes of it."""
    report("Planning", 0.0)
    if doc.name == "refused":
        raise ParameterError("Radius R is 0 m.", advice="Choose more.")
    if doc.name == "defect":
        raise ZeroDivisionError("a secret detail")
    if doc.name == "endless":
        report("Planning", 0.5)
        while True:
            report("Planning", None)
    return RESULT.model_copy(update={"samples": len(doc.name)}), f"scene of {doc.name}"


def fake_trade(directory: Path, doc: PlanDoc, *, report: Any) -> list[TradeRow]:
    report("Comparing", None)
    if doc.name == "no trade":
        raise ZeroDivisionError
    while doc.name == "endless trade":
        report("Comparing", None)
    return [TradeRow(excess_height_m=1.0, waypoints=3, items=5, duration_s=60.0)]


class Bench:
    """A computing loop at work; ``until`` waits for a change that fits."""

    def __init__(self, lane: Lane, terrain_dir: Callable[[str], Path], **delays: float) -> None:
        self._changed = asyncio.Event()
        library: Any = SimpleNamespace(terrain_dir=terrain_dir)
        self.computing = Computing(lane, library, changed=self._changed.set, **delays)

    async def until(self, fits: Callable[[Computation], bool]) -> Computation:
        async with asyncio.timeout(60):
            while not fits(self.computing.state):
                self._changed.clear()
                await self._changed.wait()
        return self.computing.state

    async def answer(self, revision: int) -> Computation:
        return await self.until(lambda state: state.revision == revision and state.state in ("ready", "error"))


Use = Callable[[Bench], Awaitable[None]]
Run = Callable[..., None]


@pytest.fixture(autouse=True)
def _fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "compute_plan", fake_plan)
    monkeypatch.setattr(tasks, "compute_trade", fake_trade)


@pytest.fixture(scope="module")
def runner() -> Iterator[asyncio.Runner]:
    with asyncio.Runner() as runner:
        yield runner


@pytest.fixture(scope="module")
def lane(runner: asyncio.Runner) -> Iterator[Lane]:
    """One for all: a worker takes seconds to start."""
    lane = Lane("test")
    yield lane
    runner.run(lane.close())


@pytest.fixture
def run(runner: asyncio.Runner, lane: Lane) -> Run:
    def run(use: Use, terrain_dir: Any = lambda _: SOMEWHERE, **delays: float) -> None:
        async def whole() -> None:
            bench = Bench(lane, terrain_dir, **{"trade_when_idle_s": 0.0, "supersede_after_s": 0.0, **delays})
            loop = asyncio.create_task(bench.computing.run())
            try:
                await use(bench)
                assert not loop.done()
            finally:
                loop.cancel()
                await asyncio.gather(loop, return_exceptions=True)

        runner.run(whole())

    return run


def test_an_answer_arrives_and_the_trade_after_it(run: Run) -> None:
    async def use(bench: Bench) -> None:
        bench.computing.request(1, document("abc"))
        assert bench.computing.state.state == "running"
        ready = await bench.answer(1)
        assert ready.result is not None
        assert (ready.result.samples, bench.computing.scene) == (3, "scene of abc")
        traded = await bench.until(lambda state: state.result is not None and bool(state.result.trade))
        assert traded.result is not None
        assert traded.result.trade[0].waypoints == 3

    run(use)


def test_errors_are_answers_and_the_next_document_is_computed(run: Run) -> None:
    async def use(bench: Bench) -> None:
        for revision, (name, code) in enumerate([("refused", "parameter"), ("defect", "internal")], start=1):
            bench.computing.request(revision, document(name))
            answer = await bench.answer(revision)
            assert answer.error is not None
            assert (answer.error.code, bench.computing.scene) == (code, None)
            assert "secret" not in answer.model_dump_json()
        bench.computing.request(3, document("fine"))
        assert (await bench.answer(3)).state == "ready"

    run(use)


def test_a_failing_trade_leaves_the_plan(run: Run) -> None:
    async def use(bench: Bench) -> None:
        bench.computing.request(1, document("no trade"))
        await bench.answer(1)
        bench.computing.request(2, document("next"))
        assert (await bench.answer(2)).state == "ready"

    run(use)


@pytest.mark.parametrize("name", ["endless", "endless trade"])
def test_what_runs_long_is_superseded(run: Run, name: str) -> None:
    async def use(bench: Bench) -> None:
        bench.computing.request(1, document(name))
        async with asyncio.timeout(60):
            while bench.computing._started_mono_s is None or (name != "endless" and bench.computing.scene is None):
                await asyncio.sleep(0.01)
        bench.computing.request(2, document("newer"))
        answer = await bench.answer(2)
        assert (answer.state, bench.computing.scene) == ("ready", "scene of newer")

    run(use)


def test_of_many_requests_the_last_is_answered(run: Run) -> None:
    async def use(bench: Bench) -> None:
        seen: list[int] = []
        for revision in range(1, 8):
            bench.computing.request(revision, document("x" * revision))
        seen.append((await bench.answer(7)).revision)
        assert bench.computing.scene == "scene of xxxxxxx"
        assert seen == [7]

    run(use, supersede_after_s=60.0)


def test_the_last_answer_stays_in_sight_until_another_plan_is_opened(run: Run) -> None:
    async def use(bench: Bench) -> None:
        bench.computing.request(1, document("abc"))
        await bench.answer(1)
        bench.computing.request(2, document("abcd"))
        assert bench.computing.state.result is not None
        assert bench.computing.scene == "scene of abc"
        bench.computing.request(3, document("other"), forget=True)
        assert (bench.computing.state.result, bench.computing.scene) == (None, None)
        bench.computing.request(4, PlanDoc())
        assert (bench.computing.state.state, bench.computing.scene) == ("empty", None)
        assert bench.computing.state.hint

    run(use)


def test_a_model_that_is_gone_is_said(run: Run) -> None:
    def nowhere(terrain_id: str) -> Path:
        raise NotFoundError(f"There is no surface model {terrain_id!r}.")

    async def use(bench: Bench) -> None:
        bench.computing.request(1, document("abc"))
        answer = await bench.answer(1)
        assert answer.error is not None
        assert answer.error.what == "The surface model of this plan has been deleted."

    run(use, nowhere)
