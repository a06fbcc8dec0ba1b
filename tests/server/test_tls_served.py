"""A station in a process of its own that listens on all addresses, reached through TLS."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import os
import re
import socket
import ssl
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any, cast

import httpx
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from server.door import tls
from server.door.alarms import Alarms
from server.door.certificates import CertificateFiles, now_utc
from server.door.connections import FROM_ONE_PLACE_MAX, OpenConnections
from server.door.handshake import behind_tls
from server.door.tls import Tls
from server.errors import CertificateError
from server.scene.host import SUBPROTOCOL
from server.schemas import AlarmsMessage, ServerMessage
from tests.free_ports import free_port
from tests.server import test_tls
from tests.server.cli_runs import hedgehop

files = test_tls.files
"""Certificates of a test's own, beside the station's."""


@dataclass(slots=True)
class Secure:
    files: CertificateFiles
    link: str
    trust_page: str
    trusting: ssl.SSLContext
    said: str

    @property
    def origin(self) -> str:
        return self.link.partition("/login")[0]


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Secure]:
    data_dir = tmp_path_factory.mktemp("tls") / "data"
    hedgehop = [sys.executable, "-m", "server"]
    said = subprocess.run(
        [*hedgehop, "tls", "--data-dir", str(data_dir)], capture_output=True, text=True, check=True
    ).stderr
    port, trust_port = free_port(), free_port()
    soon = "from server.door import tls; from server.cli import main; tls.LOOK_EVERY_S = 1.0; main()"
    process = subprocess.Popen(
        [sys.executable, "-c", soon, "serve", "--host", "0.0.0.0", "--port", str(port), "--data-dir", str(data_dir)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "HEDGEHOP_TRUST_PORT": str(trust_port)},
    )
    try:
        assert process.stdout is not None
        printed = [process.stdout.readline() for _ in range(4)]
        files = CertificateFiles(data_dir)
        trusting = ssl.create_default_context(cafile=files.authority)
        yield Secure(files, printed[1].strip(), printed[3].strip(), trusting, said)
    finally:
        process.terminate()
        process.communicate(timeout=30)


@pytest.fixture
def client(station: Secure) -> Iterator[httpx.Client]:
    with httpx.Client(
        base_url=station.origin, verify=station.trusting, headers={"Origin": station.origin}, timeout=60
    ) as client:
        yield client


@pytest.fixture(scope="module")
def cookie(station: Secure) -> str:
    with httpx.Client(verify=station.trusting, timeout=60) as client:
        answer = client.get(station.link)
    assert answer.status_code == 303
    set_cookie = answer.headers["set-cookie"]
    assert set_cookie.startswith("__Host-hedgehop-")
    assert {"Secure", "HttpOnly", "SameSite=strict"} <= {part.strip() for part in set_cookie.split(";")}
    return set_cookie.partition(";")[0]


def test_the_link_is_https_and_signs_in_who_trusts_the_authority(
    station: Secure, client: httpx.Client, cookie: str
) -> None:
    assert station.link.startswith("https://")
    health = client.get("/api/health", headers={"Cookie": cookie}).json()
    assert "loop" in health
    with pytest.raises(httpx.ConnectError, match="self-signed certificate"):
        httpx.get(f"{station.origin}/api/health", timeout=60)


def test_a_command_on_this_machine_reaches_the_station_by_its_own_authority(station: Secure) -> None:
    run = hedgehop("home", "here", "--data-dir", station.files.folder.parent, "--json")
    assert (run.code, run.json["error"]["code"]) == (1, "not_ready"), run.err
    assert "No surface model is open" in run.err


def test_who_signs_in_is_led_to_where_a_device_comes_to_trust_it(station: Secure, client: httpx.Client) -> None:
    page = client.get("/signin").text
    host = station.origin.removeprefix("https://").rpartition(":")[0]
    port = station.trust_page.rstrip("/").rpartition(":")[2]
    assert f'href="http://{host}:{port}/"' in page


def test_a_renewal_that_fails_is_an_alarm_until_it_succeeds(
    files: CertificateFiles, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[list[str]] = []

    class Pages:
        def publish(self, message: ServerMessage) -> None:
            assert isinstance(message, AlarmsMessage)
            told.append([alarm.error.what for alarm in message.alarms])

    async def whole() -> None:
        faults = iter([CertificateError("The clock is wrong."), CertificateError("The clock is wrong."), None])

        def renew(now: datetime) -> bool:
            if fault := next(faults, None):
                raise fault
            return False

        monkeypatch.setattr(files, "renew", renew)
        monkeypatch.setattr(tls, "LOOK_EVERY_S", 0.01)
        running = asyncio.create_task(Tls(files.server, None, own=files).run(Alarms(Pages())))
        while len(told) < 2:
            await asyncio.sleep(0.01)
        running.cancel()

    asyncio.run(asyncio.wait_for(whole(), 30))
    assert told == [["The console's certificate could not be renewed. The clock is wrong."], []]


def test_the_stream_rides_on_it_and_other_origins_do_not(station: Secure, cookie: str) -> None:
    """By a client of one thread: websockets' blocking one reads a TLS socket in one thread while it writes in another,
    and hangs once in some hundred connections, with whatever server.
    """
    secure = station.origin.replace("https", "wss")

    def opened(path: str, origin: str, **options: Any) -> connect:
        headers = {"Cookie": cookie}
        return connect(
            secure + path,
            ssl=station.trusting,
            origin=cast(Any, origin),
            additional_headers=headers,
            max_size=None,
            proxy=None,
            **options,
        )

    async def whole() -> None:
        async with opened("/ws", station.origin) as socket:
            snapshot = json.loads(await socket.recv())
            view = f"/view/{snapshot['page_id']}"
            async with opened(view, station.origin, subprotocols=[SUBPROTOCOL]) as picture:
                assert isinstance(await picture.recv(), bytes)
        for origin in (station.origin.replace("https", "http"), "https://evil.example"):
            with pytest.raises(InvalidStatus, match="403"):
                await opened("/ws", origin)

    asyncio.run(asyncio.wait_for(whole(), 120))


def test_pages_may_open_secure_sockets_only_and_foreign_names_are_refused(
    station: Secure, client: httpx.Client
) -> None:
    policy = client.get("/signin").headers["content-security-policy"]
    assert "ws://" not in policy
    assert client.get("/signin", headers={"Host": "evil.example"}).status_code == 403
    port = station.origin.rpartition(":")[2]
    for name in ("localhost", *station.files.certificate().names.dns):
        assert client.get("/api/health", headers={"Host": f"{name}:{port}"}).status_code == 200


@pytest.mark.filterwarnings("ignore:ssl.TLSVersion:DeprecationWarning")
def test_old_versions_and_plain_text_are_refused(station: Secure) -> None:
    old = ssl.create_default_context(cafile=station.files.authority)
    old.set_ciphers("ALL:@SECLEVEL=0")
    old.minimum_version = ssl.TLSVersion.MINIMUM_SUPPORTED
    old.maximum_version = ssl.TLSVersion.TLSv1_1
    for attempt in (
        lambda: httpx.get(f"{station.origin}/api/health", verify=old, timeout=60),
        lambda: httpx.get(f"{station.origin.replace('https', 'http')}/api/health", timeout=60),
    ):
        with pytest.raises(httpx.TransportError):
            attempt()


def test_strangers_who_never_shake_hands_give_way(station: Secure, client: httpx.Client) -> None:
    port = int(station.origin.rpartition(":")[2])
    with contextlib.ExitStack() as held:
        strangers = [
            held.enter_context(socket.create_connection(("127.0.0.1", port), 30.0))
            for _ in range(FROM_ONE_PLACE_MAX + 8)
        ]
        assert client.get("/api/health").status_code == 200
        assert strangers[0].recv(1) == b""


def test_one_who_dawdles_over_the_handshake_is_cut_off_and_one_who_asks_at_once_is_answered(
    files: CertificateFiles, tmp_path: Path
) -> None:
    """The request may come in the same packet as the handshake's end, before anybody is there to read it."""

    async def whole() -> None:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        files.renew(now_utc())
        context.load_cert_chain(files.server)

        async def serve(handshake_s: float) -> tuple[asyncio.Server, int]:
            made = behind_tls(cast(Any, Echo), context, OpenConnections(4, 4), handshake_s=handshake_s)
            server = await asyncio.get_running_loop().create_server(made, "127.0.0.1", 0)
            return server, server.sockets[0].getsockname()[1]

        (hasty, port), (server, patient_port) = await serve(1.0), await serve(60.0)
        reader, dawdling = await asyncio.open_connection("127.0.0.1", port)
        async with asyncio.timeout(60):
            with contextlib.suppress(ConnectionResetError):
                assert await reader.read() == b""
        dawdling.close()
        trusting = ssl.create_default_context(cafile=files.authority)
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        client = trusting.wrap_bio(incoming, outgoing, server_hostname="localhost")
        reader, writer = await asyncio.open_connection("127.0.0.1", patient_port)
        async with asyncio.timeout(60):
            while True:
                try:
                    client.do_handshake()
                    break
                except ssl.SSLWantReadError:
                    writer.write(outgoing.read())
                    incoming.write(await reader.read(65536))
            client.write(b"at once")
            writer.write(outgoing.read())
            while True:
                try:
                    assert client.read() == b"at once"
                    break
                except ssl.SSLWantReadError:
                    incoming.write(await reader.read(65536))
        writer.close()
        await writer.wait_closed()
        for each in (hasty, server):
            each.close()
            await each.wait_closed()

    asyncio.run(whole())


