"""How long a position takes from its MAVLink packet to the browser, and whether heartbeats bear a large plan.

Run alone: ``python -m tests.bench.bench_link [SECONDS] [MEGAPIXELS]``. A simulated vehicle flies nothing, it only
sends; the server, its link node and a page without a browser are real ones. Prints, fails for nothing.
"""

from __future__ import annotations

import math
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.dsm import Dsm
from server.library.terrains import store_terrain
from server.schemas import PlanDoc, PoiDoc
from tests.server.simulated import Simulated
from tests.server.station import Station, ok, station

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
    """A page without a browser: takes every message as it comes."""

    def __init__(self, page: Station) -> None:
        super().__init__(daemon=True)
        self._page = page
        self.latencies_s: list[float] = []
        self.heartbeat_hz: list[float] = []
        self.computing = True
        self._seen: float | None = None

    def run(self) -> None:
        while True:
            message = self._page.until(lambda each: each.type in ("vehicle", "link", "plan"), 600.0)
            if message.type == "plan":
                self.computing = message.plan.computation.state == "running"
            elif message.type == "link":
                self.heartbeat_hz.append(message.link.heartbeat_hz)
            elif message.state is not None and message.state.position_t_mono_s not in (None, self._seen):
                self._seen = message.state.position_t_mono_s
                self.latencies_s.append(time.monotonic() - message.state.position_t_mono_s)

    def report(self, what: str) -> None:
        latencies_ms = 1000 * np.array(self.latencies_s or [math.nan])
        p50, p99, most = np.percentile(latencies_ms, [50, 99, 100])
        beats = [hz for hz in self.heartbeat_hz if hz > 0]
        sys.stdout.write(
            f"{what}: {len(self.latencies_s)} positions, packet to page p50 {p50:.1f} ms, p99 {p99:.1f} ms, "
            f"most {most:.0f} ms; heartbeat {min(beats, default=math.nan):.2f} to {max(beats, default=math.nan):.2f} Hz\n"
        )
        self.latencies_s, self.heartbeat_hz = [], []


def main(seconds: float = 30.0, megapixels: float = 132.0) -> None:
    with tempfile.TemporaryDirectory() as folder, station(Path(folder), flies=True) as page:
        dsm = rolling_dsm(megapixels)
        store_terrain(page.server.parts.library.root, dsm, name="Rolling")
        page.server.parts.library.refresh()
        terrain = page.server.parts.library.terrains()[0]
        pois = route(dsm)
        with Simulated(pois[0].lat_deg, pois[0].lon_deg, 100.0) as vehicle:
            ok(page.http.post("/api/link/connect", json={"address": vehicle.address}))
            page.until(
                lambda each: each.type == "vehicle" and each.state is not None and each.state.lat_deg is not None
            )
            listener = Listener(page)
            listener.start()
            time.sleep(5.0)
            listener.report("settling")
            time.sleep(seconds)
            listener.report("nothing else going on")
            document = PlanDoc(terrain_id=terrain.id, pois=pois)
            began = time.monotonic()
            page.put(document)
            time.sleep(1.0)
            while listener.computing and time.monotonic() - began < 600:
                time.sleep(0.2)
            took = time.monotonic() - began
            listener.report(f"while {dsm.elevation_m.size / 1e6:.0f} Mpx were planned on for {took:.0f} s")


if __name__ == "__main__":
    main(*(float(argument) for argument in sys.argv[1:]))
