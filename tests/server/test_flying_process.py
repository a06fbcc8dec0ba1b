"""Servers come and go while a vehicle flies: killed, stopped, started again, and the flight goes on (R5)."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect
from websockets.typing import Origin

from server.cli import UNGUARDED
from telemetry.bus.node_lock import running_nodes
from tests.free_ports import free_port
from tests.server.running import client
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle
from tests.server.station import PATIENCE_S, ok
from tests.server.test_process import command

pytestmark = [pytest.mark.xdist_group("real-time"), pytest.mark.slow]

LONG_S = 3 * PATIENCE_S
HOME = "37.729020492,14.992623645,1711.986"
"""Of the demo's plan."""


_started: list[Server] = []


class Server:
    """``hedgehop serve`` as a process, with one page that keeps its session from server to server."""

    def __init__(
        self, data_dir: Path, address: str, cookies: httpx.Cookies | None = None, *, port: int, guarded: bool = False
    ) -> None:
        self.port, self.origin = port, f"http://127.0.0.1:{port}"
        start = [word for word in command(data_dir, port, "--link", address) if not (guarded and word == UNGUARDED)]
        self.process = subprocess.Popen(start, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.http = client(self.origin, timeout=LONG_S, cookies=cookies)
        _started.append(self)
        link = self._link()
        if cookies is None:
            self.http.get(link)

    def _link(self) -> str:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if found := re.search(r"/login\?token=\S+", line):
                return found.group()
        raise AssertionError(f"ended with {self.process.wait()}")

    def until(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """On a page of its own: what is kept is told at once."""
        cookie = f"hedgehop-{self.port}={self.http.cookies[f'hedgehop-{self.port}']}"
        headers, end = {"Cookie": cookie}, time.monotonic() + LONG_S
        with connect(
            f"ws://127.0.0.1:{self.port}/ws", origin=Origin(self.origin), additional_headers=headers, max_size=None
        ) as page:
            while True:
                message = json.loads(page.recv(timeout=max(0.01, end - time.monotonic())))
                if wanted(message):
                    return message

    def post(self, path: str, **body: object) -> Any:
        answer = ok(self.http.post(path, json=body))
        return answer.json() if answer.content else None

    def pid(self) -> int:
        """Of the server under the guardian."""
        oldest, *_spare = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        return int(oldest)

    def answers_again(self) -> dict[str, Any]:
        """What a page is told first by a server that was started again."""
        end = time.monotonic() + LONG_S
        while True:
            try:
                return self.until(lambda m: m["type"] == "alarms" and bool(m["alarms"]))["alarms"][0]["error"]
            except (OSError, WebSocketException):
                assert time.monotonic() < end
                time.sleep(0.2)

    def end(self, number: signal.Signals) -> str:
        """What the terminal said after the link."""
        self.process.send_signal(number)
        words, _ = self.process.communicate(timeout=LONG_S)
        self.http.close()
        return words


@pytest.fixture
def data_dir(tmp_path: Path) -> Iterator[Path]:
    """Whatever fails, nothing that was started is left."""
    yield tmp_path
    while _started:
        server = _started.pop()
        if server.process.poll() is None:
            for child in Path(f"/proc/{server.process.pid}/task/{server.process.pid}/children").read_text().split():
                os.kill(int(child), signal.SIGKILL)
            server.end(signal.SIGKILL)
    for facts in running_nodes(tmp_path / "run"):
        os.kill(facts.pid, signal.SIGKILL)


def _flown(message: dict[str, Any], metres: float) -> bool:
    follow = message.get("follow")
    return message["type"] == "vehicle" and follow is not None and (follow["s_m"] or 0.0) > metres


def _fly(server: Server) -> str:
    """The demo's mission, until it is under way. Its digest."""
    server.post("/api/lease/take")
    server.post("/api/terrains/demo")
    server.until(lambda m: m["type"] == "plan" and m["plan"]["computation"]["state"] == "ready")
    server.until(
        lambda m: (
            m["type"] == "vehicle" and bool(m["state"] and m["state"]["estimator_ok"] and m["state"]["ready_to_arm"])
        )
    )
    revision = ok(server.http.get("/api/state")).json()["plan"]["revision"]
    server.post("/api/flight/upload", revision=revision)
    digest = server.post("/api/flight/check")["onboard"]["digest"]
    server.post("/api/flight/start", digest=digest, accept=["gnss", "battery", "rtl_height"])
    server.until(lambda m: _flown(m, 10.0))
    return digest


def test_a_flight_outlives_its_servers(data_dir: Path) -> None:
    """One flight, as each takes its time: a server that hangs, one that dies, one that is stopped, and the next."""
    with simulated_vehicle(HOME, "--boot-s", 1, "--parameter", "RTL_ALT=6000", *QUICKLY_DOWN) as address:
        guarded = Server(data_dir, address, port=free_port(), guarded=True)
        cookies = guarded.http.cookies
        digest = _fly(guarded)
        pids = _nodes(data_dir)
        assert set(pids) == {"link", "recorder"}
        for fault in (signal.SIGSTOP, signal.SIGKILL):
            _is_started_again(guarded, fault)
            _finds_the_flight(guarded, digest)
            assert _nodes(data_dir) == pids
        guarded.post("/api/flight/pause")
        guarded.until(lambda m: m["type"] == "flight" and m["flight"]["phase"] == "paused")
        words = guarded.end(signal.SIGINT)
        assert "The vehicle is armed" in words
        assert "login?token" not in words
        assert _nodes(data_dir) == pids

        last = Server(data_dir, address, cookies, port=guarded.port)
        _finds_the_flight(last, digest)
        last.post("/api/flight/land")
        last.until(lambda m: m["type"] == "vehicle" and bool(m["state"] and not m["state"]["armed"]))
        assert "armed" not in last.end(signal.SIGINT)
        assert running_nodes(data_dir / "run") == []


def _nodes(data_dir: Path) -> dict[str, int]:
    return {facts.name: facts.pid for facts in running_nodes(data_dir / "run")}


def _is_started_again(server: Server, fault: signal.Signals) -> None:
    before = server.pid()
    os.kill(before, fault)
    notice = server.answers_again()
    assert notice["code"] == "server_restarted"
    assert re.match(r"The server did not answer for \d+ s and was started again at [\d:]{8} UTC\.", notice["what"])
    assert server.pid() != before
    server.until(lambda m: m["type"] == "link" and m["link"]["state"] == "live" and m["link"]["heartbeat_hz"] > 0.5)


def _finds_the_flight(server: Server, digest: str) -> None:
    """All of it: also what was flown before this server came."""
    assert server.until(lambda m: _flown(m, 10.0))["state"]["armed"]
    onboard = server.until(lambda m: m["type"] == "fly" and m["fly"]["onboard"]["state"] == "verified")["fly"][
        "onboard"
    ]
    assert (onboard["digest"], onboard["plan_name"], onboard["is_open_plan"]) == (digest, "Demo flight", True)
    path = server.until(lambda m: m["type"] == "track" and len(m["track"]["t_s"]) > 5)["track"]
    assert min(s for s in path["s_m"] if s is not None) < 5.0
    assert server.until(lambda m: m["type"] == "lease")["lease"]["mine"]
