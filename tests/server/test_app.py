"""Starting and stopping the process: ports, links, data directories."""

from __future__ import annotations

import asyncio
import signal
import socket
from pathlib import Path
from typing import Any, cast

import pytest
from fastapi.dependencies.utils import get_dependant

from server.app import AnnouncingServer, bound_socket, run
from server.errors import DataDirError, StartError, StorageFullError
from server.library import Library
from server.settings import Settings
from server.web import create_app
from tests.server.fakes import FakeWorkspace
from tests.server.running import fake_fleet, running


def test_a_taken_port_is_a_clear_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(StartError, match=rf"Port {port} is in use.*--port"):
            bound_socket("127.0.0.1", port)


def test_a_foreign_address_is_a_clear_error() -> None:
    with pytest.raises(StartError, match=r"cannot listen on 192\.0\.2\.1"):
        bound_socket("192.0.2.1", 0)


@pytest.mark.parametrize(
    ("host", "start"),
    [("127.0.0.1", "http://127.0.0.1:8123/"), ("0.0.0.0", "http://127.0.0.1:8123/"), ("::1", "http://[::1]:8123/")],
)
def test_the_printed_link_signs_in(tmp_path: Path, host: str, start: str) -> None:
    settings = Settings(data_dir=tmp_path, host=host, port=8123)
    made: list[FakeWorkspace] = []

    def make(library: Library, hub: Any, *_: Any) -> Any:
        made.append(FakeWorkspace(library, hub))
        return made[0]

    library = Library(tmp_path)
    app = create_app(settings, library, make, fake_fleet, demo=True)

    async def whole() -> None:
        async with app.router.lifespan_context(app):
            link = AnnouncingServer(app, settings).link()
            assert link.startswith(start + "login?token=")
            assert app.state.parts.auth.redeem(link.partition("=")[2])

    asyncio.run(whole())
    assert made[0].calls == ["start with demo", "close"]
    library.close()


def test_a_second_instance_is_refused_before_it_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("server.app.configure_logging", lambda level: None)
    with running(tmp_path) as first:
        with pytest.raises(StartError, match=f"Port {first.settings.port} is in use"):
            run(first.settings)
        free = first.settings.model_copy(update={"port": 0})
        with pytest.raises(DataDirError, match="Another Hedgehop"):
            run(free)


def test_a_loop_that_fails_stops_the_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []
    monkeypatch.setattr("server.web.signal.raise_signal", stopped.append)

    async def failing() -> None:
        raise RuntimeError("a defect")

    class Failing(FakeWorkspace):
        def loops(self) -> list:
            return [failing()]

    library = Library(tmp_path)
    app = create_app(
        Settings(data_dir=tmp_path), library, lambda lib, hub, *_: cast(Any, Failing(lib, hub)), fake_fleet
    )

    async def whole() -> None:
        async with app.router.lifespan_context(app):
            await asyncio.sleep(10)

    with pytest.raises(ExceptionGroup):
        asyncio.run(whole())
    assert stopped == [signal.SIGTERM]
    library.close()


def test_an_expected_fault_at_start_is_kept_for_the_command_line(tmp_path: Path) -> None:
    class Full(FakeWorkspace):
        async def start(self, *, with_demo: bool = False) -> None:
            raise StorageFullError("The disk is full.")

    library = Library(tmp_path)
    app = create_app(Settings(data_dir=tmp_path), library, lambda lib, hub, *_: cast(Any, Full(lib, hub)), fake_fleet)

    async def whole() -> None:
        async with app.router.lifespan_context(app):
            pass

    with pytest.raises(ExceptionGroup):
        asyncio.run(whole())
    assert isinstance(app.state.start_error, StorageFullError)
    library.close()


def test_sessions_survive_a_restart(tmp_path: Path) -> None:
    with running(tmp_path) as first:
        session = first.cookie.partition("=")[2]
    with running(tmp_path) as second, second.stranger() as client:
        client.cookies.set(f"hedgehop-{second.settings.port}", session)
        assert client.get("/api/state").status_code == 200


def test_no_route_is_completed_while_the_server_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It would hold up the loop, and with it what a vehicle says, for longer than anything else."""
    with running(tmp_path) as server:
        completed: list[str] = []
        monkeypatch.setattr(
            "fastapi.routing.get_dependant",
            lambda *, path, **given: completed.append(path) or get_dependant(path=path, **given),
        )
        assert server.http.get("/api/state").is_success
        assert server.http.get("/api/nothing").status_code == 404
        assert completed == []
