"""How old what radar and camera show is when it reaches a page, in the demo's flight with a camera of 100,000 points.

Run alone: ``python -m tests.bench.bench_obstacles [SECONDS] [POINTS]``. All is real but the pilot, the sensors and the
browser: server, bus, nodes, maps, avoidance. Prints, fails for nothing.
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

from server.scene.host import SUBPROTOCOL
from telemetry.bus.node_lock import running_nodes
from telemetry.topics.obstacles import Sensor
from tests.free_ports import free_port
from tests.server.station import PATIENCE_S, ok

POINTS, SECONDS = 100_000, 60.0
ASKED_S: dict[Sensor, float] = {"radar": 0.15, "vision": 0.3}
ACCEPTED = ("gnss", "battery", "rtl_height")
LONG_S = 3 * PATIENCE_S


@dataclass(slots=True)
class Ages:
    """Of one sensor's frames when they reach the page."""

    age_s: list[float] = field(default_factory=list)
    worked_s: list[float] = field(default_factory=list)
    """Until map, regions and alerts were done."""
    points: list[int] = field(default_factory=list)
    came_s: list[float] = field(default_factory=list)
    frames: list[int] = field(default_factory=list)
    lost: list[int] = field(default_factory=list)

    def take(self, status: dict[str, Any], now_s: float) -> None:
        if status["basis"] is None or (self.frames and status["frames"] == self.frames[-1]):
            return
        self.age_s.append(now_s - status["t_mono_s"])
        self.worked_s.append(status["done_t_mono_s"] - status["t_mono_s"])
        self.points.append(status["points"])
        self.came_s.append(now_s)
        self.frames.append(status["frames"])
        self.lost.append(status["lost_frames"])

    def line(self, sensor: Sensor) -> str:
        if len(self.age_s) < 2:
            return f"{sensor}: nothing came (NO)"
        p50, p99 = np.percentile(self.age_s, [50, 99])
        seconds, most_s = self.came_s[-1] - self.came_s[0], ASKED_S[sensor]
        return (
            f"{sensor}: {len(self.age_s)} statuses, frame to page p50 {1e3 * p50:.0f} ms, p99 {1e3 * p99:.0f} ms "
            f"(p99 under {1e3 * most_s:.0f} ms: {_yes(p99 < most_s)}), of which until the map was done p50 "
            f"{1e3 * np.median(self.worked_s):.0f} ms; {(len(self.age_s) - 1) / seconds:.1f} statuses and "
            f"{(self.frames[-1] - self.frames[0]) / seconds:.1f} frames a second, "
            f"{self.lost[-1] - self.lost[0]} frames lost, {np.median(self.points):.0f} points kept of a frame"
        )


class Page:
    """A page without a browser: its stream, and a 3D view that only counts."""

    def __init__(self, port: int, http: httpx.Client) -> None:
        self._port, self._http = port, http
        self._stream = self._socket("/ws")
        self.view_bytes = 0
        page_id = self.until(lambda m: m["type"] == "snapshot")["page_id"]
        self._view = self._socket(f"/view/{page_id}", subprotocols=[Subprotocol(SUBPROTOCOL)])
        self._counting = threading.Thread(target=self._count, daemon=True)
        self._counting.start()

    def until(self, wanted: Callable[[dict[str, Any]], bool], seconds: float = LONG_S) -> dict[str, Any]:
        """Raises TimeoutError."""
        end_s = time.monotonic() + seconds
        while True:
            message = json.loads(self._stream.recv(timeout=max(0.0, end_s - time.monotonic())))
            if wanted(message):
                return message

    def close(self) -> None:
        self._stream.close()
        self._view.close()
        self._counting.join()

    def _count(self) -> None:
        with suppress(ConnectionClosed):
            while True:
                self.view_bytes += len(self._view.recv())

    def _socket(self, path: str, **options: Any) -> ClientConnection:
        cookie = f"hedgehop-{self._port}={self._http.cookies[f'hedgehop-{self._port}']}"
        return connect(
            f"ws://127.0.0.1:{self._port}{path}",
            origin=Origin(f"http://127.0.0.1:{self._port}"),
            additional_headers={"Cookie": cookie},
            compression=None,
            max_size=None,
            max_queue=None,
            **options,
        )


