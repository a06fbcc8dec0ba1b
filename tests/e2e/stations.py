"""A whole Hedgehop in a process of its own, and what it flies."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from telemetry.bus.node_lock import running_nodes
from tests.free_ports import free_port
from tests.server.running import client
from tests.server.station import PATIENCE_S, ok

Point = dict[str, Any]
"""A point of a plan document."""

PASSWORD = "correct horse battery"
_SETTINGS = {"PYTHONUNBUFFERED": "1", "HEDGEHOP_PASSWORD": PASSWORD}


class Station:
    """A running server; ``kill()`` is the power cut, ``start()`` the next morning."""

    def __init__(
        self,
        data_dir: Path,
        *arguments: str,
        program: Sequence[str | Path] = (sys.executable, "-m", "server"),
        environment: Mapping[str, str] = os.environ,
    ) -> None:
        self.data_dir, self._program, self._arguments = data_dir, program, arguments
        self._environment = {**environment, **_SETTINGS}
        self.origin = self.link = ""
        self.start()

    def start(self) -> None:
        port = free_port()
        command = [*self._program, "serve", "--no-guardian", "--port", str(port), "--data-dir", str(self.data_dir)]
        # Flights of other tests meet no obstacles: a later option wins.
        command.append("--no-demo-world")
        # Into a file: a pipe that nobody empties fills up, and the server waits at it for ever.
        self._told = self.data_dir.with_name(f"{self.data_dir.name}-{port}.log")
        with self._told.open("w", encoding="utf-8") as told:
            self._process = subprocess.Popen(
                [*command, *self._arguments], stdout=told, stderr=subprocess.STDOUT, env=self._environment
            )
        self.origin = f"http://127.0.0.1:{port}"
        self.link = self._read_link()
        self.http = client(self.origin, timeout=PATIENCE_S)
        self.http.headers["Hedgehop-Vehicle"] = "1"

    def _read_link(self) -> str:
        while True:
            ended = self._process.poll()
            if found := re.search(r"http://\S+/login\?token=\S+(?=\s)", self._told.read_text(encoding="utf-8")):
                return found.group(0)
            assert ended is None, f"the server ended with {ended} before it printed its sign-in link"
            time.sleep(0.05)

    # The operator whose pages the tests open

    def sign_in(self) -> None:
        """In charge of the vehicle, whoever was before; once a page has signed out, with a new session."""
        if self.http.get("/api/state").status_code == 401:
            ok(self.http.post("/api/session", json={"password": PASSWORD}))
        if not ok(self.http.post("/api/lease/take")).json()["mine"]:
            ok(self.http.delete("/api/sessions"))
            ok(self.http.post("/api/lease/take"))

    @property
    def cookies(self) -> dict[str, str]:
        return dict(self.http.cookies)

    @property
    def state(self) -> dict[str, Any]:
        return ok(self.http.get("/api/state")).json()

    def clear(self) -> None:
        """An empty plan is open, and nothing is left of others but the demo's surface model, which takes a while."""
        self.sign_in()
        ok(self.http.post("/api/review/close"))
        ok(self.http.delete("/api/traversability"))
        self._delete_recordings()
        plan_id = ok(self.http.post("/api/plan/new")).json()["plan_id"]
        self.change(terrain_id=None, orthophoto_id=None)
        library = self.state["library"]
        for plan in library["plans"]:
            if plan["id"] != plan_id:
                ok(self.http.delete(f"/api/plans/{plan['id']}"))
        for terrain in library["terrains"]:
            if not terrain["name"].startswith("Demo"):
                ok(self.http.delete(f"/api/terrains/{terrain['id']}"))

    def _delete_recordings(self) -> None:
        """One that is still being written is listed, and can be deleted, once it has ended."""
        end_s = time.monotonic() + PATIENCE_S
        while True:
            listed = ok(self.http.get("/api/recordings")).json()
            for recording in listed:
                self.http.delete(f"/api/recordings/{recording['id']}")
            files = sorted((self.data_dir / "recordings").glob("*.mcap"))
            if not listed and not files:
                return
            assert time.monotonic() < end_s, f"recordings that cannot be deleted: {listed or files}"

    def open_demo(self, points: Callable[[dict[str, Point]], list[Point]], profile: dict[str, float]) -> None:
        """The demo's plan alone, with other points, made of its own by name, and another profile."""
        self.clear()
        ok(self.http.post("/api/terrains/demo"))
        document = self.state["plan"]["document"]
        pois = points({point["name"]: point for point in document["pois"]})
        self.change(pois=pois, profile={**document["profile"], **profile})

    def change(self, **fields: object) -> None:
        plan = self.state["plan"]
        document = {**plan["document"], **fields}
        ok(self.http.put("/api/plan", json={"base_revision": plan["revision"], "label": "x", "document": document}))

    # Its end

    def kill(self) -> None:
        self._process.send_signal(signal.SIGKILL)
        self._process.communicate()
        self.http.close()

    def stop(self) -> None:
        self.http.close()
        if self._process.poll() is None:
            self._process.send_signal(signal.SIGTERM)
        try:
            self._process.communicate(timeout=PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.communicate()
            raise AssertionError(f"the server did not stop within {PATIENCE_S:.0f} s of SIGTERM") from None
        finally:
            self._end_nodes()

    def _end_nodes(self) -> None:
        """With an armed vehicle they outlive their server on purpose."""
        for facts in running_nodes(self.data_dir / "run"):
            os.kill(facts.pid, signal.SIGKILL)


class SimulatedVehicle:
    """A vehicle at the demo plan's home that flies faster than time; ground stations connect to ``address``."""

    HOME = "37.7290205,14.9926236,1712.0"
    RTL_CM = 6000

    def __init__(self, *, speedup: float = 10.0) -> None:
        self.address = f"tcp:127.0.0.1:{free_port()}"
        command = [sys.executable, "-m", "server", "sim", "--link", self.address.replace("tcp", "tcpin", 1)]
        command += ["--home", self.HOME, "--speedup", str(speedup), "--parameter", f"RTL_ALT={self.RTL_CM}"]
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env={**os.environ, **_SETTINGS}
        )
        assert self._process.stdout is not None
        self.said = self._process.stdout.readline()

    def stop(self) -> None:
        """As when its battery is taken out; more than once is no harm."""
        if self._process.poll() is None:
            self._process.kill()
            self._process.communicate()
