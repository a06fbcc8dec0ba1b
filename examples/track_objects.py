"""Follow what a radar detects from frame to frame: place and velocity of each object, and how sure they are.

python examples/track_objects.py [detections.csv]
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mapping import Tracker, TrackerParams

Rows = NDArray[np.float64]


def walker_and_pole(seconds: float = 4.0) -> Rows:
    """(N, 4) t_s, range_m, bearing_rad, radial speed: someone crosses 12 m ahead at 1.2 m/s, a pole stands at 20 m."""
    rng, rows = np.random.default_rng(3), []
    for t_s in np.arange(0.0, seconds, 0.1):
        for east_m, north_m, speed_m_s in ((-2.4 + 1.2 * t_s, 12.0, 1.2), (3.0, 20.0, 0.0)):
            range_m, bearing_rad = math.hypot(east_m, north_m), math.atan2(east_m, north_m)
            measured = range_m, bearing_rad, speed_m_s * east_m / range_m
            rows.append((t_s, *(measured + rng.normal(0.0, (0.1, 0.01, 0.1)))))
    return np.array(rows)


def frames(rows: Rows) -> Iterator[tuple[float, Rows]]:
    """Time and detections (N, 3) of each frame."""
    for t_s, group in groupby(rows, key=lambda row: float(row[0])):
        yield t_s, np.array(list(group))[:, 1:]


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", type=Path, nargs="?", help="t_s, range_m, bearing_rad, speed_m_s; default: made up")
    given = parser.parse_args(arguments)

    rows = np.loadtxt(given.csv, delimiter=",", skiprows=1, ndmin=2) if given.csv else walker_and_pole()
    tracker, here, seen = Tracker(TrackerParams(coordinates="cartesian")), np.zeros(2), []
    for t_s, detections in frames(rows):
        # The radar stands at the origin and looks north; on a vehicle, these are its own place, velocity and heading.
        seen = tracker.step(t_s, detections, position_enu_m=here, velocity_enu_m_s=here, heading_rad=0.0)

    objects = [state for state in seen if state.confirmed]
    print(f"{len(objects)} objects after {rows[-1, 0]:.1f} s, {len(seen) - len(objects)} candidates")
    for state in objects:
        (east_m, north_m), (v_east, v_north) = state.position_enu_m, state.velocity_enu_m_s
        sigma_m = math.sqrt(float(np.linalg.eigvalsh(state.covariance[:2, :2])[-1]))
        print(
            f"object {state.id}: {east_m:+.2f} m east, {north_m:+.2f} m north (sigma {sigma_m:.2f} m), "
            f"{v_east:+.2f} m/s east, {v_north:+.2f} m/s north, {state.updates} detections in {state.age_s:.1f} s"
        )


if __name__ == "__main__":
    main()
