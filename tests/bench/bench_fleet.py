"""How old positions are when they come to pages, with several vehicles on one station.

Run alone: ``python -m tests.bench.bench_fleet [VEHICLES] [SECONDS]``. Server, nodes and simulated vehicles are real
processes; each page has no browser and shows another vehicle. Prints, fails for nothing.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from websockets.asyncio.client import connect
from websockets.typing import Origin

from tests.e2e.stations import Station


async def page(station: Station, vehicle: int, ready: asyncio.Event, seconds: float) -> list[float]:
    """Ages of the vehicle's new positions as they come, from when all vehicles have one on."""
    cookies = "; ".join(f"{name}={value}" for name, value in station.cookies.items())
    address = f"{station.origin.replace('http', 'ws')}/ws?vehicle={vehicle}"
    headers = {"Cookie": cookies}
    ages_s: list[float] = []
    last_s, until_s, pinged_s = 0.0, float("inf"), 0.0
    async with connect(address, origin=Origin(station.origin), additional_headers=headers, max_size=None) as stream:
        async for text in stream:
            now_s = time.monotonic()
            if now_s > until_s:
                break
            if now_s - pinged_s > 1.0:
                pinged_s = now_s
                await stream.send(json.dumps({"type": "ping", "page_ms": 1000 * now_s}))
            message = json.loads(text)
            if message["type"] == "fleet" and all(each["lat_deg"] for each in message["vehicles"]):
                ready.set()
            if until_s == float("inf") and ready.is_set():
                until_s = now_s + seconds
            state = message["state"] if message["type"] == "vehicle" else None
            heard_s = None if state is None else state["position_t_mono_s"]
            if until_s < float("inf") and heard_s and heard_s != last_s:
                last_s = heard_s
                ages_s.append(now_s - heard_s)
    return ages_s


async def ages(station: Station, vehicles: int, seconds: float) -> list[list[float]]:
    ready = asyncio.Event()
    return await asyncio.gather(*(page(station, n, ready, seconds) for n in range(1, vehicles + 1)))


def main() -> None:
    vehicles = int(sys.argv[1]) if len(sys.argv) > 1 else 8
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 40.0
    with tempfile.TemporaryDirectory() as folder:
        station = Station(Path(folder) / "data", "--demo", "--demo-vehicles", str(vehicles))
        try:
            station.sign_in()
            found_ms = [1000 * np.array(each) for each in asyncio.run(ages(station, vehicles, seconds))]
        finally:
            station.stop()
    named = [(f"vehicle {n}", each) for n, each in enumerate(found_ms, 1)]
    for name, each in [*named, ("all", np.concatenate(found_ms))]:
        p50, p99, most = np.percentile(each, [50, 99, 100])
        print(f"{name}: {len(each) / seconds:.1f} a second, age p50 {p50:.1f} p99 {p99:.1f} largest {most:.1f} ms")
    print(f"load of {os.cpu_count()} processors over the last minute: {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