class Echo(asyncio.Protocol):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)

    def data_received(self, data: bytes) -> None:
        self._transport.write(data)


def test_a_tablet_gets_the_authority_and_nothing_else(station: Secure) -> None:
    with httpx.Client(base_url=station.trust_page, timeout=60) as tablet:
        given = tablet.get("/hedgehop-authority.crt")
        assert given.content == station.files.authority.read_bytes()
        assert given.headers["content-type"] == "application/x-x509-ca-cert"
        page = tablet.get("/").text
        assert "<svg" in page
        assert station.origin in page
        for path in ("/api/health", "/login", "/../tls/authority.key", "//etc/passwd"):
            assert tablet.get(path).status_code == 404
        assert tablet.post("/").status_code == 404
    sha256 = hashlib.sha256(ssl.PEM_cert_to_DER_cert(given.text)).hexdigest().upper()
    shown = ":".join(re.findall("..", sha256))
    assert shown in page
    assert shown in station.said


def test_a_new_certificate_is_taken_up_while_it_serves(station: Secure) -> None:
    def serial() -> str:
        with (
            httpx.Client(verify=station.trusting, timeout=60) as client,
            client.stream("GET", f"{station.origin}/signin") as got,
        ):
            return got.extensions["network_stream"].get_extra_info("ssl_object").getpeercert()["serialNumber"]

    before = serial()
    station.files.add_names(["added.example"])
    assert station.files.renew(now_utc())
    ends = time.monotonic() + 180
    while serial() == before and time.monotonic() < ends:
        time.sleep(1)
    assert serial() != before
