"""The process of ``hedgehop serve``: its socket, its log, its sign-in link."""

from __future__ import annotations

import errno
import socket
import sys
from contextlib import closing, suppress
from pathlib import Path

import uvicorn
from fastapi import FastAPI

from server.door.connections import limited_protocol, raise_file_limit, usual_connections
from server.door.handshake import behind_tls
from server.door.slow_lines import PageWebSocket
from server.door.tls import Tls
from server.errors import ServerError, StartError
from server.fleet import Fleet
from server.library import Library
from server.settings import RUNTIME_FOLDER, Settings
from server.web import create_app
from server.work.guarded import Guarded
from server.work.logs import configure_logging
from server.workspace import Workspace
from telemetry.mavlink.address import parse_address

WEBSOCKET_LIMIT_BYTES = 1024**2
"""From browsers; what goes to them has no limit."""
STALLED_AFTER_MS = 30_000
SHUTDOWN_S = 5


def run(settings: Settings, *, demo: bool = False) -> None:
    """Serves until interrupted. Raises StartError, DataDirError, AddressError or BusError with what to do."""
    guarded = Guarded.found()  # a spare server waits here, with all its modules loaded
    configure_logging(settings.log_level)
    raise_file_limit()
    for _, links in settings.vehicles:
        for address in links:
            parse_address(address)
    tls = Tls.of(settings)
    with bound_socket(settings.host, settings.port) as listening, closing(Library(settings.data_dir)) as library:
        app = create_app(settings, library, Workspace, Fleet.open, demo=demo, tls=tls)
        server = AnnouncingServer(app, settings, tls, guarded)
        server.run(sockets=[listening])
        if not server.started:
            fault = getattr(app.state, "start_error", None)
            raise fault or StartError("Hedgehop could not start.", advice="The log above tells why.")


class AnnouncingServer(uvicorn.Server):
    """Prints the sign-in link once the console answers, and proves to its guardian that it goes on answering."""

    def __init__(
        self, app: FastAPI, settings: Settings, tls: Tls | None = None, guarded: Guarded | None = None
    ) -> None:
        super().__init__(server_config(app, settings, tls))
        self._app, self._settings, self._tls, self._guarded = app, settings, tls, guarded

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            with suppress(OSError):  # a full disk: hedgehop account then prints the usual address
                origin_file(self._settings).write_text(self.origin(), encoding="ascii")
            announcement = self._announcement()
            with suppress(OSError):  # a terminal that has gone stops no server that is started again
                sys.stdout.write(announcement)
                sys.stdout.flush()

    async def on_tick(self, counter: int) -> bool:
        """Called by the event loop ten times a second."""
        if self._guarded is not None and counter % 5 == 0:
            parts = self._app.state.parts
            if not self._guarded.prove(link_is_open=parts.auth.link_is_open, in_flight=parts.fleet.any_armed):
                self.should_exit = True
        return await super().on_tick(counter)

    def _announcement(self) -> str:
        notice = self._guarded and self._guarded.notice()
        if notice is None:
            text = f"Hedgehop is ready. Open this link, which signs you in once:\n  {self.link()}\n"
            if self._tls is not None and (offer := self._tls.offer(self._settings)):
                text += f"Other devices come to trust this station at:\n  {offer.page}\n"
            return text
        parts = self._app.state.parts
        parts.alarms.begin("restart", notice, level="warning")
        if self._guarded and self._guarded.link_token:
            parts.auth.keep_link_token(self._guarded.link_token)
            return "Hedgehop is ready again. The sign-in link above was not used yet: it still signs you in once.\n"
        return "Hedgehop is ready again. Pages that are open come back by themselves; whoever was signed in still is.\n"

    def link(self) -> str:
        """The guardian's, which a server that is started again keeps; without a guardian a new one."""
        auth = self._app.state.parts.auth
        if self._guarded and self._guarded.link_token:
            auth.keep_link_token(token := self._guarded.link_token)
        else:
            token = auth.new_link_token()
        return f"{self.origin()}/login?token={token}"

    def origin(self) -> str:
        host, port = self._settings.host, self._settings.port
        return (
            f"http://{_reachable(host)}:{port}" if self._tls is None else f"https://{self._tls.reachable(host)}:{port}"
        )


def origin_file(settings: Settings) -> Path:
    """Says where the server is found: for links that are made outside it."""
    return settings.data_dir / RUNTIME_FOLDER / "origin.txt"


def server_config(app: FastAPI, settings: Settings, tls: Tls | None = None) -> uvicorn.Config:
    connections = usual_connections()
    protocol = limited_protocol(connections)
    return uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        log_config=None,
        # The guard writes one line per request, without the queries that hold sign-in tokens.
        access_log=False,
        server_header=False,
        # Meshes deflate slowly and little: a 36 MB one took 2.2 s with, 0.3 s without.
        ws_per_message_deflate=False,
        http=protocol if tls is None else behind_tls(protocol, tls.context, connections),
        ws=PageWebSocket,
        ws_max_size=WEBSOCKET_LIMIT_BYTES,
        timeout_graceful_shutdown=SHUTDOWN_S,
    )


def bound_socket(host: str, port: int) -> socket.socket:
    """The listening socket, bound before anything slow happens; raises ``StartError`` when that cannot be."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "TCP_USER_TIMEOUT"):
            # Connections inherit it: a browser that takes no bytes any more does not hold its buffers for ever.
            listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, STALLED_AFTER_MS)
        listening.bind((host, port))
    except OSError as error:
        listening.close()
        raise _cannot_bind(host, port, error) from error
    return listening


def _cannot_bind(host: str, port: int, error: OSError) -> ServerError:
    if error.errno == errno.EADDRINUSE:
        return StartError(
            f"Port {port} is in use: perhaps another Hedgehop runs already.",
            advice=f"Open http://{_reachable(host)}:{port} or start this one with another --port.",
        )
    if error.errno == errno.EACCES:
        return StartError(f"Port {port} is reserved by the system.", advice="Choose a --port of 1024 or more.")
    return StartError(
        f"Hedgehop cannot listen on {host}: {error.strerror}.",
        advice="Choose one of this machine's addresses as --host.",
    )


def _reachable(host: str) -> str:
    if host in ("0.0.0.0", "::"):
        return "127.0.0.1"
    return f"[{host}]" if ":" in host else host