def main(seconds: float = SECONDS, points: float = POINTS) -> None:
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder), round(points)) as (port, http):
        page = Page(port, http)
        try:
            take_off(page, http)
            listen(page, seconds)
        finally:
            page.close()


@contextmanager
def serving(folder: Path, points: int) -> Iterator[tuple[int, httpx.Client]]:
    """The demo's station, and its operator's client."""
    port = free_port()
    command = [sys.executable, "-m", "tests.bench.with_points", str(points), "serve", "--demo", "--no-guardian"]
    process = subprocess.Popen(
        [*command, "--port", str(port), "--data-dir", str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        origin = f"http://127.0.0.1:{port}"
        with httpx.Client(base_url=origin, headers={"Origin": origin}, timeout=LONG_S) as http:
            assert process.stdout is not None
            found = next(m for line in process.stdout if (m := re.search(r"/login\?token=\S+", line)))
            http.get(found.group())
            yield port, http
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=LONG_S)
        # With an armed vehicle they outlive their server on purpose.
        for facts in running_nodes(folder / "run"):
            os.kill(facts.pid, signal.SIGKILL)


def take_off(page: Page, http: httpx.Client) -> None:
    page.until(lambda m: m["type"] == "vehicle" and _ready(m["state"]))
    _until_planned(page, http)
    revision = ok(http.get("/api/state")).json()["plan"]["revision"]
    ok(http.post("/api/flight/upload", json={"revision": revision}))
    digest = ok(http.post("/api/flight/check")).json()["onboard"]["digest"]
    ok(http.post("/api/flight/start", json={"digest": digest, "accept": ACCEPTED}))
    page.until(lambda m: m["type"] == "vehicle" and m["state"] is not None and m["state"]["armed"])


def _ready(state: dict[str, Any] | None) -> bool:
    return state is not None and state["ready_to_arm"] and state["estimator_ok"]


def _until_planned(page: Page, http: httpx.Client) -> None:
    if ok(http.get("/api/state")).json()["plan"]["computation"]["state"] != "ready":
        page.until(lambda m: m["type"] == "plan" and m["plan"]["computation"]["state"] == "ready")


def listen(page: Page, seconds: float) -> None:
    """From when both sensors have shown something on."""
    ages: dict[str, Ages] = {sensor: Ages() for sensor in ASKED_S}
    drawn: dict[str, Any] = {}

    def take(message: dict[str, Any]) -> bool:
        now_s = time.monotonic()
        if message["type"] == "obstacles":
            drawn["maps"] = message["obstacles"]["maps"]
        elif message["type"] == "perception" and message["sensor"] in ages and message["status"]:
            ages[message["sensor"]].take(message["status"], now_s)
        return False

    def both(message: dict[str, Any]) -> bool:
        take(message)
        return all(len(each.age_s) > 1 for each in ages.values())

    page.until(both)
    for sensor in ages:
        ages[sensor] = Ages()
    began_bytes = page.view_bytes
    with suppress(TimeoutError):
        page.until(take, seconds)
    print(f"{seconds:.0f} s of flight; load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors")
    for sensor in ASKED_S:
        print(ages[sensor].line(sensor))
    sent_bytes = page.view_bytes - began_bytes
    print(
        f"3D view: {sent_bytes / seconds / 1e3:.0f} kB/s to the page, {sent_bytes / seconds * 3600 / 1e9:.2f} GB in an "
        f"hour of this; {_maps(drawn.get('maps', []))} since the start"
    )


def _maps(maps: list[dict[str, Any]]) -> str:
    return ", ".join(f"{m['sensor']} {m['voxels']} voxels, {m['sent_bytes'] / 1e6:.2f} MB sent" for m in maps)


def _yes(good: bool) -> str:
    return "yes" if good else "NO"


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:]))
