"""One flight of the demo over its obstacles: the real station under its guardian, and what became of it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from telemetry.bus.node_lock import running_node, running_nodes
from telemetry.recording.flight_log import read_flight_log
from telemetry.recording.recorded_flight import FlightLog
from tests.free_ports import free_port
from tests.soak.faults import Done, Fault, do
from tests.soak.page import Page

PATIENCE_S = 180.0
BACK_S = 30.0
"""For the station to be whole again after a fault, on a busy machine."""


class SoakError(Exception):
    """The flight did not come about: nothing can be said of it."""


@dataclass(frozen=True, slots=True)
class Flown:
    """All that the verdict needs."""

    page: Page
    done: tuple[Done, ...]
    begun_s: float
    ended_s: float
    digest: str
    """Of the mission that was started."""
    logs: tuple[FlightLog, ...]


@contextmanager
def station(data_dir: Path) -> Iterator[tuple[subprocess.Popen[str], int, str]]:
    """``hedgehop serve --demo`` under its guardian; nothing of it is left after. Process, port, sign-in path."""
    port = free_port()
    start = [sys.executable, "-m", "server", "serve", "--demo", "--port", str(port), "--data-dir", str(data_dir)]
    process = subprocess.Popen(start, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        assert process.stdout is not None
        found = next((m for line in process.stdout if (m := re.search(r"/login\?token=\S+", line))), None)
        if found is None:
            raise SoakError(f"The station ended with {process.wait()}.")
        yield process, port, found.group()
    finally:
        for pid in _children(process.pid):
            os.kill(pid, signal.SIGKILL)
        process.kill()
        process.communicate(timeout=30)
        for facts in running_nodes(data_dir / "run"):
            os.kill(facts.pid, signal.SIGKILL)


def _children(pid: int) -> list[int]:
    return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def fly(faults: tuple[Fault, ...], seconds: float) -> Flown:
    """``seconds`` of flight from the start on. Raises SoakError."""
    with tempfile.TemporaryDirectory(prefix="hedgehop-soak-") as folder:
        data_dir = Path(folder)
        with station(data_dir) as (process, port, sign_in):
            page = Page(port, sign_in)
            try:
                digest = _start(page)
                begun_s, done = time.monotonic(), []
                for fault in faults:
                    time.sleep(max(0.0, begun_s + fault.after_s - time.monotonic()))
                    if pid := _pid(fault.who, process.pid, data_dir):
                        done.append(_whole_again(page, do(fault, pid), data_dir))
                time.sleep(max(0.0, begun_s + seconds - time.monotonic()))
                ended_s = time.monotonic()
                if page.failed:
                    raise SoakError(f"The page itself failed: {page.failed}")
                logs = tuple(map(read_flight_log, sorted((data_dir / "recordings").glob("*.mcap"))))
                return Flown(page, tuple(done), begun_s, ended_s, digest, logs)
            finally:
                page.close()


def _start(page: Page) -> str:
    """Up in the air, with avoidance on. The digest of its mission."""
    _ok(page, "/api/lease/take")
    _wait(
        page,
        lambda m: (
            m["type"] == "vehicle" and bool(m["state"] and m["state"]["ready_to_arm"] and m["state"]["estimator_ok"])
        ),
    )
    give_up_s = time.monotonic() + PATIENCE_S
    while (state := page.http.get("/api/state").json()["plan"])["computation"]["state"] != "ready":
        if time.monotonic() > give_up_s:
            raise SoakError("The demo's plan was never ready.")
        time.sleep(0.5)
    _ok(page, "/api/flight/upload", revision=state["revision"])
    while True:
        checked = _ok(page, "/api/flight/check")
        wanting = [row["code"] for row in checked["preflight"]["rows"] if row["state"] != "good"]
        if not wanting:
            break
        if time.monotonic() > give_up_s:
            raise SoakError(f"The check before the start never came out well: {', '.join(wanting)}.")
        time.sleep(1.0)
    digest = checked["onboard"]["digest"]
    _ok(page, "/api/flight/start", digest=digest)
    _wait(page, lambda m: m["type"] == "vehicle" and bool(m["state"] and m["state"]["armed"]))
    return digest


def _ok(page: Page, path: str, **body: object) -> dict:
    answer = page.post(path, **body)
    if not answer.is_success:
        raise SoakError(f"{path}: {answer.status_code} {answer.text}")
    return answer.json() if answer.content else {}


def _wait(page: Page, wanted) -> None:
    if page.until(wanted, 0.0, PATIENCE_S) is None:
        raise SoakError("The vehicle was never ready, or did not arm.")


def records_again(page: Page, done: Done) -> bool:
    """It proves that it works before it has found the file that it goes on with; a file tells of a gap from then on."""
    said = (told.message["recorder"] for told in page.since(done.until_s, "recorder"))
    return any(
        status["t_mono_s"] > done.until_s + 0.1 and status["recording"] and status["messages"] > 0 for status in said
    )


def _pid(who: str, guardian: int, data_dir: Path) -> int | None:
    if who == "server":
        return _children(guardian)[0]
    facts = running_node(data_dir / "run", who)
    return None if facts is None else facts.pid


def _whole_again(page: Page, done: Done, data_dir: Path) -> Done:
    """One fault after the other: what is told of one is not that of the next."""
    give_up_s, who = time.monotonic() + BACK_S, done.fault.who
    while time.monotonic() < give_up_s:
        if who == "server":
            is_back = page.connected and any(page.since(done.until_s + 0.1, "vehicle"))
        else:
            facts = running_node(data_dir / "run", who)
            is_back = facts is not None and facts.proved_t_mono_s > done.until_s + 0.1
        if is_back and (who != "recorder" or records_again(page, done)):
            return replace(done, back_s=time.monotonic())
        time.sleep(0.1)
    return done
