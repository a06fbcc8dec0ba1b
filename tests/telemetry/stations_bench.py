"""Fifty vehicles on five stations over bad lines: how old positions are, and what a vehicle costs; run by hand.

    nice python -m tests.telemetry.stations_bench [--stations 5] [--vehicles 10] [--seconds 60]

Each station reaches the router through a line of its own (``bad_line.py``): 100 ms each way and so 200 ms from station
to station, 256 kbit/s, 5 % loss. A vehicle's latitude is the time, so that the true age of what is seen is known.
"""

from __future__ import annotations

import argparse
import asyncio
import time
from contextlib import AsyncExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from telemetry.topics.station_vehicles import StationsStatus
from tests.telemetry.bad_line import Bad, BadLine
from tests.telemetry.bus_runs import short_folder
from tests.telemetry.station_fleet import Field, FieldStation, line_of, true_age_s

ROUND_S = 2e-3


@dataclass(frozen=True, slots=True)
class Result:
    ages_s: np.ndarray
    """True ones, of every vehicle in every status."""
    told_s: np.ndarray
    """As told, at the worse end; never less than the true ones."""
    up_bytes_per_s: float
    """Of one vehicle, on its own station's line; TLS, TCP and IP counted."""
    down_bytes_per_s: float
    """Of one vehicle of another station, on the line of who sees it."""
    mixed_up: int
    """Vehicles under a wrong name, or more of them than there are."""
    refused: int


async def measure(folder: Path, *, stations: int, vehicles: int, seconds: float, bad: Bad) -> Result:
    names = [f"S{index}" for index in range(1, stations + 1)]
    field = Field(folder, names)
    async with AsyncExitStack() as stack:
        stack.callback(field.router.kill)
        await field.router.start()
        lines, running = list[BadLine](), list[FieldStation]()
        for seed, name in enumerate(names):
            line = BadLine(field.port, bad, seed)
            await line.open()
            stack.callback(line.close)
            lines.append(line)
            running.append(await stack.enter_async_context(field.station(name, vehicles=vehicles, port=line.port)))
        await asyncio.gather(*(each.sees(*(set(names) - {each.name})) for each in running))
        await asyncio.gather(
            *(each.until(lambda status: len(status.vehicles) == vehicles * (stations - 1)) for each in running)
        )
        begun_s, before = time.monotonic(), [dict(line.carried) for line in lines]
        marks = [len(each.statuses) for each in running]
        await asyncio.sleep(seconds)
        took_s = time.monotonic() - begun_s
        carried = {
            way: sum(line.carried[way] - was.get(way, 0) for line, was in zip(lines, before, strict=True))
            for way in ("up", "down")
        }
        seen = [(each.name, status) for each, at in zip(running, marks, strict=True) for status in each.statuses[at:]]
    pairs = [(true_age_s(o, s.t_mono_s), s.t_mono_s - (o.oldest_t_mono_s or 0.0)) for _, s in seen for o in s.vehicles]
    ages = np.array(pairs)
    own = stations * vehicles
    return Result(
        ages[:, 0],
        ages[:, 1],
        carried["up"] / took_s / own,
        carried["down"] / took_s / (own * (stations - 1)),
        sum(_mixed_up(name, status, names, vehicles) for name, status in seen),
        max(status.refused for _, status in seen),
    )


def _mixed_up(own: str, status: StationsStatus, names: list[str], vehicles: int) -> int:
    seen = [(other.station, other.it.number) for other in status.vehicles]
    meant = {(name, number) for name in names if name != own for number in range(1, vehicles + 1)}
    wrong_names = sum(other.it.name != f"Drone {other.it.number}" for other in status.vehicles)
    wrong_lines = sum(line.packed != line_of(line.number) for line in status.lines)
    return len(set(seen) ^ meant) + len(seen) - len(set(seen)) + wrong_names + wrong_lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stations", type=int, default=5)
    parser.add_argument("--vehicles", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    with short_folder() as folder:
        result = asyncio.run(
            measure(
                folder,
                stations=options.stations,
                vehicles=options.vehicles,
                seconds=options.seconds,
                bad=Bad(),
            )
        )
    p50, p99, worst = np.percentile(result.ages_s, [50, 99, 100])
    print(f"age of positions: p50 {p50:.2f} s, p99 {p99:.2f} s, worst {worst:.2f} s, of {len(result.ages_s)} seen")
    print(f"told too young: {np.sum(result.told_s < result.ages_s - ROUND_S)}")
    print(f"told older than true: p50 {np.median(result.told_s - result.ages_s):.2f} s")
    print(
        f"a vehicle on its own line: {result.up_bytes_per_s:.0f} B/s, on another's: {result.down_bytes_per_s:.0f} B/s"
    )
    print(f"mixed up: {result.mixed_up}, refused: {result.refused}")


if __name__ == "__main__":
    main()
