"""The vehicle's parameters: to read, to look at, to write, and as files."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import Response

from server.api.access import ERROR_RESPONSES, All, Fly, InCharge, answer
from server.door.uploads import display_name
from server.errors import BadRequestError
from server.flying.parameter_desk import FileFormat
from server.schemas import ComparedDoc, ParametersDoc, WriteParametersBody, WrittenAnswer

router = APIRouter(prefix="/api/parameters", tags=["parameters"], responses=ERROR_RESPONSES)

BYTES = {"requestBody": {"content": {"application/octet-stream": {}}, "required": True}}
Filename = Annotated[str, Query(max_length=1000)]


@router.get("", response_model=ParametersDoc)
async def parameters(flying: Fly) -> Response:
    """As they were read last, with what they will do on the mission on board; 409 before that."""
    return answer(await flying.parameters.doc())


@router.post("/read", response_model=ParametersDoc)
async def read(flying: Fly) -> Response:
    """Reads all of them from the vehicle: up to a minute over a slow radio."""
    return answer(await flying.parameters.read())


@router.post("/write", response_model=WrittenAnswer)
async def write(body: WriteParametersBody, operator: InCharge, flying: Fly) -> Response:
    """Writes one after the other and reads each back; refused while the vehicle is armed."""
    return answer(await flying.parameters.write(operator, body.changes))


@router.get("/file/{file}", response_class=Response)
async def save(file: FileFormat, flying: Fly) -> Response:
    """As Mission Planner's ``.param`` or QGroundControl's ``.params``."""
    headers = {"content-disposition": f'attachment; filename="{file}"'}
    return Response(flying.parameters.saved(file), media_type="text/plain; charset=utf-8", headers=headers)


@router.post("/compare", response_model=ComparedDoc, openapi_extra=BYTES)
async def compare(request: Request, flying: Fly, filename: Filename) -> Response:
    """The vehicle against a file; nothing is written."""
    return answer(await flying.parameters.compared(display_name(filename), await request.body()))


@router.post("/compare/{other}", response_model=ComparedDoc)
async def compare_vehicles(other: int, flying: Fly, fleet: All) -> Response:
    """The vehicle against another one of this station, which is read anew; nothing is written."""
    if other == flying.number:
        raise BadRequestError(f"Vehicle {other} cannot be compared with itself.", advice="Name another one.")
    return answer(await flying.parameters.compared_with(fleet.of(other).parameters))


@router.post("/descriptions", response_model=ParametersDoc, openapi_extra=BYTES)
async def describe(request: Request, flying: Fly, filename: Filename) -> Response:
    """Takes the makers' file of units, ranges and help, and keeps it for this kind of autopilot."""
    return answer(await flying.parameters.describe(display_name(filename), await request.body()))
