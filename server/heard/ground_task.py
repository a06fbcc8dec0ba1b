"""What a worker makes for the simulated vehicle: the ground around its home as a file, and home's height on it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from planning.missions.home import home_from_dsm
from planning.terrain.geotiff import write_dsm
from server.library.terrains import load_terrain
from server.work.jobs import Progress

REACH_CELLS = 2000
"""Around home: farther than a simulated vehicle is flown, and small enough to be read at once."""


@dataclass(frozen=True, slots=True)
class Ground:
    path: Path
    home_lat_deg: float
    home_lon_deg: float
    home_alt_m: float
    """In the surface model's datum."""


def export_ground(directory: Path, target: Path, home_lat_lon_deg: tuple[float, float], *, report: Progress) -> Ground:
    """Writes the model's heights around home. Raises PlanningError."""
    report("Preparing the simulated vehicle's ground", None)
    dsm = load_terrain(directory)
    home = home_from_dsm(dsm, home_lat_lon_deg)
    rows, columns = dsm.fractional_cell(dsm.xy_from_lat_lon(np.array([home_lat_lon_deg])))
    row, column = int(rows[0]), int(columns[0])
    top, left = max(0, row - REACH_CELLS), max(0, column - REACH_CELLS)
    around = dsm.window(top, left, row + REACH_CELLS - top, column + REACH_CELLS - left)
    target.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    write_dsm(target, around)
    return Ground(target, home.lat_deg, home.lon_deg, home.alt_dsm_m)


def write_demo_world(target: Path, *, report: Progress) -> None:
    """What stands on the demo's hillside since its surface model was made."""
    from telemetry.simulation.simulator import demo_world

    report("Preparing the simulated vehicle's world", None)
    demo_world.write_demo_world(target)
