"""Why a router and a station refuse each other, as it is told; with Zenoh's own router and its TLS."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from server.door.certificates import CertificateFiles, now_utc
from server.door.station_files import ROUTER_FILE, write_station_files
from telemetry.stations import station_proof
from telemetry.stations.station_proof import Route, ends_soon, why_refused
from tests.free_ports import free_port
from tests.telemetry.bus_runs import run, short_folder
from tests.telemetry.station_fleet import Router

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]


@pytest.fixture(autouse=True)
def _patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A busy machine is no reason. Zenoh's router ends what does not speak after 10 s: that is not waited for."""
    monkeypatch.setattr(station_proof, "_ANSWERS_S", 30.0)
    monkeypatch.setattr(station_proof, "_REFUSES_S", 4.0)


def _write(folder: Path, port: int, *, made: timedelta = timedelta(), authority: str = "data") -> Path:
    """The files of one station and its router, made so long ago."""
    made_at = now_utc() - made
    endpoint = f"tls/127.0.0.1:{port}"
    write_station_files(
        folder / "fleet", CertificateFiles(folder / authority), ["Alpha"], ["127.0.0.1"], made_at, listen=[endpoint]
    )
    return folder / "fleet"


def _with_router(begin: Callable[[Path, int], Path], ask: Callable[[Path, int], None]) -> None:
    """``begin`` writes the router's file; ``ask`` runs while the router does."""

    async def whole(folder: Path) -> None:
        port = free_port()
        router = Router(begin(folder, port) / ROUTER_FILE)
        await router.start()
        try:
            await asyncio.to_thread(ask, folder, port)
        finally:
            router.kill()

    with short_folder() as folder:
        run(lambda: whole(folder))


def test_a_router_that_is_well_refuses_what_is_not_its_own_and_says_why() -> None:
    def ask(folder: Path, port: int) -> None:
        route = Route((f"tls/127.0.0.1:{port}",), folder / "fleet" / "Alpha.pem")
        assert ends_soon(route, now_utc()) == ""
        assert "not as Zenoh's does" in why_refused(route, now_utc())
        named = Route((f"tls/localhost:{port}",), route.file)
        assert f"The router's certificate is not for localhost:{port}" in why_refused(named, now_utc())
        # Signed by another authority, and trusting it: each refuses the other.
        route.file.write_bytes((_write(folder / "others", port) / "Alpha.pem").read_bytes())
        assert "is of another authority" in why_refused(route, now_utc())
        # Signed by another one, and trusting the right one: the router alone refuses.
        parts = route.file.read_text().split("-----BEGIN ")
        right = (folder / "data" / "tls" / "authority.pem").read_text().split("-----BEGIN ")
        route.file.write_text("-----BEGIN ".join([*parts[:-1], right[-1]]))
        assert "refuses this station's certificate" in why_refused(route, now_utc())
        # One that is no router, and one of two that is away.
        away = Route(("tls/127.0.0.1:1", f"tls/localhost:{port}"), route.file)
        assert why_refused(away, now_utc()).startswith("No router answers at 127.0.0.1:1 (")
        assert "is not for localhost" in why_refused(away, now_utc())
        assert "its name is not known" in why_refused(Route(("tls/nowhere.invalid:7447",), route.file), now_utc())

    _with_router(_write, ask)


def test_one_that_ends_the_connection_without_a_word_has_not_let_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tls = MagicMock()
    tls.wrap_socket.return_value.__enter__.return_value.recv.return_value = b""
    monkeypatch.setattr(station_proof.ssl, "create_default_context", lambda **_: tls)
    monkeypatch.setattr(station_proof.socket, "create_connection", MagicMock())
    route = Route(("tls/127.0.0.1:7447",), _write(tmp_path, 7447) / "Alpha.pem")
    assert "ends the connection without a word" in why_refused(route, now_utc())
    assert ends_soon(route, now_utc()) == ""


def test_a_routers_certificate_that_ends_is_told_ahead_and_when_it_has_ended() -> None:
    def soon(folder: Path, port: int) -> Path:
        return _write(folder, port, made=timedelta(days=380))

    def ended(folder: Path, port: int) -> Path:
        return _write(folder, port, made=timedelta(days=400))

    def ask(folder: Path, port: int) -> None:
        # The station's own file is new, of the same authority.
        alpha = _write(folder, port) / "Alpha.pem"
        told.append(ends_soon(Route((f"tls/127.0.0.1:{port}",), alpha), now_utc()))
        told.append(why_refused(Route((f"tls/127.0.0.1:{port}",), alpha), now_utc()))

    told = list[str]()
    _with_router(soon, ask)
    _with_router(ended, ask)
    assert told[0].startswith("The certificate of the router 127.0.0.1:")
    assert "restart the router" in told[0]
    assert told[2] == ""
    assert "has ended, or a clock is wrong" in told[3]
