"""Who is in charge, and the connections to vehicles: every command demands the lease."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.responses import Response

from server.api.access import DONE, ERROR_RESPONSES, Fly, InCharge, Session, SignedIn, answer
from server.schemas import AdoptVehicle, ConnectLink, DisconnectLink, LeaseDoc, SetVehicleSigning, TakeLease

router = APIRouter(prefix="/api", dependencies=[SignedIn], tags=["link"], responses=ERROR_RESPONSES)


@router.post("/lease/take", response_model=LeaseDoc)
async def take(body: TakeLease, session: Session, flying: Fly) -> Response:
    """Takes charge of the vehicle; whoever was in charge is told so."""
    return answer(await flying.take_lease(session, body.name))


@router.post("/lease/release", response_model=LeaseDoc)
async def release_lease(session: Session, flying: Fly) -> Response:
    """Lets go of the vehicle: the next one who asks is in charge."""
    return answer(await flying.release_lease(session))


@router.post("/link/connect", **DONE)
async def connect(body: ConnectLink, operator: InCharge, flying: Fly) -> None:
    """Opens a connection and keeps it open, such as ``udpin:0.0.0.0:14550`` or ``tcp:192.168.1.7:5760``."""
    await flying.connections.connect(operator, body.address, adopt=body.adopt)


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
