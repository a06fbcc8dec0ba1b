"""A whole ground station, with its real workspace, 3D view and worker processes, and one page that listens to it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
from pydantic import TypeAdapter
from websockets.sync.connection import Connection

from server.fleet import Fleet
from server.schemas import (
    Computation,
    ErrorDoc,
    JobDoc,
    JobMessage,
    LibraryState,
    NoticeMessage,
    PlanDoc,
    PlanMessage,
    PlanState,
    ServerMessage,
    Snapshot,
)
from server.workspace import Workspace
from tests.server.running import Running, fake_fleet, running

PATIENCE_S = 90.0
"""A worker may have to start and to compile kernels, on a busy machine."""
_MESSAGE: TypeAdapter[Any] = TypeAdapter(ServerMessage)


class Station:
    """``until`` waits for messages of the stream: nothing here sleeps."""

    def __init__(self, server: Running, socket: Connection) -> None:
        self.server, self.http, self.socket = server, server.http, socket
        self._jobs: dict[str, JobDoc] = {}
        self.snapshot: Snapshot = self.until(lambda message: isinstance(message, Snapshot))
        self.page_id = self.snapshot.page_id

    def until(self, wanted: Callable[[Any], bool], patience_s: float = PATIENCE_S) -> Any:
        end = time.monotonic() + patience_s
        while True:
            message = _MESSAGE.validate_json(self.socket.recv(timeout=max(0.0, end - time.monotonic())))
            if isinstance(message, JobMessage):
                self._jobs[message.job.id] = message.job
            if wanted(message):
                return message

    def notice(self) -> ErrorDoc:
        return self.until(lambda message: isinstance(message, NoticeMessage)).error

    @property
    def state(self) -> PlanState:
        return Snapshot.model_validate_json(self.http.get("/api/state").text).plan

    @property
    def library(self) -> LibraryState:
        return Snapshot.model_validate_json(self.http.get("/api/state").text).library

    def put(self, document: PlanDoc, label: str = "Edit", **more: Any) -> PlanState:
        body = {"base_revision": self.state.revision, "label": label, "document": document.model_dump(), **more}
        return PlanState.model_validate_json(ok(self.http.put("/api/plan", json=body)).text)

    def change(self, label: str = "Edit", **fields: Any) -> PlanState:
        """An edit of top-level fields."""
        document = PlanDoc.model_validate({**self.state.document.model_dump(), **fields})
        return self.put(document, label)

    def post(self, path: str, **options: Any) -> PlanState:
        return PlanState.model_validate_json(ok(self.http.post(path, **options)).text)

    def answer(self, *, trade: bool = False) -> Computation:
        """What the present document came to."""
        revision = self.state.revision

        def settled(answer: Computation) -> bool:
            done = answer.revision >= revision and answer.state in ("ready", "error", "empty")
            return done and (not trade or answer.result is None or bool(answer.result.trade))

        present = self.state.computation
        if settled(present):
            return present
        return self.until(lambda m: isinstance(m, PlanMessage) and settled(m.plan.computation)).plan.computation

    def upload(self, name: str, data: bytes, kind: str = "terrains", **query: str) -> JobDoc:
        """The job of an uploaded file, ended."""
        response = self.http.post(
            f"/api/{kind}",
            params={"filename": name, **query},
            content=data,
            headers={"Content-Type": "application/octet-stream"},
        )
        return self.ended(JobDoc.model_validate_json(ok(response).text).id)

    def ended(self, job_id: str) -> JobDoc:
        """It may have come before what the job led to: the newest of a kind is sent in the place of the oldest."""

        def is_over() -> bool:
            return job_id in self._jobs and self._jobs[job_id].state != "running"

        if not is_over():
            self.until(lambda _: is_over())
        return self._jobs[job_id]

    def uploads_left(self) -> list[Path]:
        return list((self.server.settings.data_dir / "uploads").iterdir())


def ok(response: httpx.Response) -> httpx.Response:
    assert response.is_success, f"{response.status_code} {response.text}"
    return response


@contextlib.contextmanager
def station(data_dir: Path, *, demo: bool = False, flies: bool = False, **overrides: Any) -> Iterator[Station]:
    """``flies``: with a bus and nodes, which planning alone does not need.

    The demo's vehicle meets no obstacles unless ``demo_world=True`` is given.
    """
    overrides.setdefault("demo_world", False)
    fleet = Fleet.open if flies else fake_fleet
    with running(data_dir, make=Workspace, fleet=fleet, demo=demo, **overrides) as server:
        server.http.timeout = httpx.Timeout(PATIENCE_S)
        with server.socket() as socket:
            made = Station(server, socket)
            if flies:
                ok(made.http.post("/api/lease/take", headers={"Hedgehop-Vehicle": "1"}))
            yield made
