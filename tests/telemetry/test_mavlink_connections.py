"""Connections over real sockets and a pseudo terminal: they open themselves again, and leak nothing."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import pty
import socket
from collections.abc import AsyncIterator, Iterator

import pytest

from telemetry.mavlink.address import Address, parse_address
from telemetry.mavlink.connections import Connection, Receiver, make_connection
from telemetry.mavlink.connections.base import RETRY_S, described
from tests.free_ports import free_port
from tests.telemetry.link_bench import until
from tests.telemetry.own_time import run


class Ear:
    def __init__(self, address: str) -> None:
        self.data: list[tuple[str, bytes]] = []
        self.gone: list[str] = []
        self.changes = 0
        receiver = Receiver(self._received, self.gone.append, self._changed)
        self.connection: Connection = make_connection(parse_address(address), receiver)

    @property
    def all_bytes(self) -> bytes:
        return b"".join(data for _, data in self.data)

    def _received(self, peer: str, data: bytes) -> None:
        self.data.append((peer, data))

    def _changed(self) -> None:
        self.changes += 1


@contextlib.asynccontextmanager
async def listening(address: str) -> AsyncIterator[Ear]:
    ear = Ear(address)
    task = asyncio.create_task(ear.connection.run())
    try:
        yield ear
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def is_open(ear: Ear) -> None:
    await until(lambda: ear.connection.state == "open")


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("telemetry.mavlink.connections.base.RETRY_S", (0.001,))


@pytest.mark.fact("P19")
def test_udp_hears_everyone_and_answers_only_who_is_named() -> None:
    async def whole() -> None:
        port = free_port()
        async with listening(f"udpin:127.0.0.1:{port}") as ear:
            await is_open(ear)
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
                vehicle.connect(("127.0.0.1", port))
                vehicle.setblocking(False)
                vehicle.send(b"one")
                vehicle.send(b"two")
                await until(lambda: len(ear.data) == 2)
                peer = f"127.0.0.1:{vehicle.getsockname()[1]}"
                assert ear.data == [(peer, b"one"), (peer, b"two")]
                assert not ear.connection.send(b"nobody is named")
                assert ear.connection.send(b"answer", peer)
                assert await asyncio.get_running_loop().sock_recv(vehicle, 100) == b"answer"
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as unheard:
                unheard.bind(("127.0.0.1", 0))
                unheard.setblocking(False)
                # The node before this one may have heard it.
                assert ear.connection.send(b"hello", f"127.0.0.1:{unheard.getsockname()[1]}")
                assert await asyncio.get_running_loop().sock_recv(unheard, 100) == b"hello"

    run(whole)


def test_udpout_talks_first_and_hears_only_its_host() -> None:
    async def whole() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
            vehicle.bind(("127.0.0.1", 0))
            vehicle.setblocking(False)
            async with listening(f"udpout:127.0.0.1:{vehicle.getsockname()[1]}") as ear:
                await is_open(ear)
                assert ear.connection.send(b"hello")
                data, place = await asyncio.get_running_loop().sock_recvfrom(vehicle, 100)
                assert data == b"hello"
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
                    stranger.sendto(b"stranger", place)
                vehicle.sendto(b"vehicle", place)
                await until(lambda: ear.data)
                assert ear.all_bytes == b"vehicle"

    run(whole)


def test_udpout_survives_that_nobody_listens_yet() -> None:
    async def whole() -> None:
        async with listening(f"udpout:127.0.0.1:{free_port()}") as ear:
            await is_open(ear)
            for _ in range(5):
                ear.connection.send(b"anyone?")
                await asyncio.sleep(0.01)
            assert ear.connection.state == "open"
            assert ear.connection.times_opened == 1

    run(whole)


def test_a_port_in_use_is_said_and_taken_as_soon_as_it_is_free() -> None:
    async def whole() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
            other.bind(("127.0.0.1", 0))
            port = other.getsockname()[1]
            async with listening(f"udpin:127.0.0.1:{port}") as ear:
                await until(lambda: ear.connection.error)
                assert ear.connection.error is not None
                assert ear.connection.error.what == f"Port {port} is in use."
                assert "another" in ear.connection.error.advice
                assert ear.connection.state == "failed"
                other.close()
                await is_open(ear)
                assert ear.connection.error is None

    run(whole)


class Server:
    """Accepts, counts, and hangs up when told."""

    def __init__(self) -> None:
        self.writers: list[asyncio.StreamWriter] = []
        self.accepted = 0
        self.hangs_up = False
        self.heard = b""

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.accepted += 1
        writer.write(b"boot text")
        if not self.hangs_up:
            self.writers.append(writer)
            while data := await reader.read(100):
                self.heard += data
        writer.close()

    def hang_up(self) -> None:
        for writer in self.writers:
            writer.close()
        self.writers.clear()


@contextlib.asynccontextmanager
async def serving() -> AsyncIterator[tuple[Server, str]]:
    server = Server()
    async with await asyncio.start_server(server.serve, "127.0.0.1", 0) as listener:
        yield server, f"tcp:127.0.0.1:{listener.sockets[0].getsockname()[1]}"
        server.hang_up()


def test_tcp_reconnects_a_hundred_times_and_leaks_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    quick(monkeypatch)

    async def whole() -> None:
        async with serving() as (server, address):
            server.hangs_up = True
            async with listening(address) as ear:
                await until(lambda: server.accepted >= 10)
                before = descriptors()
                await until(lambda: server.accepted >= 150)
                assert descriptors() <= before + 3
                assert len(ear.gone) >= 140
            assert len(asyncio.all_tasks()) < 8

    run(whole)


def test_tcp_tries_again_without_spinning_while_nobody_answers() -> None:
    async def whole() -> None:
        address = f"tcp:127.0.0.1:{free_port()}"
        async with listening(address) as ear:
            await until(lambda: ear.connection.error)
            assert ear.connection.error is not None
            assert "does not answer" in ear.connection.error.what
            assert ear.changes == 1

    run(whole)
    assert min(RETRY_S) >= 0.1
    assert max(RETRY_S) <= 1.5


def test_tcp_sends_both_ways_and_comes_back_after_a_hang_up() -> None:
    async def whole() -> None:
        async with serving() as (server, address), listening(address) as ear:
            await until(lambda: ear.all_bytes == b"boot text")
            assert ear.connection.send(b"to the vehicle")
            await until(lambda: server.heard == b"to the vehicle")
            server.hang_up()
            await until(lambda: server.accepted == 2 and ear.connection.state == "open")
            await until(lambda: ear.connection.send(b"!"))
            await until(lambda: server.heard.endswith(b"!"))

    run(whole)


def test_a_reader_that_has_stopped_costs_frames_not_memory() -> None:
    async def whole() -> None:
        with socket.create_server(("127.0.0.1", 0)) as deaf:
            address = f"tcp:127.0.0.1:{deaf.getsockname()[1]}"
            async with listening(address) as ear:
                await is_open(ear)
                await until(lambda: ear.connection.send(b"x"))
                sent = sum(ear.connection.send(bytes(10_000)) for _ in range(2000))
                assert sent < 2000

    run(whole)


def test_tcp_server_tells_its_clients_apart() -> None:
    async def whole() -> None:
        port = free_port()
        async with listening(f"tcpin:127.0.0.1:{port}") as ear:
            await is_open(ear)
            (r1, w1), (_, w2) = [await asyncio.open_connection("127.0.0.1", port) for _ in range(2)]
            w1.write(b"first")
            await until(lambda: len(ear.data) == 1)
            w2.write(b"second")
            await until(lambda: len(ear.data) == 2)
            (one, _), (two, _) = ear.data
            assert one != two
            assert ear.connection.send(b"for one", one)
            assert await r1.read(100) == b"for one"
            assert not ear.connection.send(b"for nobody")
            w1.close()
            await until(lambda: ear.gone == [one])
            assert not ear.connection.send(b"too late", one)
            w2.close()
            await until(lambda: len(ear.gone) == 2)
            await asyncio.gather(w1.wait_closed(), w2.wait_closed())

    run(whole)


@contextlib.contextmanager
def terminal() -> Iterator[tuple[int, str]]:
    master, slave = pty.openpty()
    name = os.ttyname(slave)
    try:
        yield master, name
    finally:
        os.close(slave)
        with contextlib.suppress(OSError):
            os.close(master)


def test_a_serial_line_carries_bytes_both_ways() -> None:
    async def whole() -> None:
        with terminal() as (master, name):
            async with listening(f"{name}:57600") as ear:
                await is_open(ear)
                os.write(master, b"\xfd\x00binary\n")
                await until(lambda: ear.all_bytes == b"\xfd\x00binary\n")
                assert ear.data[0][0] == name
                assert ear.connection.send(b"\x00\xffcommand")
                assert os.read(master, 100) == b"\x00\xffcommand"

    run(whole)


def test_an_unplugged_device_is_said_and_looked_for_again(monkeypatch: pytest.MonkeyPatch) -> None:
    quick(monkeypatch)

    async def whole() -> None:
        master, slave = pty.openpty()
        name = os.ttyname(slave)
        os.close(slave)
        async with listening(f"{name}:57600") as ear:
            await is_open(ear)
            before = descriptors()
            os.close(master)
            await until(lambda: ear.connection.state == "failed")
            assert ear.connection.error is not None
            await until(lambda: "not there" in str(ear.connection.error) or "unplugged" in str(ear.connection.error))
            assert "Plug" in ear.connection.error.advice
            assert not ear.connection.send(b"lost")
            assert ear.gone == [name]
            assert descriptors() <= before

    run(whole)


def test_a_device_that_does_not_exist_is_said() -> None:
    async def whole() -> None:
        async with listening("/dev/ttyACM250") as ear:
            await until(lambda: ear.connection.error)
            assert ear.connection.error is not None
            assert ear.connection.error.what == "/dev/ttyACM250 is not there."

    run(whole)


@pytest.mark.parametrize(
    ("address", "number", "words"),
    [
        ("udpin:0.0.0.0:14550", errno.EADDRINUSE, "Port 14550 is in use"),
        ("udpin:0.0.0.0:80", errno.EACCES, "Port 80 may not be opened"),
        ("tcp:1.2.3.4:5760", errno.ECONNREFUSED, "Port 5760 does not answer"),
        ("tcp:1.2.3.4:5760", errno.EHOSTUNREACH, "cannot be reached"),
        ("/dev/ttyACM0", errno.EBUSY, "/dev/ttyACM0 is in use"),
        ("/dev/ttyACM0", errno.EACCES, "/dev/ttyACM0 may not be opened"),
        ("/dev/ttyACM0", errno.EIO, "unplugged"),
        ("tcp:no.such.host:5760", -2, "The connection failed"),
    ],
)
def test_every_failure_has_words_and_advice(address: str, number: int, words: str) -> None:
    parsed: Address = parse_address(address)
    error = described(OSError(number, os.strerror(number) if number > 0 else "Name not known"), parsed)
    assert words in error.what
    assert error.where == parsed.text
    assert error.advice
