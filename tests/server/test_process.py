"""``hedgehop serve`` as a process: a second one, a directory it cannot use, a full disk, a kill."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from server.cli import UNGUARDED
from server.library import Library
from server.library.history import History
from server.plan.demo import PLAN_NAME
from tests.free_ports import free_port
from tests.server.cli_runs import hedgehop
from tests.server.running import client
from tests.server.station import PATIENCE_S, ok

pytestmark = pytest.mark.xdist_group("process")


def command(data_dir: Path, port: int, *more: str) -> list[str]:
    """The server itself: what is killed here stays dead (``test_guardian`` has the others)."""
    start = [sys.executable, "-m", "server", "serve", UNGUARDED]
    return [*start, "--port", str(port), "--data-dir", str(data_dir), *more]


class Serving:
    """The process, and its operator's client."""

    def __init__(self, process: subprocess.Popen[str], port: int) -> None:
        self.process = process
        origin = f"http://127.0.0.1:{port}"
        self.http = client(origin, timeout=PATIENCE_S)
        assert process.stdout is not None
        for line in process.stdout:
            if found := re.search(r"/login\?token=\S+", line):
                self.http.get(found.group())
                return
        raise AssertionError(f"ended with {process.wait()}")

    @property
    def plan(self) -> dict:
        return ok(self.http.get("/api/state")).json()["plan"]

    def rename(self, name: str) -> httpx.Response:
        plan = self.plan
        document = {**plan["document"], "name": name}
        return self.http.put("/api/plan", json={"base_revision": plan["revision"], "label": "x", "document": document})

    def workers(self) -> list[int]:
        """Process ids of its children but the nodes, which stand in sessions of their own."""
        threads = Path(f"/proc/{self.process.pid}/task").iterdir()
        children = [int(child) for thread in threads for child in (thread / "children").read_text().split()]
        return [pid for pid in children if os.getsid(pid) != pid]


