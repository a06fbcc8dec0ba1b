"""What Dask workers add to long studies: no cluster beside one worker and two, and a paper estimate of many.

Run alone: ``python -m tests.bench.bench_cluster [PIECES]``. Of each study: bytes of a piece and of its answer, its
processor seconds, and those of all processes together. What a worker needs once (its start, imports, its first piece)
is told apart. Clock times mean something on a quiet machine alone; processor seconds hold on a busy one, too. Prints,
fails for nothing but answers that differ.
"""

from __future__ import annotations

import importlib
import importlib.util
import pickle
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from planning.formats import qgc_plan
from planning.ground.demo_hillside import demo_dsm, demo_survey_polygon
from planning.missions.vehicle_profile import load_profile, path_params
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest, survey_request
from planning.risk.flights import RiskGround, risk_ground
from planning.risk.flights import fly as fly_often
from planning.risk.uncertain import Uncertain, uncertain_of
from planning.route.survey import survey_lines
from planning.route.survey_parts import Lines, part_of
from planning.terrain.dsm import Dsm
from server.work.cluster import installed, spread
from telemetry.simulation.scenarios.catalogue import run_scenario
from telemetry.simulation.scenarios.stage.result import ScenarioRequest
from tests.proof.missions import Prover
from tests.proof.models import GRIDS, seeded

SCENARIO, PIECES = "castle-building", 8
WAYS = {"here": None, "one worker": "local:1", "two workers": "local:2"}
SURVEY_M, LINES_PER_PART = 10.0, 2
"""Height above the surface, and what makes a piece of a survey."""
NOTHINGS = 300
NETWORK_BYTES_PER_S = 125e6
"""1 Gbit/s."""
ESTIMATED = (10_000, (100, 1_000))
"""Pieces of a study, and on how many workers."""


@dataclass(frozen=True)
class Study:
    name: str
    function: Callable[[Any], Any]
    """Its answer is compared as it is."""
    pieces: Sequence[Any]


@dataclass(frozen=True)
class Answer:
    told: Any
    own_cpu_s: float


@dataclass(frozen=True)
class Took:
    """One study in one way."""

    answers: tuple[Answer, ...]
    cpu_s: float
    """Of all processes, the workers' start included."""
    clock_s: float
    settled_s: float
    """From the answer after which every worker has had a piece to the last, for each piece between."""


@dataclass(frozen=True)
class Overhead:
    """Of one piece that does nothing, beside the work itself."""

    here_s: float
    """Processor seconds of scheduler and client, which one core does for all workers."""
    worker_s: float
    start_s: float
    """Processor seconds of a worker's start, and of what is started for it here."""


def fly(seed: int) -> str:
    return str(run_scenario(SCENARIO, ScenarioRequest(seed)).as_json())


def proved(kind_seed: tuple[str, int]) -> tuple[float, float] | None:
    with tempfile.TemporaryDirectory(prefix="hedgehop-bench-") as folder:
        prover = Prover(seeded(Path(folder), *kind_seed))
        found = next((each for each in map(prover.prove, range(8)) if each is not None), None)
        return None if found is None else (found.certified_m, found.true_m)


@cache
def _survey() -> tuple[Dsm, PlanRequest]:
    """Of the demo's hillside, low above it: some 30 lines."""
    dsm, profile = demo_dsm(), load_profile("mapper-rtk")
    lines = survey_lines(
        demo_survey_polygon(), dsm, camera=profile.camera, side_overlap=0.7, front_overlap=0.8, height_m=SURVEY_M
    )
    return dsm, survey_request(PlanRequest(pois=(), profile=profile, path=path_params(profile)), lines)


def part_planned(first: int) -> str:
    """The mission of so many lines of the survey."""
    return qgc_plan.write_plan(_part_of_survey(Lines(first, first + LINES_PER_PART)).mission)


def _part_of_survey(lines: Lines) -> Plan:
    dsm, request = _survey()
    assert request.survey is not None
    return plan_mission(dsm, survey_request(request, part_of(request.survey, dsm, lines)))


@cache
def _flown_ground() -> tuple[RiskGround, Uncertain]:
    plan = _part_of_survey(Lines(0, LINES_PER_PART))
    budget = plan.certificate.budget
    assert budget is not None
    return risk_ground(plan.dsm, plan.line), uncertain_of(budget, plan.certificate.home)


def flown_with_errors(piece: int) -> list[float]:
    return fly_often(*_flown_ground(), range(100 * piece, 100 * piece + 100), 0).distance_m.tolist()


def nothing(number: int) -> int:
    return number


def weighed(asked: tuple[Callable[[Any], Any], Any]) -> Answer:
    function, piece = asked
    before_s = _cpu_s()
    told = function(piece)
    return Answer(told, _cpu_s() - before_s)


