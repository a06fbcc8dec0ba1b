"""What Dask workers add to flying seeds of a scenario: one worker beside none, two beside one.

Run alone: ``python -m tests.bench.bench_cluster [SEEDS]``. Times begin with the command and hold the workers' start;
the ratios that have settled leave out what each worker needs for its first seed. Prints, fails for nothing but
answers that differ.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator

from server.work.cluster import spread
from telemetry.simulation.scenarios.catalogue import run_scenario
from telemetry.simulation.scenarios.stage.result import ScenarioRequest

NAME, SEEDS = "castle-building", 8
WAYS = {"here": None, "one worker": "local:1", "two workers": "local:2"}


def fly(seed: int) -> tuple[str, float]:
    """What it came to, and the seconds that it took by itself."""
    began_s = time.perf_counter()
    words = str(run_scenario(NAME, ScenarioRequest(seed)).as_json())
    return words, time.perf_counter() - began_s


def _answers(where: str | None, seeds: int) -> Iterator[tuple[str, float, float]]:
    began_s = time.perf_counter()
    for words, own_s in spread(fly, range(seeds), where, lambda share: None):
        yield words, own_s, time.perf_counter() - began_s


def main() -> None:
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    list(_answers(None, 1))  # what is compiled and loaded once
    took_s: dict[str, float] = {}
    told: dict[str, list[str]] = {}
    for name, where in WAYS.items():
        answers = list(_answers(where, seeds))
        told[name] = [words for words, _, _ in answers]
        own_s = sum(own for _, own, _ in answers)
        took_s[name] = answers[-1][2]
        print(f"{name}: {seeds} seeds of {NAME} in {took_s[name]:.1f} s, {own_s / seeds:.2f} s each")
        print(f"  the first after {answers[0][2]:.1f} s")
    assert told["here"] == told["one worker"] == told["two workers"]
    print(f"one worker takes {took_s['one worker'] / took_s['here']:.2f} times as long as none")
    print(f"two workers are {took_s['one worker'] / took_s['two workers']:.2f} times as fast as one")


if __name__ == "__main__":
    main()
