"""Flying the vehicle: mission on board, check before the start, start, and what can be asked of it in the air."""

from __future__ import annotations

from collections.abc import Callable

from fastapi import APIRouter
from fastapi.responses import Response

from server.api.access import DONE, ERROR_RESPONSES, All, Fly, InCharge, answer
from server.schemas import (
    FenceHeightsDoc,
    FenceHeightsSet,
    FlyState,
    FlyWayBody,
    GuidedState,
    HomeBody,
    HomeState,
    ResumeFlight,
    SetFenceHeights,
    SetHomeBody,
    StartFlight,
    TakeUpPlan,
    UploadPlan,
    WayBody,
    WaySpeedBody,
)
from telemetry.topics.requests import Arm, Disarm, Land, LinkRequest, Operator, Pause, ReturnHome, StopMotors

router = APIRouter(prefix="/api/flight", tags=["flight"], responses=ERROR_RESPONSES)


@router.post("/upload", response_model=FlyState)
async def upload(body: UploadPlan, operator: InCharge, flying: Fly) -> Response:
    """Uploads the open plan and reads it back; 409 unless it is computed, certified and at this revision."""
    return answer(await flying.desk.upload(operator, body.revision))


@router.post("/check", response_model=FlyState)
async def check(operator: InCharge, flying: Fly) -> Response:
    """Reads the mission back and judges it where the vehicle really stands."""
    return answer(await flying.desk.check(operator))


@router.post("/fence_heights", response_model=FenceHeightsDoc)
async def look_at_fence_heights(operator: InCharge, flying: Fly) -> Response:
    """What would change on the vehicle so that it keeps the floor and ceiling of the plan on board; nothing is set."""
    del operator
    return answer(await flying.heights.look())


@router.post("/fence_heights/set", response_model=FenceHeightsSet)
async def set_fence_heights(body: SetFenceHeights, operator: InCharge, flying: Fly) -> Response:
    """Writes exactly what was shown and reads it back; 409 where it is something else by now, refused while armed."""
    return answer(await flying.heights.set(operator, body))


@router.post("/take_up", response_model=FlyState)
async def take_up(body: TakeUpPlan, operator: InCharge, flying: Fly) -> Response:
    """In flight: holds the vehicle and puts the way into the open plan and the plan's rest on board, certified and read
    back; resume flies them. 409 with what is in the way, and what is on board then."""
    return answer(await flying.desk.take_up(operator, body))


@router.delete("/take_up", response_model=FlyState)
async def cancel_take_up(operator: InCharge, flying: Fly) -> Response:
    """Ends what is computed of a plan that is taken up, at once; the vehicle goes on holding. 409 where nothing is."""
    del operator
    return answer(flying.desk.cancel_take_up())


@router.post("/start", **DONE)
async def start(body: StartFlight, operator: InCharge, flying: Fly) -> None:
    """Flies the mission that was checked; 409 when the check is missing, old, or did not go well."""
    await flying.desk.start(operator, body)


@router.post("/resume", **DONE)
async def resume(operator: InCharge, flying: Fly, body: ResumeFlight | None = None) -> None:
    """Goes on with what was paused; 409 where a plan that was taken up would meet another of the station's vehicles."""
    await flying.desk.resume(operator, [] if body is None else body.accept)


@router.put("/way", response_model=GuidedState)
async def judge_way(body: WayBody, operator: InCharge, flying: Fly, fleet: All) -> Response:
    """Lays a guided way from where the vehicle is over the open surface model and judges it; nothing moves."""
    return answer(await flying.ways.judge(operator, body, lambda: fleet.others_in_air(flying.number)))


@router.post("/way/fly", **DONE)
async def fly_way(body: FlyWayBody, operator: InCharge, flying: Fly, fleet: All) -> None:
    """Flies the way that was judged last; 409 where it may not be flown, 404 for one that is out of date."""
    await flying.ways.fly(operator, body, lambda: fleet.others_in_air(flying.number))


@router.put("/way/speed", **DONE)
async def set_speed(body: WaySpeedBody, operator: InCharge, flying: Fly) -> None:
    """On the rest of the way that is flown, up to the speed for which it is certified."""
    await flying.ways.set_speed(operator, body)


@router.delete("/way", response_model=GuidedState)
async def drop_way(operator: InCharge, flying: Fly) -> Response:
    """Puts away what was judged; what is flown goes on."""
    del operator
    return answer(flying.ways.drop())


@router.put("/home", response_model=HomeState)
async def judge_home(body: HomeBody, operator: InCharge, flying: Fly) -> Response:
    """Says what home would be there, over the open surface model, and what the return would be worth; nothing is set.

    409 where home cannot be there."""
    return answer(await flying.home.judge(operator, body))


@router.post("/home/set", **DONE)
async def set_home(body: SetHomeBody, operator: InCharge, flying: Fly) -> None:
    """Sets the home that was judged last; in the air only where the vehicle holds. 404 for one that is out of date."""
    await flying.home.set(operator, body)


@router.delete("/home", response_model=HomeState)
async def drop_home(operator: InCharge, flying: Fly) -> Response:
    """Puts away what was judged."""
    del operator
    return answer(flying.home.drop())


def _add_command(name: str, command: Callable[[Operator], LinkRequest], description: str = "") -> None:
    async def route(operator: InCharge, flying: Fly) -> None:
        await flying.desk.command(command(operator))

    path = f"/{name.partition('_')[0]}"
    router.add_api_route(path, route, methods=["POST"], name=name, description=description, **DONE)


_add_command("arm", Arm)
_add_command("disarm", Disarm, "Only on the ground.")
_add_command("pause", Pause, "The vehicle holds its position.")
_add_command("return_home", ReturnHome)
_add_command("land", Land, "Here and now.")
_add_command("emergency_stop", StopMotors, "The motors stop at once, also in the air: the vehicle falls.")