def _cpu_s() -> float:
    """Of this process, and of those that it started and that have ended: workers of a local cluster are such."""
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def _own_cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def _taken(study: Study, where: str | None, workers: int) -> Took:
    before_s, began_s = _cpu_s(), time.perf_counter()
    answers, at_s = list[Answer](), list[float]()
    for answer in spread(weighed, [(study.function, piece) for piece in study.pieces], where, lambda share: None):
        answers.append(answer)
        at_s.append(time.perf_counter() - began_s)
    settled_s = (at_s[-1] - at_s[workers - 1]) / max(1, len(answers) - workers)
    return Took(tuple(answers), _cpu_s() - before_s, time.perf_counter() - began_s, settled_s)


def overhead() -> Overhead:
    """Of pieces that do nothing: what many take more than one, divided by how many more they are."""
    here, all_of_them = [], []
    for count in (1, 1 + NOTHINGS):
        own_s, all_s = _own_cpu_s(), _cpu_s()
        assert list(spread(nothing, range(count), "local:1", lambda share: None)) == list(range(count))
        here.append(_own_cpu_s() - own_s)
        all_of_them.append(_cpu_s() - all_s)
    here_s = (here[1] - here[0]) / NOTHINGS
    return Overhead(here_s, max(0.0, (all_of_them[1] - all_of_them[0]) / NOTHINGS - here_s), all_of_them[0])


def estimated(pieces: int, workers: int, *, piece_s: float, here_s: float, piece_bytes: float, first_s: float) -> float:
    """How many times as fast as one worker so many are, on paper (Amdahl 1967).

    What one scheduler and one network line do for each piece is done one after the other, whatever the workers do
    meanwhile; each worker begins with ``first_s`` of its own, and the last ones wait for whole pieces.
    """
    one_by_one_s = pieces * (here_s + piece_bytes / NETWORK_BYTES_PER_S)
    rounds = -(-pieces // workers)
    return (first_s + pieces * piece_s + one_by_one_s) / (first_s + rounds * piece_s + one_by_one_s)


def _told(study: Study, added: Overhead) -> None:
    list(spread(weighed, [(study.function, study.pieces[0])], None, lambda share: None))  # compiled and loaded once
    took = {name: _taken(study, where, 2 if where == "local:2" else 1) for name, where in WAYS.items()}
    here, one, two = took.values()
    told = [[answer.told for answer in each.answers] for each in took.values()]
    assert told[0] == told[1] == told[2], "other answers on workers"
    count = len(study.pieces)
    sent = len(pickle.dumps((weighed, (study.function, study.pieces[0]), installed())))
    came = max(len(pickle.dumps(answer)) for answer in here.answers)
    piece_s = sum(answer.own_cpu_s for answer in here.answers) / count
    settled = one.answers[1:] or one.answers
    beside_s = sum(answer.own_cpu_s for answer in settled) / len(settled) + added.here_s + added.worker_s
    first_s = max(0.0, one.answers[0].own_cpu_s - piece_s)
    print(f"{study.name}: {count} pieces of {piece_s:.3f} s of a processor; {sent:,} bytes sent, {came:,} back")
    for name, each in took.items():
        print(f"  {name}: {each.cpu_s:.1f} s of processors, {each.clock_s:.1f} s by the clock, start included")
    print(f"  a worker's first piece takes {first_s:.1f} s of a processor more")
    print(
        f"  one worker beside none, settled: {beside_s / piece_s - 1.0:+.1%} of processors, "
        f"{one.settled_s / here.settled_s - 1.0:+.1%} by the clock"
    )
    print(f"  two workers are {one.settled_s / two.settled_s:.2f} times as fast as one by the clock, settled")
    pieces, many = ESTIMATED
    for workers in many:
        faster = estimated(
            pieces,
            workers,
            piece_s=piece_s,
            here_s=added.here_s,
            piece_bytes=sent + came,
            first_s=first_s + added.start_s,
        )
        print(f"  on paper, {pieces:,} pieces on {workers:,} workers: {faster:,.0f} times as fast as on one")


def main() -> None:
    if importlib.util.find_spec("distributed") is None:
        print("Dask is not installed (hedgehop[cluster]): nothing is measured.")
        return
    alone = sys.argv[0].endswith("bench_cluster.py") and len(sys.argv) > 1
    count = int(sys.argv[1]) if alone else PIECES
    added = overhead()
    print(
        f"a piece that does nothing: {1000 * added.here_s:.2f} ms of a processor in scheduler and client, "
        f"{1000 * added.worker_s:.2f} ms in its worker; a worker's start {added.start_s:.1f} s"
    )
    kinds = [(kind, seed) for seed in range(1, count + 1) for kind in GRIDS][:count]
    _told(Study(f"hedgehop scenario {SCENARIO}", fly, range(count)), added)
    _told(Study("hedgehop survey --parts, two lines each", part_planned, range(0, 2 * count, 2)), added)
    _told(Study("hedgehop risk, 100 flights each", flown_with_errors, range(count)), added)
    _told(Study("make proof, one mission each", proved, kinds), added)


if __name__ == "__main__":
    # Found by their module's name, as the commands' own: what __main__ defines would travel with every piece.
    importlib.import_module("tests.bench.bench_cluster").main()
