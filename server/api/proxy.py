"""viser's page and socket on Hedgehop's own origin: ``/view/{page_id}/`` and ``/view/{page_id}``.

A page id belongs to a live ``/ws`` stream of the same session; soon after that has ended for good, so does its 3D
view. Messages to the
browser pass as they are; those from the browser pass ``server.scene.filter``.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from functools import lru_cache
from urllib.parse import urlencode

from fastapi import APIRouter, Request, WebSocket
from fastapi.responses import RedirectResponse, Response
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from server.api.access import Need, identity_of, needs, parts_of
from server.door.page import Page
from server.errors import NotFoundError, SignInError
from server.scene.filter import MessageFilter
from server.scene.host import CLIENT_HTML, SUBPROTOCOL, SceneHost
from server.work.task_group import until_first

log = logging.getLogger("hedgehop.scene")
router = APIRouter(include_in_schema=False)

# viser is one HTML file that unpacks its script with WebAssembly and adds it inline; its decoders are workers.
VIEW_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob: data:; "
    "style-src 'unsafe-inline'; img-src 'self' data: blob:; font-src data:; connect-src 'self' {sockets} data: blob:; "
    "frame-ancestors 'self'; base-uri 'none'; form-action 'none'"
)
# viser has no switch for its control panel and its own notices; the console has both. The panel floats in a window of
# its own, and is a sheet of paper at the lower edge where the view is narrower than 576 px; its lists hang in portals.
# Its white page would flash before the first picture: a quiet gradient lies behind all, dark enough for white labels
# in either theme.
#
# It connects again only while its own page has the focus, which is mostly the console's: a view whose line was cut
# would stand still for good.
VIEW_HEAD = b"""<script>document.hasFocus = () => true;</script>
<style>
[data-floating-window], .mantine-Paper-root, [data-portal], .mantine-Notifications-root { display: none !important; }
html, body { height: 100%; background: linear-gradient(#3a4454, #181c24) !important; }
#root div:has(canvas) { background: transparent !important; }
</style>"""
PASSED_ON_QUERY = frozenset({"fixedDpr"})
CLOSE_TIMEOUT_S = 5.0


@router.get("/view/{page_id}/")
async def view_page(page_id: str, request: Request) -> Response:
    """viser's client, with a query that cannot point it at a foreign server."""
    _page(request, page_id)
    known = [(key, value) for key, value in request.query_params.multi_items() if key in PASSED_ON_QUERY]
    if len(known) != len(request.query_params.multi_items()):
        return RedirectResponse(f"{request.url.path}?{urlencode(known)}".rstrip("?"), 303)
    sockets = f"{'wss' if request.url.scheme == 'https' else 'ws'}://{request.headers['host']}"
    policy = VIEW_POLICY.format(sockets=sockets)
    return Response(_client_html(), media_type="text/html", headers={"content-security-policy": policy})


@router.websocket("/view/{page_id}")
@needs(Need.OBSERVER)
async def view_socket(page_id: str, websocket: WebSocket) -> None:
    """The bridge. A stranger and a client of another viser version are refused before the upgrade."""
    try:
        page = _page(websocket, page_id)
    except (SignInError, NotFoundError):
        await websocket.close(1008)
        return
    if SUBPROTOCOL not in websocket.scope["subprotocols"]:
        await websocket.close(1002)
        return
    await _bridge(websocket, page, parts_of(websocket).scene_host)


def _page(connection: Request | WebSocket, page_id: str) -> Page:
    identity = identity_of(connection)
    page = parts_of(connection).hub.page(page_id)
    if page is None or page.session_key != identity.session_key:
        raise NotFoundError("This 3D view belongs to no open page.", advice="Reload the page.")
    return page


async def _bridge(websocket: WebSocket, page: Page, host: SceneHost) -> None:
    messages = MessageFilter(may_change=page.may_change)
    async with connect(
        host.url,
        subprotocols=[Subprotocol(SUBPROTOCOL)],
        additional_headers=host.headers(page.page_id),
        compression=None,
        max_size=None,
        max_queue=4,
        ping_interval=None,
        proxy=None,
    ) as upstream:
        await websocket.accept(SUBPROTOCOL)
        with contextlib.suppress(ConnectionClosed, WebSocketDisconnect):
            await until_first(
                _to_browser(upstream, websocket),
                _to_viser(websocket, upstream, messages),
                page.view_over.wait(),
            )
    if messages.dropped:
        log.warning("The 3D view of page %s sent what it must not: %s", page.page_id, dict(messages.dropped))
    with contextlib.suppress(RuntimeError, WebSocketDisconnect, TimeoutError):
        async with asyncio.timeout(CLOSE_TIMEOUT_S):
            await websocket.close(1001)


async def _to_browser(upstream: ClientConnection, websocket: WebSocket) -> None:
    async for message in upstream:
        if isinstance(message, bytes):
            await websocket.send_bytes(message)


async def _to_viser(websocket: WebSocket, upstream: ClientConnection, messages: MessageFilter) -> None:
    while True:
        received = await websocket.receive()
        if received["type"] == "websocket.disconnect":
            return
        raw = received.get("bytes")
        if messages.lets_through(raw) and raw is not None:
            await upstream.send(raw)


@lru_cache(maxsize=1)
def _client_html() -> bytes:
    return CLIENT_HTML.read_bytes().replace(b"</head>", VIEW_HEAD + b"</head>", 1)
