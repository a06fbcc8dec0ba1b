"""How many encounters end inside the safety radius: velocity obstacles beside BlueSky's MVP, in one run."""

from __future__ import annotations

import time

import numpy as np

from tests.telemetry.bluesky_mvp import is_installed
from tests.telemetry.sidesteps_compared import (
    COUNT,
    KEEP_M,
    NORTH,
    SEED,
    Policy,
    encounters,
    modified_voltage_potential,
    nearest_m,
    velocity_obstacles,
)


def main(count: int = COUNT) -> None:
    if not is_installed():
        print("BlueSky is not installed: pip install --no-deps bluesky-simulator")
        return
    met = encounters(count, SEED)
    by = {
        "nobody": lambda: lambda *_: NORTH,
        "MVP of BlueSky": modified_voltage_potential,
        "velocity obstacles": velocity_obstacles,
    }
    intrusions: dict[str, int] = {}
    for name, policy in by.items():
        start_s = time.process_time()
        least_m = np.array([nearest_m(one, _made(policy)) for one in met])
        took_s = time.process_time() - start_s
        intrusions[name] = int((least_m < KEEP_M).sum())
        print(
            f"{name}: {intrusions[name]} of {count} within {KEEP_M:g} m, {int((least_m < KEEP_M / 2).sum())} within "
            f"{KEEP_M / 2:g} m, median {np.median(least_m):.2f} m, {took_s:.0f} s"
        )
    ours, theirs = intrusions["velocity obstacles"], intrusions["MVP of BlueSky"]
    ratio = ours / theirs if theirs else float(ours > 0)
    print(f"intrusions {ratio:.2f} times those of MVP (at most 1 times: {'yes' if ours <= theirs else 'NO'})")


def _made(policy) -> Policy:
    """A new one for every encounter: nothing is carried over."""
    return policy()


if __name__ == "__main__":
    main()
