"""A sensor's driver: writes what it measures as lines of JSON, which the agent sends to the ground station.

python examples/sensor_for_the_agent.py | hedgehop agent http://127.0.0.1:8000 --token-file sensor-token.txt
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence

import numpy as np

SPEED_M_S, WALL_M = 2.0, 60.0


def measured(t_s: float, rng: np.random.Generator) -> list[list[float]]:
    """Put your radar here: x right, y forward, z up (m), radial speed (m/s, positive away), SNR (dB) of each target.

    Made up: a wall 8 m wide, which comes nearer.
    """
    away_m = max(2.0, WALL_M - SPEED_M_S * t_s)
    right_m = rng.uniform(-4.0, 4.0, 8)
    speed_m_s = -SPEED_M_S * away_m / np.hypot(right_m, away_m)
    rows = np.column_stack([right_m, rng.normal(away_m, 0.15, 8), rng.uniform(0, 1, 8), speed_m_s, np.full(8, 25.0)])
    return rows.round(3).tolist()


def lines(frames: int, rate_hz: float) -> Iterator[str]:
    """One JSON object a frame, also of frames without a target: they say that the radar works."""
    rng, begin_s = np.random.default_rng(5), time.monotonic()
    for number in range(frames):
        t_s = begin_s + number / rate_hz
        time.sleep(max(0.0, t_s - time.monotonic()))
        yield json.dumps({"type": "radar", "t_s": t_s, "targets": measured(number / rate_hz, rng)})


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--rate-hz", type=float, default=10.0)
    given = parser.parse_args(arguments)
    for line in lines(given.frames, given.rate_hz):
        print(line, flush=True)
    print(f"{given.frames} frames of 8 targets, {given.rate_hz:g} a second", file=sys.stderr)


if __name__ == "__main__":
    main()
