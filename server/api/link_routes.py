"""Who is in charge, and the connections to vehicles: every command demands the lease."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response

from server.api.access import ERROR_RESPONSES, Fly, InCharge, Session, SignedIn, answer
from server.schemas import AdoptVehicle, ConnectLink, DisconnectLink, LeaseDoc, TakeLease

router = APIRouter(prefix="/api", dependencies=[SignedIn], tags=["link"], responses=ERROR_RESPONSES)


@router.post("/lease/take", response_model=LeaseDoc)
async def take(body: TakeLease, session: Session, flying: Fly) -> Response:
    """Takes charge of the vehicle; whoever was in charge is told so."""
    return answer(await flying.take_lease(session, body.name))


@router.post("/lease/release", response_model=LeaseDoc)
async def release_lease(session: Session, flying: Fly) -> Response:
    """Lets go of the vehicle: the next one who asks is in charge."""
    return answer(await flying.release_lease(session))


@router.post("/link/connect", status_code=204)
async def connect(body: ConnectLink, operator: InCharge, flying: Fly) -> Response:
    """Opens a connection and keeps it open, such as ``udpin:0.0.0.0:14550`` or ``tcp:192.168.1.7:5760``."""
    await flying.connections.connect(operator, body.address, adopt=body.adopt)
    return Response(status_code=204)


@router.post("/link/disconnect", status_code=204)
async def disconnect(body: DisconnectLink, operator: InCharge, flying: Fly) -> Response:
    await flying.connections.disconnect(operator, body.address)
    return Response(status_code=204)


@router.post("/link/adopt", status_code=204)
async def adopt(body: AdoptVehicle, operator: InCharge, flying: Fly) -> Response:
    """Takes one of the vehicles that were heard as the one that is flown."""
    await flying.connections.adopt(operator, body.candidate)
    return Response(status_code=204)


@router.post("/link/release", status_code=204)
async def release(operator: InCharge, flying: Fly) -> Response:
    """Sends nothing to the vehicle any more."""
    await flying.connections.release(operator)
    return Response(status_code=204)


@router.post("/link/simulator", status_code=204)
async def simulator(operator: InCharge, flying: Fly) -> Response:
    """Starts a simulated vehicle at the open plan's home and connects to it."""
    await flying.simulation.start(operator)
    return Response(status_code=204)
