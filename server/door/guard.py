"""The first thing every request meets: Host, Origin, body type and size, headers, one log line.

Uvicorn and Starlette accept any Host and Origin and bodies of any size; a page of another origin could post to the
API, open the sockets, or reach them under a name it resolves to 127.0.0.1. Pure ASGI, so that nothing is buffered.
"""

from __future__ import annotations

import asyncio
import contextlib
import ipaddress
import logging
import re
import time
from dataclasses import dataclass

from starlette.datastructures import Headers, MutableHeaders
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.errors import ForbiddenError, ServerError, TooLargeError, error_doc, status_of
from server.settings import Settings

log = logging.getLogger("hedgehop.http")

JSON_LIMIT_BYTES = 2 * 1024**2
"""A plan of 5000 points is half of it; the loop that reads it passes on what vehicles say."""
IMPORT_LIMIT_BYTES = 20 * 1024**2
_SMALL_FILES = frozenset({"/api/plan/import", "/api/parameters/compare", "/api/parameters/descriptions"})
_CAPTURES = re.compile(r"/api/radar/files/[^/]+/capture")
"""Half an hour of motion capture, 80 times a second, is larger than what a body of JSON may be."""
CHUNK_TIMEOUT_S = 30.0
SLOWEST_BYTES_PER_S = 4096
"""Of a body, once it has been waited for so long in all."""
DRAIN_LIMIT_BYTES = 64 * 1024**2
DRAIN_TIMEOUT_S = 5.0
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
UPLOADS = frozenset(
    {
        "/api/terrains",
        "/api/orthophotos",
        "/api/recordings/import",
        "/api/bags",
        "/api/traversability/uwb",
        "/api/radar/files",
    }
)
# Neither can be sent across origins without a preflight, which nothing here answers.
BODY_TYPES = frozenset({"application/json", "application/octet-stream"})
PAGE_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; object-src 'none'; "
    "base-uri 'none'; form-action 'self'; frame-src 'self'; frame-ancestors 'none'; connect-src 'self' {sockets}"
)
HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
    "cross-origin-opener-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}


@dataclass(frozen=True, slots=True)
class Door:
    """Under which names the server may be reached, and from which origins besides its own."""

    hosts: frozenset[str]
    origins: frozenset[str]
    any_address_on_port: int | None

    @classmethod
    def of(cls, settings: Settings, certified: frozenset[str] = frozenset()) -> Door:
        """``certified``: names of our certificate, under which no other server can appear."""
        names = {"127.0.0.1", "localhost", "[::1]", *certified}
        wildcard = settings.host in ("0.0.0.0", "::")
        if not wildcard:
            names.add(f"[{settings.host}]" if ":" in settings.host else settings.host.lower())
        hosts = {f"{name}:{settings.port}" for name in names}
        if settings.port in (80, 443):
            hosts |= names
        return cls(
            frozenset(hosts | {host.lower() for host in settings.allowed_hosts}),
            frozenset(origin.lower().rstrip("/") for origin in settings.allowed_origins),
            settings.port if wildcard else None,
        )

    def knows(self, host: str) -> bool:
        """A name that an attacker resolves to us is never a bare address: those are safe when listening on all."""
        if host.lower() in self.hosts:
            return True
        address, _, port = host.rpartition(":")
        return self.any_address_on_port is not None and port == str(self.any_address_on_port) and _is_address(address)

    def check(self, scope: Scope, headers: Headers) -> None:
        """Raises ``ForbiddenError`` for a foreign host, and for a foreign origin where state could change."""
        host = headers.get("host", "")
        if len(headers.getlist("host")) != 1 or not self.knows(host):
            raise ForbiddenError(
                f"Hedgehop does not answer under the name {host!r}.",
                advice="Use the printed address, or add the name to the setting allowed_hosts.",
            )
        if scope["type"] == "http" and scope["method"] in SAFE_METHODS:
            return
        scheme = "https" if scope["scheme"] in ("https", "wss") else "http"
        origin = headers.get("origin", "").lower()
        if len(headers.getlist("origin")) != 1 or origin not in self.origins | {f"{scheme}://{host.lower()}"}:
            raise ForbiddenError(
                f"A request from {origin or 'no origin'!r} was refused.",
                advice="Use Hedgehop's own page, or add the origin to the setting allowed_origins.",
            )


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True


