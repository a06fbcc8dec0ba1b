"""Promises S1, S2, S6, S7 on a real server: foreign pages change nothing, huge and slow bodies are refused."""

from __future__ import annotations

import contextlib
import json
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import TypeGuard

import httpx
import pytest
from fastapi.routing import APIRoute
from starlette.datastructures import Headers
from starlette.types import Receive, Scope, Send
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from server.api.terrain_routes import RAW_BODY
from server.door import guard
from server.door.guard import Door
from server.errors import ForbiddenError
from server.settings import Settings
from server.web import ROUTERS
from server.work.logs import OneLineFormatter
from tests.server.running import Running

EDIT = {"base_revision": 1, "label": "Test", "document": {}}


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "", "http://127.0.0.1:1", "https://{own}"])
def test_a_foreign_origin_changes_nothing(served: Running, origin: str) -> None:
    before = list(served.workspace.calls)
    foreign = origin.replace("{own}", f"127.0.0.1:{served.settings.port}")
    response = served.http.put("/api/plan", json=EDIT, headers={"Origin": foreign})
    assert (response.status_code, response.json()["code"]) == (403, "origin")
    assert served.workspace.calls == before


def test_a_missing_origin_changes_nothing(served: Running) -> None:
    before = list(served.workspace.calls)
    with served.stranger(cookies=served.http.cookies) as client:
        assert client.post("/api/plan/undo").status_code == 403
        assert client.delete("/api/session").status_code == 403
    assert served.workspace.calls == before


@pytest.mark.parametrize(
    "kind", ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", ""]
)
def test_a_body_that_needs_no_preflight_is_refused(served: Running, kind: str) -> None:
    before = list(served.workspace.calls)
    response = served.http.put("/api/plan", content=b'{"base_revision":1}', headers={"Content-Type": kind})
    assert response.status_code == 403
    assert served.workspace.calls == before


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "127.0.0.1:1", "127.0.0.1.evil:{port}", ""])
def test_a_foreign_host_is_refused(served: Running, host: str) -> None:
    name = host.replace("{port}", str(served.settings.port))
    response = served.http.get("/api/health", headers={"Host": name})
    assert response.status_code in (400, 403)


def test_own_names_are_answered(served: Running) -> None:
    for name in ("127.0.0.1", "localhost", "LOCALHOST", "[::1]"):
        assert served.http.get("/api/health", headers={"Host": f"{name}:{served.settings.port}"}).status_code == 200


@pytest.mark.parametrize("path", ["/ws", "/view/anything"])
@pytest.mark.parametrize("origin", ["http://evil.example", None, "null"])
def test_a_foreign_page_opens_no_socket(served: Running, path: str, origin: str | None) -> None:
    with pytest.raises(InvalidStatus) as refused:
        served.socket(path, origin=origin, subprotocols=["viser-v1.1.1"] if "view" in path else None)
    assert refused.value.response.status_code == 403


def test_a_rebound_name_opens_no_socket(served: Running) -> None:
    port = served.settings.port
    with socket.create_connection(("127.0.0.1", port)) as raw, pytest.raises(InvalidStatus) as refused:
        connect(
            f"ws://evil.example:{port}/ws",
            sock=raw,
            origin=Origin(f"http://evil.example:{port}"),
            additional_headers={"Cookie": served.cookie},
        )
    assert refused.value.response.status_code == 403


def test_an_announced_huge_body_is_refused_unread(served: Running) -> None:
    assert b" 413 " in _answer(served, _announced(served, 99999999999))


class Upload:
    """A body of unknown length, which counts what is taken of it."""

    def __init__(self, mebibytes: int) -> None:
        self.size, self.sent = mebibytes * 1024**2, 0

    def __iter__(self) -> Iterator[bytes]:
        while self.sent < self.size:
            self.sent += 65536
            yield b"x" * 65536

    def to(self, served: Running) -> httpx.Response:
        query, kind = {"filename": "x.tif"}, {"Content-Type": "application/octet-stream"}
        return served.http.post("/api/terrains", params=query, content=self, headers=kind)


