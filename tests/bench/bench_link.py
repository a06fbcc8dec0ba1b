"""How long a position takes from its MAVLink packet to the browser, and whether heartbeats bear a large plan.

Run alone: ``python -m tests.bench.bench_link [SECONDS] [MEGAPIXELS]``. A simulated vehicle flies nothing, it only
sends; the server, its link node and a page without a browser are real ones. Prints, fails for nothing.
"""

from __future__ import annotations

import contextlib
import math
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.terrain.dsm import Dsm
from server.library import Library
from server.library.terrains import store_terrain
from server.schemas import PlanDoc, PoiDoc
from tests.free_ports import free_port
from tests.server.simulated import simulated_vehicle
from tests.server.station import ok
from tests.server.test_flying_process import Server

_WEST_M, _SOUTH_M, _CELL_M = 500_000.0, 4_175_000.0, 0.1


def rolling_dsm(megapixels: float) -> Dsm:
    """Gentle hills of so many cells of 0.1 m."""
    side = math.ceil(1000 * math.sqrt(megapixels))
    metres = np.arange(side, dtype=np.float32) * _CELL_M
    wave = 6.0 * np.sin(metres / 37.0)
    heights = (100.0 + wave[:, None] + wave[None, :]).astype(np.float32)
    transform = Affine(_CELL_M, 0.0, _WEST_M, 0.0, -_CELL_M, _SOUTH_M + side * _CELL_M)
    return Dsm(heights, transform, CRS.from_epsg(32633), "EGM2008 height", "bench")


def route(dsm: Dsm) -> list[PoiDoc]:
    """Across the whole model, so that all of it is planned on."""
    west, south, east, north = dsm.bounds_m
    shares = ((0.1, 0.1), (0.9, 0.2), (0.2, 0.5), (0.9, 0.8), (0.1, 0.9))
    xy_m = np.array([(west + a * (east - west), south + b * (north - south)) for a, b in shares])
    places = dsm.lat_lon_from_xy(xy_m).tolist()
    return [PoiDoc(id=f"p{n}", lat_deg=lat, lon_deg=lon) for n, (lat, lon) in enumerate(places)]


class Listener(threading.Thread):
    """A page without a browser, which only takes and looks at every message."""

    def __init__(self, server: Server) -> None:
        super().__init__(daemon=True)
        self._server = server
        self.latencies_s: list[float] = []
        self.heartbeat_hz: list[float] = []
        self.computing = True
        self.ended = False
        self._seen: float | None = None

    def run(self) -> None:
        self._server.until(self._take)

    def _take(self, message: dict[str, Any]) -> bool:
        now_s = time.monotonic()
        if message["type"] == "plan":
            self.computing = message["plan"]["computation"]["state"] == "running"
        elif message["type"] == "link":
            self.heartbeat_hz.append(message["link"]["heartbeat_hz"])
        elif message["type"] == "vehicle" and message["state"] is not None:
            came_s = message["state"]["position_t_mono_s"]
            if came_s not in (None, self._seen):
                self._seen = came_s
                self.latencies_s.append(now_s - came_s)
        return self.ended

    def report(self, what: str) -> None:
        latencies_ms = 1000 * np.array(self.latencies_s or [math.nan])
        p50, p99, most = np.percentile(latencies_ms, [50, 99, 100])
        beats = [hz for hz in self.heartbeat_hz if hz > 0]
        sys.stdout.write(
            f"{what}: {len(self.latencies_s)} positions, packet to page p50 {p50:.1f} ms, p99 {p99:.1f} ms, "
            f"most {most:.0f} ms; heartbeat {min(beats, default=math.nan):.2f} "
            f"to {max(beats, default=math.nan):.2f} Hz\n"
        )
        sys.stdout.flush()
        self.latencies_s, self.heartbeat_hz = [], []


def main(seconds: float = 30.0, megapixels: float = 132.0) -> None:
    dsm = rolling_dsm(megapixels)
    pois = route(dsm)
    home = f"{pois[0].lat_deg:.7f},{pois[0].lon_deg:.7f},100"
    with tempfile.TemporaryDirectory() as folder, simulated_vehicle(home) as address:
        with contextlib.closing(Library(Path(folder))) as library:
            terrain = store_terrain(library.root, dsm, name="Rolling")
        server = Server(Path(folder), address, port=free_port())
        try:
            measure(server, PlanDoc(terrain_id=terrain.id, pois=pois), seconds, dsm.elevation_m.size / 1e6)
        finally:
            server.end(signal.SIGTERM)


def measure(server: Server, document: PlanDoc, seconds: float, megapixels: float) -> None:
    server.until(lambda m: m["type"] == "vehicle" and m["state"] is not None and m["state"]["lat_deg"] is not None)
    listener = Listener(server)
    listener.start()
    time.sleep(5.0)
    listener.report("settling")
    time.sleep(seconds)
    listener.report("nothing else going on")
    began, revision = time.monotonic(), ok(server.http.get("/api/state")).json()["plan"]["revision"]
    body = {"base_revision": revision, "label": "Plan", "document": document.model_dump()}
    ok(server.http.put("/api/plan", json=body))
    time.sleep(1.0)
    while listener.computing:
        time.sleep(0.2)
    listener.report(f"while {megapixels:.0f} Mpx were planned on for {time.monotonic() - began:.0f} s")
    listener.ended = True
    listener.join()


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:]))
