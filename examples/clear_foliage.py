"""A UWB radar looks through grass: which cells that stop a rover are only soft vegetation?

python examples/clear_foliage.py [hillside.tif drive.npz]
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mapping import Traversability, UwbClearing, UwbPose, traversability_map
from mapping.uwb.clearing import Cleared
from planning import read_dsm
from planning.ground.traversable import cleared_ground, traversable_ground
from telemetry.sensors.uwb_log import read_uwb_log

CELL_M, SIDE_M = 0.2, 20.0


def meadow() -> tuple[Traversability, Cleared]:
    """A lawn with a tussock of grass and, 2 m behind it and to the right, a stone; the radar drives north."""
    rng, rows = np.random.default_rng(2), int(SIDE_M / CELL_M)
    heights_m = rng.normal(0.0, 0.01, (rows, rows)).astype(np.float32)
    stone, tussock = (slice(40, 43), slice(56, 59)), (slice(52, 55), slice(48, 52))
    heights_m[stone] = heights_m[tussock] = 0.6
    ground = traversability_map(heights_m, CELL_M)
    clearing = UwbClearing(ground, north_m=SIDE_M)
    bins_m = clearing.geometry.first_bin_m + clearing.geometry.bin_m * np.arange(clearing.geometry.bins)
    # What bare ground returns is learnt while it looks at nothing but lawn, south; then it turns round.
    drive = [(11.0, np.pi)] * 100 + [(2.0 + 0.01 * k, 0.0) for k in range(360)]
    for k, (y_m, heading_rad) in enumerate(drive):
        scan = 30.0 + rng.normal(0.0, 1.0, len(bins_m))
        away_m = np.hypot(11.5 - 10.0, 11.7 - y_m)
        scan += 40.0 * np.exp(-(((bins_m - away_m) / 0.3) ** 2)) if heading_rad == 0.0 else 0.0
        clearing.step(scan, UwbPose(0.1 * k, 10.0, y_m, heading_rad))
    return ground, clearing.result()


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dsm", type=Path, nargs="?", help="surface model, GeoTIFF; default: a made-up meadow")
    parser.add_argument("log", type=Path, nargs="?", help="UWB log, .npz as docs/uwb.md describes it")
    given = parser.parse_args(arguments)

    if given.dsm and given.log:
        surface = traversable_ground(read_dsm(given.dsm))
        ground, cleared = surface.map, cleared_ground(surface, read_uwb_log(given.log))
    else:
        ground, cleared = meadow()

    cell_m2 = ground.resolution_m**2
    print(f"cells of {ground.resolution_m:g} m; known ground: {ground.known.sum() * cell_m2:.1f} m2")
    print(f"untraversable by slope and roughness: {ground.untraversable.sum() * cell_m2:.1f} m2")
    print(f"of that seen for more than 2 s: {cleared.seen.sum() * cell_m2:.1f} m2")
    print(f"cleared as foliage: {cleared.cleared.sum() * cell_m2:.1f} m2; a rover may pass, a rotor may not touch")


if __name__ == "__main__":
    main()
