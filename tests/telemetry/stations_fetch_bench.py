"""How old positions are while a recording is fetched over bad lines, beside how old they are without; run by hand.

    nice python -m tests.telemetry.stations_fetch_bench [--vehicles 10] [--seconds 60] [--kb-s 8]

Two stations as in ``stations_bench``, each behind a line of 256 kbit/s with 100 ms each way and 5 % loss. Both ages are
of one run: first nothing is fetched, then one of them fetches from the other.
"""

from __future__ import annotations

import argparse
import asyncio
import os
from contextlib import AsyncExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from telemetry.topics.station_recordings import EndFetch, ListRecordings
from tests.telemetry.bad_line import Bad, BadLine
from tests.telemetry.bus_runs import short_folder
from tests.telemetry.station_fleet import Field, FieldStation, true_age_s

FLIGHT_BYTES = 20_000_000
"""More than comes while it is measured."""


@dataclass(frozen=True, slots=True)
class FetchResult:
    without_s: np.ndarray
    """Ages of positions, at both stations."""
    while_s: np.ndarray
    fetched_bytes_per_s: float
    line_bytes_per_s: float
    """On the line of who gives, upwards, while it was fetched; all headers counted."""


async def measure_fetch(
    folder: Path, *, vehicles: int, seconds: float, bad: Bad, bytes_per_s: int = 8000
) -> FetchResult:
    field, flight = Field(folder, ("Alpha", "Bravo")), folder / "flight.mcap"
    flight.write_bytes(os.urandom(FLIGHT_BYTES))
    async with AsyncExitStack() as stack:
        stack.callback(field.router.kill)
        await field.router.start()
        lines, both = list[BadLine](), list[FieldStation]()
        for seed, name in enumerate(("Alpha", "Bravo")):
            line = BadLine(field.port, bad, seed)
            await line.open()
            stack.callback(line.close)
            lines.append(line)
            both.append(await stack.enter_async_context(field.station(name, vehicles=vehicles, port=line.port)))
        alpha, bravo = both
        await alpha.sees("Bravo", vehicles=vehicles)
        await bravo.sees("Alpha", vehicles=vehicles)
        # Lines of all vehicles have come, too.
        await alpha.until(lambda status: len(status.lines) == vehicles)
        await bravo.until(lambda status: len(status.lines) == vehicles)
        without = await _ages(both, seconds)
        alpha.offer(bytes_per_s=bytes_per_s)
        bravo.offer(flight, bytes_per_s=bytes_per_s)
        await alpha.asks(ListRecordings("Bravo"))
        sha256 = await alpha.fetch("Bravo", flight.name)
        begun = await alpha.fetches(lambda fetch: fetch.have_bytes > 0)
        begun_s, carried = alpha.recordings.t_mono_s, lines[1].carried["up"]
        during = await _ages(both, seconds)
        took_s = alpha.recordings.t_mono_s - begun_s
        had = alpha.recordings.fetches[0].have_bytes - begun.have_bytes
        line_bytes = lines[1].carried["up"] - carried
        await alpha.asks(EndFetch(sha256))
    return FetchResult(without, during, had / took_s, line_bytes / took_s)


async def _ages(stations: list[FieldStation], seconds: float) -> np.ndarray:
    marks = [len(each.statuses) for each in stations]
    await asyncio.sleep(seconds)
    seen = [status for each, at in zip(stations, marks, strict=True) for status in each.statuses[at:]]
    return np.array([true_age_s(other, status.t_mono_s) for status in seen for other in status.vehicles])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vehicles", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--kb-s", type=float, default=8.0)
    options = parser.parse_args()
    with short_folder() as folder:
        result = asyncio.run(
            measure_fetch(
                folder,
                vehicles=options.vehicles,
                seconds=options.seconds,
                bad=Bad(),
                bytes_per_s=round(1000 * options.kb_s),
            )
        )
    for what, ages_s in (("without", result.without_s), ("while fetching", result.while_s)):
        p50, p99, worst = np.percentile(ages_s, [50, 99, 100])
        print(f"{what}: p50 {p50:.2f} s, p99 {p99:.2f} s, worst {worst:.2f} s, of {len(ages_s)} seen")
    print(f"fetched {result.fetched_bytes_per_s:.0f} B/s; its line up {result.line_bytes_per_s:.0f} B/s")


if __name__ == "__main__":
    main()
