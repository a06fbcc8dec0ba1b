"""How a tablet comes to trust this machine's certificates: one page and one file, over plain HTTP.

A browser that does not trust the authority yet cannot fetch it safely, and what is offered here is public. Nothing
else can be asked for; the fingerprint on the laptop's own screen tells whether the right file has arrived.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from server.door.certificates import CertificateFiles
from server.errors import reported

log = logging.getLogger("hedgehop.tls")

AUTHORITY_PATH = "/hedgehop-authority.crt"
_TEMPLATES = Path(__file__).resolve().parent.parent / "templates"
_REQUEST_BYTES = 8192
_REQUEST_S = 5.0
_AT_ONCE = 16
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"


@dataclass(frozen=True, slots=True)
class TrustOffer:
    """What is offered, and where."""

    files: CertificateFiles
    console: str
    """The console's address, https."""
    page: str
    """The address of the page with the certificate, http."""

    def html(self) -> str:
        import segno  # only who sets up a tablet waits for it

        environment = Environment(loader=FileSystemLoader(_TEMPLATES), autoescape=True, undefined=StrictUndefined)
        return environment.get_template("trust.html").render(
            console=self.console,
            page=self.page,
            path=AUTHORITY_PATH,
            sha256=self.files.authority_sha256(),
            code=segno.make(self.page, error="m").svg_inline(scale=5, dark="#000", light="#fff"),
        )

    def authority(self) -> bytes:
        return self.files.authority.read_bytes()


class TrustListener:
    """Answers two addresses, to few at a time, and waits for nobody long."""

    def __init__(self, offer: TrustOffer, host: str, port: int) -> None:
        self._offer, self._host, self._port = offer, host, port
        self._turns = asyncio.Semaphore(_AT_ONCE)

    async def run(self) -> None:
        """Until cancelled. A port that is in use is told, and the station goes on without the page."""
        family = socket.AF_INET6 if ":" in self._host else socket.AF_INET
        try:
            server = await asyncio.start_server(
                self._serve, self._host, self._port, family=family, limit=_REQUEST_BYTES, backlog=_AT_ONCE
            )
        except OSError as error:
            log.warning("How tablets come to trust the certificate is not shown on port %d: %s", self._port, error)
            await asyncio.Event().wait()
            return
        async with server:
            await server.serve_forever()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, TimeoutError, asyncio.LimitOverrunError, asyncio.IncompleteReadError):
            if not self._turns.locked():
                async with self._turns, asyncio.timeout(_REQUEST_S):
                    request = await reader.readuntil(b"\r\n\r\n")
                    writer.write(await asyncio.to_thread(self._answer, request.partition(b"\r\n")[0]))
                    await writer.drain()
        writer.transport.abort() if writer.transport.get_write_buffer_size() else writer.close()

    def _answer(self, line: bytes) -> bytes:
        words = line.split()
        path = words[1] if len(words) == 3 and words[0] == b"GET" else b""
        try:
            if path == AUTHORITY_PATH.encode():
                return _response("200 OK", "application/x-x509-ca-cert", self._offer.authority())
            if path == b"/":
                return _response("200 OK", "text/html; charset=utf-8", self._offer.html().encode())
        except Exception as error:
            return _response("500 Error", "text/plain", reported(error, log, "The page of trust").what.encode())
        return _response("404 Not Found", "text/plain", b"Open / of this address.")


def _response(status: str, kind: str, body: bytes) -> bytes:
    lines = [
        f"HTTP/1.1 {status}",
        f"Content-Type: {kind}",
        f"Content-Length: {len(body)}",
        f"Content-Security-Policy: {_POLICY}",
        "X-Content-Type-Options: nosniff",
        "Referrer-Policy: no-referrer",
        "Cache-Control: no-store",
        "Connection: close",
    ]
    return "\r\n".join([*lines, "", ""]).encode() + body
