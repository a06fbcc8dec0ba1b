"""The ``/ws`` stream of a page."""

from __future__ import annotations

from fastapi import APIRouter, WebSocket

from server.api.access import Need, identity_of, needs, parts_of
from server.door.page import CLOSE_SIGNED_OUT, CLOSE_TRY_LATER
from server.errors import BusyError, SignInError
from server.schemas import MeDoc, MeMessage
from server.schemas.station_docs import FIRST_VEHICLE

router = APIRouter()


@router.websocket("/ws")
@needs(Need.OBSERVER)
async def stream(websocket: WebSocket) -> None:
    """A snapshot, then what changes. ``?page=`` names the page of the stream before this one, which had broken off;
    ``?vehicle=`` the vehicle that it showed.

    The guard has refused foreign origins before this.
    """
    parts = parts_of(websocket)
    try:
        identity = identity_of(websocket)
    except SignInError:
        # Only an open socket can tell the console's script why: 4401 leads it to the sign-in page.
        await websocket.accept()
        await websocket.close(CLOSE_SIGNED_OUT)
        return
    await websocket.accept()
    key = identity.session_key
    me = MeMessage(me=MeDoc(name=identity.name, role=identity.role, owner=identity.is_owner))
    try:
        await parts.hub.serve(
            websocket,
            session_key=key,
            session_remaining_s=identity.remaining_s,
            page_id=websocket.query_params.get("page"),
            may_change=identity.may_change,
            snapshot=parts.workspace.snapshot,
            present=lambda: [me, parts.alarms.message, *parts.workspace.present(), *parts.fleet.present()],
            vehicle=_number(websocket.query_params.get("vehicle", "")),
            of_vehicle=lambda number: parts.fleet.of(number).present_for(key),
            on_message=parts.workspace.on_show.on_client_message,
        )
    except BusyError:
        await websocket.close(CLOSE_TRY_LATER)


def _number(text: str) -> int:
    """Of a vehicle that may have gone: then the first one is shown."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 4 else FIRST_VEHICLE
