"""Owns the viser server: on loopback, behind a secret, reached only through ``server.api.proxy``.

viser itself checks neither Origin nor identity and lets any client open tunnels and press buttons. So its socket
refuses every handshake without a secret that only the proxy knows, and its own handlers for tunnels are taken out.
Written against viser 1.1.1, whose exact version is pinned: its clients' handshakes are read from its internals.
"""

from __future__ import annotations

import contextlib
import hmac
import http
import logging
import os
import secrets
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server
from viser import _messages
from viser.infra import WebsockClientConnection
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

log = logging.getLogger("hedgehop.scene")

SUBPROTOCOL = f"viser-v{viser.__version__}"
SECRET_HEADER, PAGE_HEADER = "x-hedgehop-secret", "x-hedgehop-page"
CLIENT_HTML = Path(viser.__file__).parent / "client" / "build" / "index.html"

_constructing = threading.Lock()


class SceneHost:
    """``server`` is for drawing; ``page_of_client`` and ``client`` tell whose camera and clicks are whose."""

    def __init__(self) -> None:
        self._secret = secrets.token_urlsafe(32)
        self._pages: dict[int, str] = {}
        self._lock = threading.Lock()
        with _constructing, _guarded(self._secret), _silent():
            self.server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
        self._harden()

    @property
    def url(self) -> str:
        return f"ws://127.0.0.1:{self.server.get_port()}/"

    def headers(self, page_id: str) -> dict[str, str]:
        """What the proxy shows to be let in on behalf of a page."""
        return {SECRET_HEADER: self._secret, PAGE_HEADER: page_id}

    def page_of_client(self, client_id: int) -> str | None:
        """The page that a viser client draws for; None once it has gone. From any thread."""
        with self._lock:
            return self._pages.get(client_id)

    def client(self, page_id: str) -> viser.ClientHandle | None:
        """The newest client of a page: a reloaded view may leave an old one behind for a moment. None without one."""
        clients = self.server.get_clients()
        own = [client_id for client_id in clients if self.page_of_client(client_id) == page_id]
        return clients[max(own)] if own else None

    def page_ids(self) -> set[str]:
        """Of the pages whose view is connected."""
        return {page for client in self.server.get_clients() if (page := self.page_of_client(client)) is not None}

    def close(self) -> None:
        with _silent():
            self.server.stop()

    def _harden(self) -> None:
        connection = self.server._websock_server
        connection.unregister_handler(_messages.ShareUrlRequest)
        connection.unregister_handler(_messages.ShareUrlDisconnect)
        # Runs before viser reads the client's first message, so that no callback ever meets an unknown client.
        connection.on_client_connect(self._connected)
        connection.on_client_disconnect(self._disconnected)
        self.server.gui.configure_theme(show_logo=False, show_share_button=False)

    def _connected(self, client: WebsockClientConnection) -> None:
        request = self.server._websock_server._live_connections[client.client_id].request
        with self._lock:
            self._pages[client.client_id] = request.headers[PAGE_HEADER] if request is not None else ""

    def _disconnected(self, client: WebsockClientConnection) -> None:
        with self._lock:
            self._pages.pop(client.client_id, None)


@contextlib.contextmanager
def _guarded(secret: str) -> Iterator[None]:
    """While it lasts, servers that are started refuse handshakes without the secret, and all plain HTTP."""
    serve: Callable[..., Any] = websockets.asyncio.server.serve

    def check(connection: ServerConnection, request: Request) -> Response | None:
        shown = request.headers.get_all(SECRET_HEADER)
        if len(shown) == 1 and hmac.compare_digest(shown[0].encode(), secret.encode()):
            return None
        return connection.respond(http.HTTPStatus.FORBIDDEN, "Open the 3D view through Hedgehop.\n")

    def guarded_serve(*args: Any, **kwargs: Any) -> Any:
        return serve(*args, **{**kwargs, "process_request": check, "origins": [None]})

    websockets.asyncio.server.serve = guarded_serve  # type: ignore[assignment]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = serve  # type: ignore[assignment]


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """viser greets on standard output, which belongs to the command line's own words."""
    with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
        yield
