"""The logs on the vehicle: which there are, and one read into the library."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path
from fastapi.responses import Response

from server.api.access import ERROR_RESPONSES, All, Fly, InCharge, answer
from server.schemas import VehicleLogsDoc

router = APIRouter(prefix="/api/link/logs", tags=["link"], responses=ERROR_RESPONSES)


@router.get("", response_model=VehicleLogsDoc)
async def logs(flying: Fly) -> Response:
    """The list as it was asked for last, and how far the reading of one is."""
    return answer(flying.logs.doc)


@router.post("/list", response_model=VehicleLogsDoc)
async def ask(operator: InCharge, flying: Fly) -> Response:
    """Asks the vehicle which logs it has; 409 while it is armed."""
    return answer(await flying.logs.ask(operator))


@router.post("/{number}/download", response_model=VehicleLogsDoc)
async def download(
    number: Annotated[int, Path(ge=0, le=65535)], operator: InCharge, flying: Fly, fleet: All
) -> Response:
    """Begins to read one of the list into the library."""
    return answer(flying.logs.download(operator, number, fleet.recordings))


@router.post("/cancel", response_model=VehicleLogsDoc)
async def cancel(operator: InCharge, flying: Fly) -> Response:
    """Reads no more of it."""
    del operator
    return answer(flying.logs.cancel())
