"""Flying the vehicle: mission on board, check before the start, start, and what can be asked of it in the air."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response

from server.api.access import ERROR_RESPONSES, Fly, InCharge, SignedIn, answer
from server.schemas import FlyState, StartFlight, UploadPlan
from telemetry.topics.requests import Arm, Disarm, Land, Pause, Resume, ReturnHome

router = APIRouter(prefix="/api/flight", dependencies=[SignedIn], tags=["flight"], responses=ERROR_RESPONSES)

COMMANDS = {
    "arm": Arm,
    "disarm": Disarm,
    "pause": Pause,
    "resume": Resume,
    "return": ReturnHome,
    "land": Land,
}


@router.post("/upload", response_model=FlyState)
async def upload(body: UploadPlan, operator: InCharge, flying: Fly) -> Response:
    """Uploads the open plan and reads it back; 409 unless it is computed, certified and at this revision."""
    return answer(await flying.desk.upload(operator, body.revision))


@router.post("/check", response_model=FlyState)
async def check(operator: InCharge, flying: Fly) -> Response:
    """Reads the mission back and judges it where the vehicle really stands."""
    return answer(await flying.desk.check(operator))


@router.post("/start", status_code=204)
async def start(body: StartFlight, operator: InCharge, flying: Fly) -> Response:
    """Flies the mission that was checked; 409 when the check is missing, old, or did not go well."""
    await flying.desk.start(operator, body)
    return Response(status_code=204)


@router.post("/arm", status_code=204)
async def arm(operator: InCharge, flying: Fly) -> Response:
    return await _command("arm", operator, flying)


@router.post("/disarm", status_code=204)
async def disarm(operator: InCharge, flying: Fly) -> Response:
    """Only on the ground."""
    return await _command("disarm", operator, flying)


@router.post("/pause", status_code=204)
async def pause(operator: InCharge, flying: Fly) -> Response:
    """The vehicle holds its position."""
    return await _command("pause", operator, flying)


@router.post("/resume", status_code=204)
async def resume(operator: InCharge, flying: Fly) -> Response:
    """Goes on with what was paused."""
    return await _command("resume", operator, flying)


@router.post("/return", status_code=204)
async def return_home(operator: InCharge, flying: Fly) -> Response:
    return await _command("return", operator, flying)


@router.post("/land", status_code=204)
async def land(operator: InCharge, flying: Fly) -> Response:
    """Here and now."""
    return await _command("land", operator, flying)


async def _command(name: str, operator: InCharge, flying: Fly) -> Response:
    await flying.desk.command(COMMANDS[name](operator))
    return Response(status_code=204)