def test_who_sends_too_much_hears_why(served: Running) -> None:
    upload = Upload(25)
    answer = upload.to(served)
    assert (answer.status_code, upload.sent) == (413, upload.size)
    assert answer.json()["what"] == "The body is larger than 1 MiB."
    assert nothing_is_kept(served)


def test_an_endless_body_is_answered_and_then_cut_off(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    """Who listens while sending, as browsers do, hears why before the connection ends, however long they go on."""
    monkeypatch.setattr(guard, "DRAIN_LIMIT_BYTES", 1024**2)
    size, sent = 400 * 1024**2, 0

    def send() -> None:
        nonlocal sent
        with contextlib.suppress(ConnectionError):
            while sent < size:
                raw.sendall(b"x" * 65536)
                sent += 65536

    with socket.create_connection(("127.0.0.1", served.settings.port), timeout=60) as raw:
        raw.sendall(_chunked(served) + b"%x\r\n" % size)
        sender = threading.Thread(target=send)
        sender.start()
        heard = b""
        with contextlib.suppress(ConnectionError):
            while more := raw.recv(65536):
                heard += more
        sender.join(60)
    assert not sender.is_alive()
    head, _, answer = heard.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 413 ")
    assert json.loads(answer)["what"] == "The body is larger than 1 MiB."
    assert sent < size / 4
    assert nothing_is_kept(served)


def nothing_is_kept(served: Running) -> bool:
    return "x.tif" not in served.workspace.uploads and not any((served.parts.library.root / "uploads").iterdir())


def test_who_stops_sending_what_is_too_much_is_not_waited_for(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "DRAIN_TIMEOUT_S", 0.2)
    with socket.create_connection(("127.0.0.1", served.settings.port), timeout=60) as raw:
        raw.sendall(_announced(served, 99999999999))
        heard = b"".join(iter(lambda: raw.recv(65536), b""))
    assert b" 413 " in heard
    assert heard.endswith(b"}")


def test_huge_json_is_refused(served: Running) -> None:
    body = b'{"x":"' + b"a" * guard.JSON_LIMIT_BYTES + b'"}'
    response = served.http.put("/api/plan", content=body, headers={"Content-Type": "application/json"})
    assert (response.status_code, response.json()["code"]) == (413, "too_large")


def test_huge_json_is_not_told_to_raise_a_setting(served: Running) -> None:
    body = b'{"x":"' + b"a" * guard.JSON_LIMIT_BYTES + b'"}'
    advice = served.http.put("/api/plan", content=body, headers={"Content-Type": "application/json"}).json()["advice"]
    assert "no setting" in advice
    assert "upload_limit_bytes" not in advice


_SMALL = (
    "/api/plan/import",
    "/api/parameters/compare",
    "/api/parameters/descriptions",
    "/api/radar/files/{file_id}/capture",
)
SMALL = {"/api/radar/files/{file_id}/cfg": 2**20, **dict.fromkeys(_SMALL, guard.IMPORT_LIMIT_BYTES)}
"""Routes of raw files that are smaller than what the setting allows, and how large theirs may be."""


def test_every_route_of_raw_files_takes_what_the_setting_allows() -> None:
    paths = {route.path for module in ROUTERS for route in module.router.routes if _is_raw(route)}
    assert paths >= {"/api/terrains", "/api/bags", *SMALL}
    assert paths - SMALL.keys() == guard.UPLOADS
    limits = guard.Guard(_nowhere, Settings(upload_limit_bytes=2**40))
    assert all(limits.body_limit(path) == 2**40 for path in guard.UPLOADS)
    assert all(limits.body_limit(path.replace("{file_id}", "0a")) >= most for path, most in SMALL.items())


def _is_raw(route: object) -> TypeGuard[APIRoute]:
    return isinstance(route, APIRoute) and route.openapi_extra == RAW_BODY


async def _nowhere(scope: Scope, receive: Receive, send: Send) -> None:
    """An app that nobody asks."""


def test_a_body_that_stops_is_given_up(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "CHUNK_TIMEOUT_S", 0.2)
    request = (
        f"PUT /api/plan HTTP/1.1\r\nHost: 127.0.0.1:{served.settings.port}\r\nOrigin: {served.origin}\r\n"
        f"Cookie: {served.cookie}\r\nContent-Type: application/json\r\nContent-Length: 100\r\n\r\n{{"
    )
    assert b" 408 " in _answer(served, request.encode())


@pytest.mark.parametrize("path", ["/api/health", "/signin", "/nowhere", "/api/state"])
def test_every_answer_carries_the_headers(served: Running, path: str) -> None:
    headers = served.http.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"] == "no-store"
    assert "frame-ancestors 'none'" in headers["content-security-policy"]
    assert "unsafe-eval" not in headers["content-security-policy"]
    assert "server" not in headers


def test_one_line_per_request_and_no_token(served: Running, caplog: pytest.LogCaptureFixture) -> None:
    def logged(found: Callable[[], bool]) -> None:
        deadline_s = time.monotonic() + 60
        while not found():
            assert time.monotonic() < deadline_s
            time.sleep(0.01)

    with caplog.at_level(logging.INFO, logger="hedgehop.http"), served.stranger() as client:
        served.http.get("/api/health")  # a line comes after its answer: with this one's those before have come
        logged(lambda: any("/api/health" in record.getMessage() for record in _http_records(caplog)))
        caplog.clear()
        client.get("/login?token=SECRET-TOKEN")
        client.get("/a%0d%0aINFO%20forged%1b[31m")
        logged(lambda: len(_http_records(caplog)) == 2)
    lines = [OneLineFormatter("%(message)s").format(record) for record in _http_records(caplog)]
    assert len(lines) == 2
    assert not any("SECRET" in line or "\n" in line or "\r" in line or "\x1b" in line for line in lines)
    assert "\\r\\nINFO forged\\x1b" in lines[1]


def test_wildcard_hosts_are_bare_addresses_only() -> None:
    door = Door.of(Settings(host="0.0.0.0", port=8000, allowed_hosts=("gcs.lan:8000",)))
    assert door.knows("192.168.1.7:8000")
    assert door.knows("[fe80::1]:8000")
    assert door.knows("gcs.lan:8000")
    assert not door.knows("192.168.1.7:9000")
    assert not door.knows("rebound.example:8000")


def test_a_configured_origin_may_differ_from_the_host() -> None:
    settings = Settings(port=8000, allowed_hosts=("gcs.example",), allowed_origins=("https://gcs.example/",))
    door, scope = Door.of(settings), {"type": "http", "method": "POST", "scheme": "http"}
    door.check(scope, Headers({"host": "gcs.example", "origin": "https://gcs.example"}))
    with pytest.raises(ForbiddenError):
        door.check(scope, Headers({"host": "gcs.example", "origin": "https://other.example"}))


def _http_records(caplog: pytest.LogCaptureFixture) -> list[logging.LogRecord]:
    return [record for record in caplog.records if record.name == "hedgehop.http"]


def _announced(served: Running, length: int) -> bytes:
    return (
        f"POST /api/terrains?filename=x.tif HTTP/1.1\r\nHost: 127.0.0.1:{served.settings.port}\r\n"
        f"Origin: {served.origin}\r\nCookie: {served.cookie}\r\nContent-Type: application/octet-stream\r\n"
        f"Content-Length: {length}\r\n\r\n"
    ).encode()


def _chunked(served: Running) -> bytes:
    return _announced(served, 0).replace(b"Content-Length: 0", b"Transfer-Encoding: chunked")


def _answer(served: Running, request: bytes) -> bytes:
    with socket.create_connection(("127.0.0.1", served.settings.port), timeout=60) as raw:
        raw.sendall(request)
        return raw.recv(65536)
