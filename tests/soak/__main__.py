"""`make soak`: flights with faults, each against what must hold of it; 1 where something did not."""

from __future__ import annotations

import argparse
import time

from tests.soak.faults import drawn
from tests.soak.flight import SoakError, fly
from tests.soak.verdict import broken, contacts

FIRST_S, EVERY_S = 3.0, 15.0


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="soak", description="Flies, and kills, stops and starves processes meanwhile."
    )
    parser.add_argument("--flights", type=int, default=2)
    parser.add_argument("--seed", type=int, default=1, help="of the first flight; the next one has the next")
    parser.add_argument("--minutes", type=float, default=1.5, help="of each flight, from its start on")
    options = parser.parse_args()
    started_s, seconds = time.perf_counter(), 60 * options.minutes
    undisturbed = contacts(fly((), seconds))
    if undisturbed:
        print(f"Without any fault the vehicle flew into something: {', '.join(sorted(undisturbed))}")
        return 1
    bad = 0
    for seed in range(options.seed, options.seed + options.flights):
        faults = drawn(seed, first_s=FIRST_S, last_s=seconds - EVERY_S, every_s=EVERY_S)
        print(f"flight {seed}: {'; '.join(map(str, faults))}", flush=True)
        try:
            flown = fly(faults, seconds)
            sentences = broken(flown)
            words = f"{len(flown.done)} faults" if flown.done else "no fault was done"
        except SoakError as error:
            sentences, words = [str(error)], "did not come about"
        bad += bool(sentences)
        print(
            f"  {'BROKEN' if sentences else 'holds'}, {words}",
            *(f"  {each}" for each in sentences),
            sep="\n",
            flush=True,
        )
    print(f"{options.flights} flights, {bad} broken, {time.perf_counter() - started_s:.0f} s.")
    return int(bad > 0)


if __name__ == "__main__":
    raise SystemExit(main())
