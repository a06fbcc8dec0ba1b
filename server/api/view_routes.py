"""The ``/ws`` stream of a page."""

from __future__ import annotations

from fastapi import APIRouter, WebSocket

from server.api.access import parts_of, session_of
from server.door.auth import session_key
from server.door.hub import CLOSE_SIGNED_OUT, CLOSE_TRY_LATER
from server.errors import BusyError, SignInError

router = APIRouter()


@router.websocket("/ws")
async def stream(websocket: WebSocket) -> None:
    """A snapshot, then what changes. The guard has refused foreign origins before this."""
    parts = parts_of(websocket)
    try:
        session_id = session_of(websocket)
    except SignInError:
        # Only an open socket can tell the console's script why: 4401 leads it to the sign-in page.
        await websocket.accept()
        await websocket.close(CLOSE_SIGNED_OUT)
        return
    await websocket.accept()
    key = session_key(session_id)
    await parts.flying.page_opens(key)
    try:
        await parts.hub.serve(
            websocket,
            session_key=key,
            session_remaining_s=parts.auth.remaining_s(session_id),
            snapshot=parts.workspace.snapshot,
            present=lambda: [*parts.workspace.present(), *parts.flying.present_for(key)],
            on_message=parts.workspace.on_show.on_client_message,
        )
    except BusyError:
        await websocket.close(CLOSE_TRY_LATER)