class Guard:
    """ASGI middleware around the whole app."""

    def __init__(self, app: ASGIApp, settings: Settings, certified: frozenset[str] = frozenset()) -> None:
        self._app = app
        self._door = Door.of(settings, certified)
        self._upload_limit = settings.upload_limit_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            await self._http(scope, receive, send)
        elif scope["type"] == "websocket":
            await self._websocket(scope, receive, send)
        else:
            await self._app(scope, receive, send)

    async def _http(self, scope: Scope, receive: Receive, send: Send) -> None:
        headers = Headers(scope=scope)
        started, status = time.monotonic(), 0
        body = _Metered(receive, self.body_limit(scope["path"]))

        async def dressed(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                answer_headers = MutableHeaders(scope=message)
                _dress(scope, headers.get("host", ""), answer_headers)
                if status in (408, 413):
                    # No other request follows on what is left of the body.
                    answer_headers["connection"] = "close"
            elif (status == 413 or refusal) and not message.get("more_body", False):
                await send({**message, "more_body": True})
                await body.drain()
                message = {"type": "http.response.body"}
            await send(message)

        try:
            refusal = self._refusal(scope, headers)
            await (refusal or self._app)(scope, body, dressed)
        finally:
            seconds = time.monotonic() - started
            # The path only: a sign-in link's token stands in the query.
            log.info("%s %s %d %.0f ms", scope["method"], scope["path"], status, 1000 * seconds)

    async def _websocket(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            self._door.check(scope, Headers(scope=scope))
        except ForbiddenError as error:
            log.warning("WebSocket %s refused: %s", scope["path"], error)
            await send({"type": "websocket.close", "code": 1008, "reason": ""})
            return
        await self._app(scope, receive, send)

    def _refusal(self, scope: Scope, headers: Headers) -> Response | None:
        try:
            self._door.check(scope, headers)
            _check_body(headers, self.body_limit(scope["path"]), is_upload=scope["path"] in UPLOADS)
        except ServerError as error:
            return _answer(error)
        return None

    def body_limit(self, path: str) -> int:
        """In bytes."""
        if path in UPLOADS:
            return self._upload_limit
        is_small_file = path in _SMALL_FILES or _CAPTURES.fullmatch(path) is not None
        return IMPORT_LIMIT_BYTES if is_small_file else JSON_LIMIT_BYTES


def _check_body(headers: Headers, limit: int, *, is_upload: bool) -> None:
    length = headers.get("content-length", "0")
    if not length.isascii() or not length.isdigit() or len(length) > 18:
        raise TooLargeError(f"Content-Length {length!r} is not a size.")
    if int(length) > limit:
        raise too_large(limit, is_setting=is_upload)
    if int(length) == 0 and "transfer-encoding" not in headers:
        return
    kind = headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind not in BODY_TYPES:
        raise ForbiddenError(
            f"A body of type {kind!r} is not accepted.", advice="Send application/json or application/octet-stream."
        )


def too_large(limit: int, *, is_setting: bool) -> TooLargeError:
    """``is_setting``: the operator can raise it."""
    smaller = "Crop or downsample a raster, record fewer frames, or raise the setting upload_limit_bytes."
    return TooLargeError(
        f"The body is larger than {limit / 1024**2:,.0f} MiB.",
        advice=smaller if is_setting else "Send less at once: no setting raises this limit.",
    )


class _Metered:
    """``receive`` that counts bytes and does not wait for ever; the framework lets an HTTPException through."""

    def __init__(self, receive: Receive, limit: int) -> None:
        self._receive = receive
        self._limit = limit
        self._seen, self._waited_s = 0, 0.0
        self._complete = False

    async def __call__(self) -> Message:
        if self._complete:
            return await self._receive()
        since_s = time.monotonic()
        try:
            async with asyncio.timeout(CHUNK_TIMEOUT_S):
                message = await self._receive()
        except TimeoutError:
            raise HTTPException(408, f"No part of the body came for {CHUNK_TIMEOUT_S:g} seconds.") from None
        self._waited_s += time.monotonic() - since_s
        if self._waited_s > CHUNK_TIMEOUT_S + self._seen / SLOWEST_BYTES_PER_S:
            raise HTTPException(408, f"The body comes at less than {SLOWEST_BYTES_PER_S} bytes a second.")
        self._seen += len(message.get("body", b""))
        self._complete = not message.get("more_body", False)
        if self._seen > self._limit:
            raise HTTPException(413, too_large(self._limit, is_setting=True).what)
        return message

    async def drain(self) -> None:
        """Reads on for a while: a connection closed on unread bytes is reset, and who still sends hears no answer."""
        left = DRAIN_LIMIT_BYTES
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(DRAIN_TIMEOUT_S):
                while not self._complete and left > 0:
                    message = await self._receive()
                    left -= len(message.get("body", b""))
                    self._complete = not message.get("more_body", False)


def _dress(scope: Scope, host: str, headers: MutableHeaders) -> None:
    for name, value in HEADERS.items():
        headers.setdefault(name, value)
    sockets = f"{'wss' if scope['scheme'] == 'https' else 'ws'}://{host}"
    headers.setdefault("content-security-policy", PAGE_POLICY.format(sockets=sockets))
    headers.setdefault("cache-control", "no-store")


def _answer(error: ServerError) -> Response:
    return Response(
        error_doc(error).model_dump_json(),
        status_code=status_of(error),
        media_type="application/json",
        headers={"connection": "close"},
    )
