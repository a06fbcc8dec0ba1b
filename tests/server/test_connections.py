"""Strangers that open connections and ask for nothing do not shut the door to those who ask (S6)."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import resource
import socket
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from server import app
from server.door import connections, guard
from server.door.connections import OpenConnections, connections_max, limited_protocol, raise_file_limit
from server.work.logs import Repeats
from tests.server.running import PASSWORD, Running, running

HALF = b"GET / HTTP/1.1\r\nHost: "
FLOOD = 60
PATIENCE_S = 30.0


@contextlib.contextmanager
def half_open(station: Running, count: int, sent: bytes = HALF) -> Iterator[list[socket.socket]]:
    with contextlib.ExitStack() as held:
        lines = []
        for _ in range(count):
            line = held.enter_context(socket.create_connection(("127.0.0.1", station.settings.port), PATIENCE_S))
            line.settimeout(PATIENCE_S)
            line.sendall(sent)
            lines.append(line)
        yield lines


def is_cut_off(line: socket.socket) -> bool:
    """Waits until it is."""
    try:
        return not line.recv(1)
    except ConnectionResetError:
        return True


@pytest.fixture
def narrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Running]:
    """Twelve connections in all, eight from one address, which is ours."""
    monkeypatch.setattr(app, "usual_connections", lambda: OpenConnections(12, 8))
    with running(tmp_path, password=PASSWORD) as station:
        yield station


def test_who_asks_comes_in_while_strangers_hold_all_connections(narrow: Running) -> None:
    with narrow.socket() as page, half_open(narrow, FLOOD) as strangers:
        # On a connection of its own: one that idles gives way too, and browsers then open another.
        with narrow.stranger(headers={"Origin": narrow.origin, "Cookie": narrow.cookie}) as browser:
            assert browser.get("/api/session").is_success
        with narrow.stranger(headers={"Origin": narrow.origin}) as browser:
            assert browser.post("/api/session", json={"password": PASSWORD}).is_success
        page.send(json.dumps({"type": "ping", "page_ms": 1.0}))
        while json.loads(page.recv(timeout=PATIENCE_S))["type"] != "clock":
            pass
        # The oldest gave way; the page, which has asked for its stream, did not.
        assert all(is_cut_off(line) for line in strangers[: FLOOD - 8])


def test_the_flood_is_told_once_with_a_count(narrow: Running, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "hedgehop.door"), half_open(narrow, FLOOD) as strangers:
        assert is_cut_off(strangers[0])
    told = [record.getMessage() for record in caplog.records if record.name == "hedgehop.door"]
    assert len(told) == 1
    assert told[0].startswith("Too many connections: 1 that asked for nothing")


def test_a_request_has_its_header_in_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(app, "limited_protocol", partial(limited_protocol, header_s=0.5))
    with running(tmp_path) as station, half_open(station, 1) as (trickling,), half_open(station, 1, b"") as (silent,):
        assert is_cut_off(silent)
        end_s, cut_off = time.monotonic() + PATIENCE_S, False
        while not cut_off and time.monotonic() < end_s:
            time.sleep(0.05)
            try:
                trickling.sendall(b"x")
            except (ConnectionResetError, BrokenPipeError):
                cut_off = True
        assert cut_off
        assert station.http.get("/api/session").is_success


def test_a_connection_that_was_answered_may_ask_again_and_then_waits(narrow: Running) -> None:
    request = f"GET /api/health HTTP/1.1\r\nHost: 127.0.0.1:{narrow.settings.port}\r\n\r\n".encode()
    with half_open(narrow, 1, request) as (asked,):
        for _ in range(2):
            answer = b""
            while not answer.endswith(b"}"):
                answer += asked.recv(65536)
            assert answer.startswith(b"HTTP/1.1 200")
            asked.sendall(request)
        with half_open(narrow, FLOOD), contextlib.suppress(ConnectionResetError):
            while asked.recv(65536):
                pass


def test_a_body_that_trickles_is_not_waited_for(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(guard, "CHUNK_TIMEOUT_S", 0.5)
    head = (
        f"PUT /api/plan HTTP/1.1\r\nHost: 127.0.0.1:{served.settings.port}\r\nOrigin: {served.origin}\r\n"
        f"Cookie: {served.cookie}\r\nContent-Type: application/json\r\nContent-Length: 100000\r\n\r\n"
    )
    with half_open(served, 1, head.encode()) as (line,):
        line.settimeout(0.1)
        answer, end_s = b"", time.monotonic() + PATIENCE_S
        while not answer and time.monotonic() < end_s:
            line.sendall(b" ")
            with contextlib.suppress(TimeoutError):
                answer = line.recv(65536)
        line.settimeout(PATIENCE_S)
        while not answer.endswith(b"}"):
            answer += line.recv(65536)
    assert b" 408 " in answer
    assert b"4096 bytes a second" in answer


def test_the_limit_of_files_is_raised_and_never_met(monkeypatch: pytest.MonkeyPatch) -> None:
    limits = [(1024, 4096)]
    monkeypatch.setattr(resource, "getrlimit", lambda _: limits[-1])
    monkeypatch.setattr(resource, "setrlimit", lambda _, pair: limits.append(pair))
    assert connections_max() == 1024 - connections.FILES_OF_OURS
    raise_file_limit()
    assert limits[-1] == (connections.CONNECTIONS_MAX + connections.FILES_OF_OURS, 4096)
    assert connections_max() == connections.CONNECTIONS_MAX
    limits.append((256, 256))
    raise_file_limit()
    assert limits[-1] == (256, 256)
    assert connections_max() == 16


def test_closed_websockets_are_not_counted() -> None:
    class Line(asyncio.Transport):
        closing = aborted = False

        def is_closing(self) -> bool:
            return self.closing

        def abort(self) -> None:
            self.aborted = True

    async def whole() -> None:
        held, lines = OpenConnections(4, 4), [Line() for _ in range(5)]
        for line in lines[:4]:
            held.admit(line, "here")
            held.asks(line)
        lines[0].closing = True
        held.admit(lines[4], "here")
        assert not any(line.aborted for line in lines)
        another = Line()
        held.admit(another, "there")
        assert lines[4].aborted, "it has asked for nothing yet"
        assert not another.aborted

    asyncio.run(whole())


def test_what_is_said_again_and_again_is_counted() -> None:
    said, t_s = Repeats(most=2, within_s=60.0), 1000.0

    def passes(message: str, *arguments: object, at_s: float, level: int = logging.WARNING) -> str | None:
        record = logging.LogRecord("hedgehop.x", level, "", 0, message, arguments, None)
        record.created = at_s
        return record.getMessage() if said.filter(record) else None

    flood = [passes("Refused %s.", number, at_s=t_s + number) for number in range(10)]
    assert flood == ["Refused 0.", "Refused 1.", *[None] * 8]
    assert passes("Another.", at_s=t_s + 10) == "Another."
    assert passes("Refused %s.", "one", at_s=t_s + 61) == "Refused one. (And 8 times more before.)"
    assert all(passes("Request.", at_s=t_s, level=logging.INFO) for _ in range(10))
