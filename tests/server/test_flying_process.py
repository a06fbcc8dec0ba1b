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
from tests.server.running import client
from tests.server.simulated import QUICKLY_DOWN, simulated_vehicle
from tests.server.station import PATIENCE_S, ok
from tests.server.test_process import command, free_port

pytestmark = [pytest.mark.xdist_group("process"), pytest.mark.slow]

LONG_S = 3 * PATIENCE_S
HOME = "37.729020492,14.992623645,1711.986"
"""Of the demo's plan."""
SPEEDUP = 2
"""It is still on its mission when the second server has started."""


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
                return self.until(lambda m: m["type"] == "notice")["error"]
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


@pytest.mark.parametrize("fault", [signal.SIGSTOP, signal.SIGKILL])
def test_a_server_that_hangs_or_dies_in_flight_is_started_again(data_dir: Path, fault: signal.Signals) -> None:
    with simulated_vehicle(HOME, "--parameter", "RTL_ALT=6000", *QUICKLY_DOWN) as address:
        server = Server(data_dir, address, port=free_port(), guarded=True)
        digest = _fly(server)
        pids = {facts.name: facts.pid for facts in running_nodes(data_dir / "run")}
        before = server.pid()
        os.kill(before, fault)
        notice = server.answers_again()
        assert notice["code"] == "server_restarted"
        assert re.match(r"The server did not answer for \d+ s and was started again at [\d:]{8} UTC\.", notice["what"])
        assert server.pid() != before
        assert server.until(lambda m: m["type"] == "vehicle" and bool(m["state"]))["state"]["armed"]
        onboard = server.until(lambda m: m["type"] == "fly" and m["fly"]["onboard"]["state"] == "verified")["fly"]
        assert onboard["onboard"]["digest"] == digest
        assert {facts.name: facts.pid for facts in running_nodes(data_dir / "run")} == pids
        assert server.until(lambda m: m["type"] == "lease")["lease"]["mine"]
        server.until(lambda m: m["type"] == "link" and m["link"]["state"] == "live" and m["link"]["heartbeat_hz"] > 0.5)
        server.post("/api/flight/land")
        server.until(lambda m: m["type"] == "vehicle" and bool(m["state"] and not m["state"]["armed"]))
        assert "login?token" not in server.end(signal.SIGINT)
        assert running_nodes(data_dir / "run") == []


def test_a_flight_outlives_its_servers(data_dir: Path) -> None:
    port = free_port()
    with simulated_vehicle(HOME, "--speedup", SPEEDUP, "--parameter", "RTL_ALT=6000", *QUICKLY_DOWN) as address:
        first = Server(data_dir, address, port=port)
        cookies = first.http.cookies
        digest = _fly(first)
        pids = {facts.name: facts.pid for facts in running_nodes(data_dir / "run")}
        assert set(pids) == {"link", "recorder"}
        first.end(signal.SIGKILL)

        second = Server(data_dir, address, cookies, port=port)
        again = second.until(lambda m: _flown(m, 10.0))
        assert again["state"]["armed"]
        onboard = second.until(lambda m: m["type"] == "fly" and m["fly"]["onboard"]["state"] == "verified")["fly"][
            "onboard"
        ]
        assert (onboard["digest"], onboard["plan_name"], onboard["is_open_plan"]) == (digest, "Demo flight", True)
        path = second.until(lambda m: m["type"] == "track" and len(m["track"]["t_s"]) > 5)["track"]
        assert min(s for s in path["s_m"] if s is not None) < 5.0
        assert {facts.name: facts.pid for facts in running_nodes(data_dir / "run")} == pids
        assert second.until(lambda m: m["type"] == "lease")["lease"]["mine"]
        second.post("/api/flight/pause")
        second.until(lambda m: m["type"] == "flight" and m["flight"]["phase"] == "paused")
        words = second.end(signal.SIGINT)
        assert "The vehicle is armed" in words
        assert {facts.name: facts.pid for facts in running_nodes(data_dir / "run")} == pids

        third = Server(data_dir, address, cookies, port=port)
        third.until(lambda m: m["type"] == "vehicle" and bool(m["state"] and m["state"]["armed"]))
        third.post("/api/flight/land")
        third.until(lambda m: m["type"] == "vehicle" and bool(m["state"] and not m["state"]["armed"]))
        assert "armed" not in third.end(signal.SIGINT)
        assert running_nodes(data_dir / "run") == []
