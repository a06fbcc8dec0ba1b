"""A page on a slow line is shown what is new, not what waited in buffers (R4, R13)."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
import time
import zlib
from base64 import b64encode
from collections.abc import Iterator
from typing import Any

import pytest
import uvicorn
from starlette.types import Receive, Scope, Send
from uvicorn.server import ServerState
from websockets.asyncio.client import connect

from server.door import slow_lines
from server.schemas import VehicleMessage
from telemetry.topics.vehicle import VehicleState
from tests.server.running import Running

TEXT = 1
"""The frame's opcode."""
DEFLATED = 0x40
"""The frame's first byte has it."""
MESSAGES = 300


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine may take long to read, or to publish it all."""
    monkeypatch.setattr(slow_lines, "STALLED_S", 60.0)


def test_what_waits_for_a_slow_line_is_replaced_by_what_is_newer(served: Running) -> None:
    with _slow_page(served) as line:
        for number in range(MESSAGES):
            served.on_loop(_publish(served, number))
        numbers = list(_numbers(line, until=MESSAGES - 1))
    assert numbers == sorted(numbers)
    # Of half a megabyte that was published while nothing was read, little more than the kernels' least buffers came.
    assert len(numbers) < MESSAGES / 5


def test_who_takes_nothing_is_dropped(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    with _slow_page(served) as line:
        while b"snapshot" not in line.recv(4096):
            pass
        # From here on nothing is taken; before, a busy machine may be that slow.
        monkeypatch.setattr(slow_lines, "STALLED_S", 0.3)
        deadline_s, number = time.monotonic() + 60, 0
        while served.parts.hub.session_keys():
            served.on_loop(_publish(served, number := number + 1))
            assert time.monotonic() < deadline_s


def test_a_large_message_over_a_slow_line_is_no_stall(served: Running, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slow_lines, "STALLED_S", 3.0)
    with _slow_page(served) as line:
        served.on_loop(_publish(served, 7, length=60_000))
        assert list(_numbers(line, until=7, pause_s=0.15)) == [7]


def test_the_3d_view_keeps_its_buffers() -> None:
    async def scenario() -> dict[str, tuple[int, int]]:
        config, made = uvicorn.Config(_accepts, log_config=None), []

        def make() -> slow_lines.PageWebSocket:
            made.append(slow_lines.PageWebSocket(config, ServerState(), {}))
            return made[-1]

        limits = {}
        async with await asyncio.get_running_loop().create_server(make, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            for path in ("/ws", "/ws?x=1", "/view/abc/"):
                async with connect(f"ws://127.0.0.1:{port}{path}"):
                    limits[path] = made[-1].transport.get_write_buffer_limits()
        return limits

    limits = asyncio.run(scenario())
    assert limits["/ws"] == limits["/ws?x=1"] == (slow_lines.UNSENT_BYTES // 4, slow_lines.UNSENT_BYTES)
    assert limits["/view/abc/"][1] == 64 * 1024


def test_the_stream_goes_deflated_but_for_what_is_too_large(served: Running) -> None:
    lengths = [1500, 1500, slow_lines.DEFLATED_MAX_BYTES, 1500]
    with _slow_page(served, "Sec-WebSocket-Extensions: permessage-deflate; client_max_window_bits\r\n") as line:
        served.on_loop(_publish(served, 0, lengths[0]))
        inflating = zlib.decompressobj(-15)
        sizes: dict[int, tuple[bool, int]] = {}
        for first, payload in _frames(line):
            is_deflated = bool(first & DEFLATED)
            text = inflating.decompress(payload + b"\0\0\xff\xff") if is_deflated else payload
            message: dict[str, Any] = json.loads(text) if first & 0x0F == TEXT else {"type": "control frame"}
            if message["type"] == "vehicle":
                number = int(message["now_mono_s"])
                assert len(message["state"]["mode"]) == lengths[number] + 4
                sizes[number] = is_deflated, len(payload)
                if number == 3:
                    break
                served.on_loop(_publish(served, number + 1, lengths[number + 1]))
    assert sizes[2] == (False, pytest.approx(lengths[2], abs=3000))
    assert sizes[3][0]
    assert sizes[3][1] < 400


async def _accepts(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        while (await receive())["type"] != "websocket.disconnect":
            pass


async def _publish(served: Running, number: int, length: int = 1500) -> None:
    """As long as those of a flight are, unless another length is wanted."""
    state = VehicleState(1, 1, mode="AUTO" + "x" * length)
    served.parts.hub.publish(VehicleMessage(source="live", now_mono_s=float(number), state=state, follow=None))


def _slow_page(served: Running, also: str = "") -> socket.socket:
    while served.parts.hub.session_keys():  # the page of the test before has gone, and its server has not seen it yet
        time.sleep(0.01)
    line = socket.socket()
    line.settimeout(60)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    line.connect(("127.0.0.1", served.settings.port))
    key = b64encode(bytes(16)).decode()
    line.sendall(
        f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{served.settings.port}\r\nOrigin: {served.origin}\r\n"
        f"Cookie: {served.cookie}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n{also}\r\n".encode()
    )
    while not served.parts.hub.session_keys():
        time.sleep(0.01)
    return line


def _numbers(line: socket.socket, *, until: int, pause_s: float = 0.0) -> Iterator[int]:
    """Of the positions that arrive."""
    for first, payload in _frames(line, pause_s):
        message = json.loads(payload) if first & 0x0F == TEXT else {"type": "control frame"}
        if message["type"] == "vehicle":
            yield int(message["now_mono_s"])
            if message["now_mono_s"] == until:
                return


def _frames(line: socket.socket, pause_s: float = 0.0) -> Iterator[tuple[int, bytes]]:
    """First byte and payload of each; after every 2 kB the line takes nothing for ``pause_s``."""
    held, is_open = b"", False
    while True:
        part = line.recv(2048)
        assert part, "the server has hung up"
        held += part
        if not is_open and b"\r\n\r\n" in held:
            is_open, held = True, held.partition(b"\r\n\r\n")[2]
        while is_open and (found := _frame(held)) is not None:
            first, (payload, held) = held[0], found
            yield first, payload
        time.sleep(pause_s)


def _frame(data: bytes) -> tuple[bytes, bytes] | None:
    """The payload of the first whole WebSocket frame, and the rest."""
    if len(data) < 4:
        return None
    length, start = data[1] & 0x7F, 2
    if length == 126:
        length, start = struct.unpack_from(">H", data, 2)[0], 4
    elif length == 127:
        if len(data) < 10:
            return None
        length, start = struct.unpack_from(">Q", data, 2)[0], 10
    return (data[start : start + length], data[start + length :]) if len(data) >= start + length else None
