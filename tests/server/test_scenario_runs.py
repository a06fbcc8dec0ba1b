"""Scenarios through the doors: run one at a time, never beside a flight, kept with their figures beside the paper's."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from server.library.scenario_runs import MOST_KEPT, ScenarioShelf
from server.schemas import ScenarioDoc, ScenarioPartDoc, ScenarioResultDoc, ScenarioRunDoc
from server.studies.scenario_task import part_doc
from server.work.jobs import Progress
from telemetry.simulation.scenarios.catalogue import NAMES
from telemetry.simulation.scenarios.stage.result import Figure, measured
from telemetry.simulation.scenarios.stage.scenario_curves import Chart, series
from tests.server.running import Running, running
from tests.server.station import ok

pytestmark = [pytest.mark.xdist_group("process"), pytest.mark.slow]

PATH = "/api/scenarios"
PART = measured(
    "a reflector",
    (
        Figure("range error (RMS)", 0.04, most=0.1, unit=" m", paper="0.15 m"),
        Figure("found", 0.5, least=0.9),
        Figure("missed", float("nan"), least=1.0),
        Figure("spread", float("inf")),
    ),
    ("a note",),
    (Chart("errors", "m", "%", (series("range", range(3000), range(3000)), series("paper", [1], [2], printed=True))),),
)


def flown(name: str, seed: int, *, report: Progress) -> tuple[list[ScenarioPartDoc], bool]:
    """Takes no time for most seeds, breaks for one, and never ends for another."""
    report("Flying", 0.5)
    if seed == 7:
        raise RuntimeError("a secret detail")
    if seed == 8:
        time.sleep(600)
    return [part_doc(PART)], False


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Running]:
    with running(tmp_path) as made:
        made.parts.scenarios._fly = flown
        yield made


def started(server: Running, seed: int = 0, name: str = "iq-reflector") -> ScenarioRunDoc:
    answer = ok(server.http.post(f"{PATH}/runs", json={"name": name, "seed": seed}))
    return ScenarioRunDoc.model_validate_json(answer.text)


def until(server: Running, wanted: Callable[[ScenarioRunDoc], bool]) -> ScenarioRunDoc:
    """The newest run, as pages are told of it."""
    end_s = time.monotonic() + 90.0
    while time.monotonic() < end_s:
        runs = server.parts.scenarios.message().runs
        if runs and wanted(runs[0]):
            return runs[0]
        server.http.get("/api/health")
    raise AssertionError("not within the time allowed")


def over(run: ScenarioRunDoc) -> bool:
    return run.state != "running"


def test_what_there_is_says_what_it_holds_against_which_paper(server: Running) -> None:
    found = [ScenarioDoc.model_validate(one) for one in ok(server.http.get(PATH)).json()]
    assert tuple(one.name for one in found) == NAMES
    assert all(one.flown and one.held and one.paper for one in found)
    assert [one.name for one in found if one.command_line_only] == ["long-flight"]


def test_a_run_is_kept_with_its_figures_beside_the_papers(server: Running) -> None:
    run = started(server, seed=3)
    assert (run.state, run.seed, run.passed) == ("running", 3, None)
    done = until(server, over)
    assert (done.id, done.state, done.passed) == (run.id, "done", False)
    kept = ScenarioResultDoc.model_validate_json(ok(server.http.get(f"{PATH}/runs/{run.id}")).text)
    (part,) = kept.parts
    assert [(one.value, one.verdict, one.paper) for one in part.figures] == [
        (0.04, "reached", "0.15 m"),
        (0.5, "NOT REACHED", ""),
        (None, "not measured", ""),
        (None, None, ""),
    ]
    (chart,) = part.charts
    assert (len(chart.series[0].x), chart.series[0].x[-1]) == (751, 2999.0)
    assert (chart.series[1].printed, chart.series[1].y) == (True, [2.0])
    assert chart.x_span[0] < 0.0 < 2999.0 < chart.x_span[1]
    assert [one["id"] for one in ok(server.http.get(f"{PATH}/runs")).json()] == [run.id]
    ok(server.http.delete(f"{PATH}/runs/{run.id}"))
    assert server.http.get(f"{PATH}/runs/{run.id}").status_code == 404


def test_one_at_a_time_and_what_runs_can_be_cancelled(server: Running) -> None:
    run = started(server, seed=8)
    refused = server.http.post(f"{PATH}/runs", json={"name": "wood"})
    assert (refused.status_code, "iq-reflector is running" in refused.json()["what"]) == (503, True)
    until(server, lambda one: one.step == "Flying")
    ok(server.http.post(f"{PATH}/runs/{run.id}/cancel"))
    assert until(server, over).state == "cancelled"
    assert server.http.post(f"{PATH}/runs/{run.id}/cancel").status_code == 404
    started(server)
    assert until(server, over).state == "done"


def test_no_scenario_runs_beside_a_flight(server: Running) -> None:
    started(server, seed=8)
    until(server, lambda one: one.step == "Flying")

    async def arm() -> None:
        server.flying.live.armed = True
        server.parts.scenarios.on_armed()

    server.on_loop(arm())
    ended = until(server, over)
    assert ended.state == "cancelled"
    assert ended.error is not None
    assert "armed" in ended.error.what
    refused = server.http.post(f"{PATH}/runs", json={"name": "wood"})
    assert (refused.status_code, "armed" in refused.json()["what"]) == (409, True)
    assert "disarmed" in refused.json()["advice"]


def test_what_breaks_is_told_without_its_secrets(server: Running) -> None:
    started(server, seed=7)
    broken = until(server, over)
    assert broken.state == "failed"
    assert broken.error is not None
    assert "secret" not in broken.error.model_dump_json()


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ({"name": "jungle"}, 404),
        ({"name": "long-flight"}, 409),
        ({"name": "wood", "seed": -1}, 422),
        ({"name": "wood", "seeds": 50}, 422),
        ({}, 422),
    ],
)
def test_what_cannot_be_run_here_is_refused(server: Running, body: dict[str, Any], status: int) -> None:
    answer = server.http.post(f"{PATH}/runs", json=body)
    assert answer.status_code == status
    assert answer.json()["what"]
    assert server.parts.scenarios.message().runs == []


def test_strangers_run_and_read_nothing(server: Running) -> None:
    with server.stranger(headers={"Origin": server.origin}) as other:
        for method, path in (
            ("GET", PATH),
            ("POST", f"{PATH}/runs"),
            ("GET", f"{PATH}/runs"),
            ("GET", f"{PATH}/runs/a"),
            ("DELETE", f"{PATH}/runs/a"),
            ("POST", f"{PATH}/runs/a/cancel"),
        ):
            body = {"name": "wood"} if method == "POST" else None
            assert other.request(method, path, json=body).status_code == 401, path


def test_the_oldest_go_where_there_are_too_many(tmp_path: Path) -> None:
    shelf = ScenarioShelf(tmp_path, print)
    for number in range(MOST_KEPT + 2):
        run = ScenarioRunDoc(
            id=f"r{number:03d}", name="wood", seed=0, started_utc=f"2026-01-01T{number:03d}", state="done"
        )
        shelf.add(ScenarioResultDoc(run=run, parts=[part_doc(PART)]))
    again = ScenarioShelf(tmp_path, print)
    assert [run.id for run in again.runs()][:: MOST_KEPT - 1] == [f"r{MOST_KEPT + 1:03d}", "r002"]
    assert again.get("r002").parts[0].notes == ["a note"]
