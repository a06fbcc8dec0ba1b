"""Who is in charge, and the connections to vehicles: every command demands the lease."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response

from server.api.access import DONE, ERROR_RESPONSES, Fly, InCharge, Who, answer
from server.schemas import AdoptVehicle, ConnectLink, DisconnectLink, LeaseDoc, SetVehicleSigning

router = APIRouter(prefix="/api", tags=["link"], responses=ERROR_RESPONSES)


@router.get("/lease", response_model=LeaseDoc)
async def lease(who: Who, flying: Fly) -> Response:
    """Who is in charge, and whether somebody asks for it."""
    return answer(flying.lease.doc_for(who.session_key))


@router.post("/lease/take", response_model=LeaseDoc)
async def take(who: Who, flying: Fly) -> Response:
    """Takes charge where nobody is, or where nothing is heard of who is; else asks them: they have 15 s to answer."""
    return answer(await flying.operators.take(who.session_key, who.name))


@router.post("/lease/hand_over", response_model=LeaseDoc)
async def hand_over(who: Who, flying: Fly) -> Response:
    """To whoever has asked."""
    return answer(await flying.operators.hand_over(who.session_key))


@router.post("/lease/keep", response_model=LeaseDoc)
async def keep(who: Who, flying: Fly) -> Response:
    """Who has asked is told so."""
    return answer(await flying.operators.keep(who.session_key))


@router.post("/lease/release", response_model=LeaseDoc)
async def release_lease(who: Who, flying: Fly) -> Response:
    """Lets go of the vehicle, or asks no more: the next one who presses is in charge."""
    return answer(await flying.operators.release(who.session_key))


@router.post("/link/connect", **DONE)
async def connect(body: ConnectLink, operator: InCharge, flying: Fly) -> None:
    """Opens a connection and keeps it open, such as ``udpin:0.0.0.0:14550`` or ``tcp:192.168.1.7:5760``.

    With ``as_way`` it is another way to the vehicle in use; ``also`` opens several to one vehicle at once.
    """
    if body.also:
        await flying.connections.connect_all(operator, (body.address, *body.also), adopt=body.adopt)
    else:
        await flying.connections.connect(operator, body.address, adopt=body.adopt, as_way=body.as_way)


@router.post("/link/disconnect", **DONE)
async def disconnect(body: DisconnectLink, operator: InCharge, flying: Fly) -> None:
    await flying.connections.disconnect(operator, body.address)


@router.post("/link/adopt", **DONE)
async def adopt(body: AdoptVehicle, operator: InCharge, flying: Fly) -> None:
    """Takes one of the vehicles that were heard as the one that is flown."""
    await flying.connections.adopt(operator, body.candidate)


@router.post("/link/signing", **DONE)
async def signing(body: SetVehicleSigning, operator: InCharge, flying: Fly) -> None:
    """Gives the vehicle on the ground a key over this link, so that both sign what they send; or takes it away."""
    await flying.connections.set_signing(operator, enabled=body.enabled)


@router.post("/link/release", **DONE)
async def release(operator: InCharge, flying: Fly) -> None:
    """Sends nothing to the vehicle any more."""
    await flying.connections.release(operator)


@router.post("/link/simulator", **DONE)
async def simulator(operator: InCharge, flying: Fly) -> None:
    """Starts a simulated vehicle at the open plan's home and connects to it."""
    await flying.simulation.start(operator)
