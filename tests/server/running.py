"""A real uvicorn on a free loopback port, in a thread, and clients for it."""

from __future__ import annotations

import asyncio
import contextlib
import functools
import ssl
import threading
from collections.abc import Coroutine, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, cast

import httpx
import uvicorn
from fastapi import FastAPI
from websockets.sync.client import ClientConnection, connect

from server.api.access import Parts
from server.app import bound_socket, server_config
from server.door.hub import Hub
from server.library import Library
from server.settings import Settings
from server.web import MakeWorkspace, OpenFleet, create_app
from tests.server.fakes import FakeFleet, FakeFlying, FakeWorkspace

T = TypeVar("T")
PASSWORD = "correct horse battery"


@dataclass(slots=True)
class Running:
    """The server, and a browser of one operator who is signed in."""

    settings: Settings
    app: FastAPI
    http: httpx.Client
    server: _Signalling

    @property
    def parts(self) -> Parts:
        return self.app.state.parts

    @property
    def workspace(self) -> FakeWorkspace:
        return cast(FakeWorkspace, self.parts.workspace)

    @property
    def flying(self) -> FakeFlying:
        return cast(FakeFlying, self.parts.fleet.first)

    def on_loop(self, work: Coroutine[Any, Any, T]) -> T:
        """Runs it where the server's own coroutines run."""
        assert self.server.loop is not None
        return asyncio.run_coroutine_threadsafe(work, self.server.loop).result(60)

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.settings.port}"

    @property
    def name(self) -> str:
        """Of the operator."""
        return self.http.get("/api/session").json()["name"]

    @property
    def cookie(self) -> str:
        return f"hedgehop-{self.settings.port}={self.http.cookies[f'hedgehop-{self.settings.port}']}"

    def socket(self, path: str = "/ws", **options: Any) -> ClientConnection:
        """A WebSocket as the operator's own page opens it."""
        headers = {"Cookie": self.cookie, **options.pop("additional_headers", {})}
        return connect(
            f"ws://127.0.0.1:{self.settings.port}{path}",
            origin=options.pop("origin", self.origin),
            additional_headers=headers,
            max_size=None,
            # As a browser does, it reads on while its test waits for an answer: who does not is dropped as too slow.
            max_queue=None,
            compression=None,
            **options,
        )

    def stranger(self, **options: Any) -> httpx.Client:
        """A client without a session."""
        return httpx.Client(base_url=self.origin, verify=_certificates(), **options)


def client(origin: str, **options: Any) -> httpx.Client:
    """As a page of this origin. The server closes connections that were idle for five seconds: none is kept that long,
    or a request would now and then be written into one that closes.
    """
    return httpx.Client(
        base_url=origin,
        headers={"Origin": origin},
        limits=httpx.Limits(keepalive_expiry=2.0),
        verify=_certificates(),
        **options,
    )


@functools.cache
def _certificates() -> ssl.SSLContext:
    """Those of the system, read once: each client would read them anew, which takes longer than most tests."""
    return httpx.create_ssl_context()


def _fake_workspace(library: Library, hub: Hub, *_: object) -> Any:
    return FakeWorkspace(library, hub)


async def fake_fleet(settings: Settings, library: Library, hub: Hub, *_: object) -> Any:
    return FakeFleet(library, hub)


@contextlib.contextmanager
def running(
    data_dir: Path,
    *,
    make: MakeWorkspace = _fake_workspace,
    fleet: OpenFleet = fake_fleet,
    demo: bool = False,
    **overrides: Any,
) -> Iterator[Running]:
    """With a workspace that computes nothing and nothing to fly, unless others are given."""
    with bound_socket("127.0.0.1", 0) as listening, contextlib.closing(Library(data_dir)) as library:
        port = listening.getsockname()[1]
        settings = Settings(data_dir=data_dir, port=port, **{"console_dir": data_dir / "no-console", **overrides})
        app = create_app(settings, library, make, fleet, demo=demo)
        ready = threading.Event()
        server = _Signalling(server_config(app, settings), ready)
        thread = threading.Thread(target=server.run, args=([listening],))
        thread.start()
        try:
            assert ready.wait(90)
            origin = f"http://127.0.0.1:{port}"
            with client(origin, timeout=90) as http:
                http.get("/login", params={"token": app.state.parts.auth.new_link_token()})
                yield Running(settings, app, http, server)
        finally:
            server.should_exit = True
            thread.join(90)


class _Signalling(uvicorn.Server):
    def __init__(self, config: uvicorn.Config, ready: threading.Event) -> None:
        super().__init__(config)
        self._ready = ready
        self.loop: asyncio.AbstractEventLoop | None = None

    async def startup(self, sockets: list[Any] | None = None) -> None:
        self.loop = asyncio.get_running_loop()
        try:
            await super().startup(sockets)
        finally:
            self._ready.set()