@contextlib.contextmanager
def serving(data_dir: Path, *more: str) -> Iterator[Serving]:
    port = free_port()
    process = subprocess.Popen(
        command(data_dir, port, *more), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        station = Serving(process, port)
        with contextlib.closing(station.http):
            yield station
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
        process.communicate(timeout=PATIENCE_S)


def refused(data_dir: Path, port: int) -> str:
    run = hedgehop(*command(data_dir, port)[3:])
    assert (run.code, run.out) == (2, ""), run.err
    assert "Traceback" not in run.err
    return run.err


def test_a_second_one_is_refused_and_the_first_goes_on(tmp_path: Path) -> None:
    with serving(tmp_path) as first:
        port = int(first.http.base_url.port or 0)
        assert f"Port {port} is in use" in refused(tmp_path / "other", port)
        message = refused(tmp_path, free_port())
        assert f"Another Hedgehop (process {first.process.pid}) uses this data directory" in message
        assert "--data-dir" in message
        assert first.http.get("/api/health").status_code == 200


def test_a_data_directory_that_cannot_be_used(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert str(blocked) in refused(blocked, free_port())
    assert "cannot be written" in refused(Path("/proc/hedgehop"), free_port())


def test_a_kill_leaves_no_worker_and_the_demo_is_there_at_once_the_second_time(tmp_path: Path) -> None:
    """Nodes are taken over by the second one (``test_supervisor``), or end by themselves (``test_node``)."""
    with serving(tmp_path, "--demo") as first:
        terrain = ok(first.http.post("/api/terrains/demo")).json()
        handles = [os.pidfd_open(pid) for pid in first.workers()]
        assert handles
        first.process.kill()
        first.process.wait(PATIENCE_S)
        for handle in handles:
            assert _ended(handle)
    with serving(tmp_path, "--demo") as second:
        plan = second.plan
        assert (plan["document"]["name"], plan["document"]["terrain_id"]) == (PLAN_NAME, terrain["id"])


def _ended(handle: int) -> bool:
    """A process's handle is readable once it has ended."""
    try:
        return bool(select.select([handle], [], [], PATIENCE_S)[0])
    finally:
        os.close(handle)


@pytest.fixture(params=["2m"])
def small_disk(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    """A file system of its own, as large as its parameter says."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", f"size={request.param}", "tmpfs", str(folder)], capture_output=True, check=False
    )
    if mounted.returncode != 0:
        pytest.skip("this user may not mount a small disk; test_plan_desk covers the same without")
    try:
        yield folder
    finally:
        subprocess.run(["umount", str(folder)], check=True)


def test_a_full_disk_loses_no_edit(small_disk: Path) -> None:
    data_dir = small_disk / "data"
    with serving(data_dir) as station:
        saved = ok(station.rename("Saved")).json()["saved_utc"]
        ballast = fill(small_disk)
        state = ok(station.rename("Held in memory")).json()
        assert (state["document"]["name"], state["saved_utc"]) == ("Held in memory", saved)
        upload = station.http.post(
            "/api/terrains",
            params={"filename": "a.tif"},
            content=bytes(1_000_000),
            headers={"Content-Type": "application/octet-stream"},
        )
        assert (upload.status_code, upload.json()["code"]) == (507, "disk_full")
        left = station.http.post("/api/plan/new")
        assert (left.status_code, left.json()["code"]) == (507, "disk_full")
        assert station.plan["document"]["name"] == "Held in memory"
        ballast.unlink()
        assert ok(station.rename("Saved again")).json()["saved_utc"] > saved
    kept = kept_plan(data_dir)
    assert kept.present.name == "Saved again"
    assert kept.can_undo


def kept_plan(data_dir: Path) -> History:
    """The one that the next server opens."""
    with contextlib.closing(Library(data_dir)) as library:
        plan_id = library.last_plan()
        assert plan_id is not None
        return library.load_plan(plan_id)


def fill(disk: Path) -> Path:
    """To the last byte."""
    ballast = disk / "ballast"
    with contextlib.suppress(OSError), ballast.open("ab", buffering=0) as file:
        while file.write(bytes(4096)):
            pass
    return ballast


@pytest.mark.parametrize("small_disk", ["64m"], indirect=True)
def test_a_killed_server_comes_back_on_a_full_disk(small_disk: Path) -> None:
    data_dir = small_disk / "data"
    with serving(data_dir, "--no-demo-world") as station:
        ok(station.rename("Before"))
        deadline = time.monotonic() + PATIENCE_S
        while not (data_dir / "reserve").is_file() and time.monotonic() < deadline:
            time.sleep(0.1)
        assert (data_dir / "reserve").stat().st_blocks * 512 >= 1_000_000
        station.process.kill()
    for name, reserve in (("With a reserve", True), ("Without one", False)):
        (data_dir / "recordings" / "old.tlog").write_bytes(bytes(3_000_000))
        if not reserve:
            (data_dir / "reserve").unlink(missing_ok=True)
        before = kept_plan(data_dir).present.name
        _comes_back(small_disk, before, name)
    assert kept_plan(data_dir).present.name == "Without one"


def _comes_back(disk: Path, before: str, after: str) -> None:
    data_dir, old = disk / "data", disk / "data" / "recordings" / "old.tlog"
    ballast = fill(disk)
    assert shutil.disk_usage(disk).free == 0
    with serving(data_dir) as again:
        # Serving has signed in by the link that was printed.
        assert again.plan["document"]["name"] == before
        origin = str(again.http.base_url).rstrip("/")
        cookies = "; ".join(f"{name}={value}" for name, value in again.http.cookies.items())
        with connect(
            origin.replace("http", "ws") + "/ws",
            origin=origin,  # pyright: ignore[reportArgumentType]
            additional_headers={"Cookie": cookies},
        ) as page:
            said = alarm(page, "disk_full")
            assert "Delete old recordings" in said["advice"]
            listed = ok(again.http.get("/api/recordings")).json()
            assert [(entry["name"], entry["bytes"]) for entry in listed] == [("old.tlog", 3_000_000)]
            ok(again.http.delete(f"/api/recordings/{listed[0]['id']}"))
            assert not old.exists()
            ballast.unlink()
            notice(page, "disk_room")
        assert ok(again.rename(after)).json()["saved_utc"]
        again.process.kill()


def alarm(page: Connection, code: str) -> dict:
    while True:
        message = json.loads(page.recv(PATIENCE_S))
        for each in message.get("alarms", []):
            if each["error"]["code"] == code:
                return each["error"]


def notice(page: Connection, code: str) -> dict:
    while True:
        message = json.loads(page.recv(PATIENCE_S))
        if message["type"] == "notice" and message["error"]["code"] == code:
            return message["error"]


@pytest.mark.parametrize("small_disk", ["64m"], indirect=True)
def test_a_full_disk_without_a_plan_is_no_reason_not_to_start(small_disk: Path) -> None:
    data_dir = small_disk / "data"
    with contextlib.closing(Library(data_dir)) as library:
        plan_id, _ = library.create_plan(History())
        library.remember_plan(plan_id)
    (data_dir / "plans" / plan_id / "manifest.json").write_text("damaged")
    ballast = fill(small_disk)
    assert shutil.disk_usage(small_disk).free == 0
    with serving(data_dir) as station:
        assert station.plan["document"]["pois"] == []
        ballast.unlink()
        assert ok(station.rename("Kept")).json()["saved_utc"]
