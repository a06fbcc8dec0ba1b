"""Scenarios: the papers' field tests in simulation, run and looked at.

Nothing here reaches a vehicle: whoever is signed in may run one, as long as no vehicle is armed.
"""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import Response
from pydantic import RootModel

from server.api.access import DONE, ERROR_RESPONSES, answer, parts_of
from server.schemas import RunScenario, ScenarioDoc, ScenarioResultDoc, ScenarioRunDoc
from server.studies.scenario_desk import scenario_docs

router = APIRouter(prefix="/api/scenarios", tags=["scenarios"], responses=ERROR_RESPONSES)


class Scenarios(RootModel[list[ScenarioDoc]]):
    """What there is, and what each holds against which paper."""


class Runs(RootModel[list[ScenarioRunDoc]]):
    """What runs, and what was run, newest first."""


@router.get("", response_model=Scenarios)
async def scenarios() -> Response:
    return answer(Scenarios(scenario_docs()))


@router.get("/runs", response_model=Runs)
async def runs(request: Request) -> Response:
    """The stream tells what changes."""
    return answer(Runs(parts_of(request).scenarios.message().runs))


@router.post("/runs", response_model=ScenarioRunDoc, status_code=202)
async def run(body: RunScenario, request: Request) -> Response:
    """Flies one with one seed; 409 while a vehicle is armed, 503 while another runs."""
    parts = parts_of(request)
    return answer(parts.scenarios.run(body, armed=parts.fleet.any_armed), 202)


@router.post("/runs/{run_id}/cancel", **DONE)
async def cancel(run_id: str, request: Request) -> None:
    parts_of(request).scenarios.cancel(run_id)


@router.get("/runs/{run_id}", response_model=ScenarioResultDoc)
async def result(run_id: str, request: Request) -> Response:
    """What it came to, figure by figure beside the paper's."""
    return answer(parts_of(request).scenarios.result(run_id))


@router.delete("/runs/{run_id}", **DONE)
async def delete(run_id: str, request: Request) -> None:
    await parts_of(request).scenarios.delete(run_id)
