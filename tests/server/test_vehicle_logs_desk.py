"""Reading a log into the library: what breaks it off is said, and nothing is left behind."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.errors import ConflictError, NotFoundError
from server.flying.vehicle_log_desk import VehicleLogs
from server.schemas import LogDownloadDoc
from telemetry.errors import NotAllowedError
from telemetry.topics.requests import ListVehicleLogs, Operator, ReadVehicleLog
from telemetry.topics.vehicle import VehicleState
from telemetry.topics.vehicle_logs import MOST_BYTES, VehicleLog

ANNA = Operator("anna", 1)
LOGS = (VehicleLog(2, 3 * MOST_BYTES, None), VehicleLog(1, 100, 1_700_000_000.0))


class Link:
    """Answers each stretch as the test says."""

    def __init__(self, stretch: Callable[[ReadVehicleLog], bytes]) -> None:
        self._stretch = stretch
        self.asked: list[ReadVehicleLog] = []

    async def call(self, request: Any) -> Any:
        await asyncio.sleep(0)
        if isinstance(request, ListVehicleLogs):
            return LOGS
        self.asked.append(request)
        return self._stretch(request)


class Library:
    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def new_upload(self, suffix: str) -> Path:
        return self._folder / f"upload{suffix}"


class Recordings:
    def __init__(self) -> None:
        self.added: list[tuple[str, int]] = []

    async def add(self, upload: Path, name: str) -> Any:
        self.added.append((name, upload.stat().st_size))
        return SimpleNamespace(id="a" * 16)


def run(
    folder: Path, stretch: Callable[[ReadVehicleLog], bytes], number: int = 2, *, cancel: bool = False, name: str = ""
) -> tuple[LogDownloadDoc, Link, Recordings]:
    async def go() -> tuple[LogDownloadDoc, Link, Recordings]:
        link, recordings = Link(stretch), Recordings()
        live = SimpleNamespace(state=VehicleState(3, 1, autopilot="ardupilot"))
        logs = VehicleLogs(cast(Any, link), cast(Any, live), cast(Any, Library(folder)), name)
        running = asyncio.create_task(logs.run())
        await logs.ask(ANNA)
        doc = logs.download(ANNA, number, cast(Any, recordings)).download
        with pytest.raises(ConflictError):
            logs.download(ANNA, 1, cast(Any, recordings))
        while doc is None or doc.state == "reading":
            if cancel and doc is not None and doc.read_bytes:
                logs.cancel()
            await asyncio.sleep(0)
            doc = logs.doc.download
        running.cancel()
        return doc, link, recordings

    made = asyncio.run(go())
    assert list(folder.iterdir()) == []
    return made


def whole(request: ReadVehicleLog) -> bytes:
    return bytes(request.size)


def test_a_whole_log_comes_into_the_library(tmp_path: Path) -> None:
    doc, link, recordings = run(tmp_path, whole)
    assert (doc.state, doc.recording_id, doc.read_bytes) == ("done", "a" * 16, 3 * MOST_BYTES)
    assert recordings.added == [("vehicle-3-log-2.bin", 3 * MOST_BYTES)]
    assert [request.is_last for request in link.asked] == [False, False, True]
    _, _, recordings = run(tmp_path, whole, name="Wasp")
    assert recordings.added == [("Wasp-log-2.bin", 3 * MOST_BYTES)], "another vehicle may have the same number"


def test_a_vehicle_that_is_armed_meanwhile_ends_it(tmp_path: Path) -> None:
    def armed(request: ReadVehicleLog) -> bytes:
        if request.offset:
            raise NotAllowedError("The vehicle was armed.", advice="Land it.")
        return bytes(request.size)

    doc, _, recordings = run(tmp_path, armed)
    assert doc.state == "failed"
    assert doc.error is not None
    assert doc.error.what == "The vehicle was armed."
    assert recordings.added == []


def test_a_log_that_is_shorter_than_the_vehicle_said_is_not_taken_for_whole(tmp_path: Path) -> None:
    doc, _, recordings = run(tmp_path, lambda request: bytes(request.size - 1))
    assert doc.state == "failed"
    assert doc.error is not None
    assert "ends after" in doc.error.what
    assert recordings.added == []


def test_it_is_cancelled_after_the_stretch_that_is_under_way(tmp_path: Path) -> None:
    doc, link, recordings = run(tmp_path, whole, cancel=True)
    assert doc.state == "cancelled"
    assert len(link.asked) < 3
    assert recordings.added == []


def test_a_list_is_that_of_the_vehicle_that_was_asked(tmp_path: Path) -> None:
    async def go() -> None:
        live = SimpleNamespace(state=VehicleState(3, 1))
        logs = VehicleLogs(cast(Any, Link(whole)), cast(Any, live), cast(Any, Library(tmp_path)))
        assert logs.doc.logs is None
        assert [entry.number for entry in (await logs.ask(ANNA)).logs or []] == [2, 1]
        live.state = VehicleState(4, 1)
        assert logs.doc.logs is None
        with pytest.raises(NotFoundError):
            logs.download(ANNA, 2, cast(Any, Recordings()))

    asyncio.run(go())
