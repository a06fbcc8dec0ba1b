"""Trial 3: a band of grass tussocks that no LIDAR map lets anything through, brick piles, a car and a ditch."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from mapping.geometry.arrays import Bools
from mapping.traversability import traversability_map
from mapping.uwb.clearing import Cleared, UwbPose
from telemetry.simulation.scenarios.foliage.foliage_drive import drive
from telemetry.simulation.scenarios.foliage.foliage_figures import Drive, cleared_by, driven
from telemetry.simulation.scenarios.foliage.foliage_trials import CELL_M, Site, disc_cells
from telemetry.simulation.simulator.sensors.uwb_scene import Foliage, Target, target

SIDE_M = 50.0
BAND_M, PITCH_M = (-2.5, 2.5), 0.9
FROM_M, TO_M = (-16.0, 0.0), (14.0, 0.0)
VEHICLE_M = 0.8
"""Width of Shrimp, about."""
CORE_M = 0.1


@dataclass(frozen=True, slots=True)
class Route:
    """Whether a vehicle gets from A to B, before and after clearing, and how much of the brick piles remains."""

    before: bool
    after: bool
    piles_kept: float
    """Share of the three and four bricks' cells, where they were seen, that still block."""
    drive: Drive
    result: Cleared


def rural_site(seed: int) -> Site:
    """50 m square. Tussocks stand so close that a vehicle cannot pass between them."""
    random = np.random.default_rng((seed, 3))
    tussocks = [
        Foliage((float(x + a), float(y + b)), float(radius_m), 0.45, float(layers))
        for x in np.arange(*BAND_M, PITCH_M)
        for y in np.arange(-SIDE_M / 2.0, SIDE_M / 2.0 + PITCH_M, PITCH_M)
        for a, b in [random.uniform(-0.12, 0.12, 2)]
        for radius_m, layers in [(random.uniform(0.25, 0.35), random.uniform(0.3, 1.0))]
    ]
    car = [Target("car", (float(x), 9.0), 0.7, 1.5, 10.0) for x in (9.0, 10.2, 11.4, 12.6)]
    four = Target("4 bricks", (-5.5, -2.6), 0.165, 0.31, 2.4, solid=False)
    piles = [target("2 bricks", (-6.5, -5.0)), target("3 bricks", (5.0, 2.4)), four]
    return Site("trial 3", [*piles, *car], tussocks, SIDE_M)


def rural_drive() -> list[UwbPose]:
    """Over open ground first, then up to the tussocks beside each other, and through."""
    return drive(
        ((-17.0, -16.0), (-17.0, 6.0), (-14.0, -2.0), (-11.0, -1.0), (-6.5, -0.8), (-12.0, 1.5), (-6.5, 0.8),
         (-12.0, 0.0), (-5.5, -0.4), (-8.0, 0.4), (-4.5, 0.4), (-7.0, -0.2), (-3.0, -0.2), (-5.0, 0.2), (-2.0, 0.2),
         (-5.0, 0.0), (-1.0, 0.0), (-4.0, 0.1), (8.0, 0.0))
    )  # fmt: skip


def route(seed: int) -> Route:
    """Lays the site out, drives, clears, and asks for the way from A to B on both maps."""
    there = _with_ditch(driven(rural_site(seed), rural_drive(), seed))
    result, _ = cleared_by(there)
    open_before = there.map.known & ~there.map.untraversable
    ends = (_cell(FROM_M), _cell(TO_M))
    before = connected(open_before, *ends, VEHICLE_M)
    after = connected(open_before | (result.cleared & result.seen), *ends, VEHICLE_M)
    return Route(before, after, _kept(there, result), there, result)


def connected(passable: Bools, begin_cell: tuple[int, int], end_cell: tuple[int, int], width_m: float) -> bool:
    """Whether a vehicle of that width gets from one cell to the other."""
    away = np.asarray(ndimage.distance_transform_edt(np.pad(passable, 1)))[1:-1, 1:-1]
    parts = np.zeros(passable.shape, np.int32)
    ndimage.label(away > width_m / 2.0 / CELL_M, structure=np.ones((3, 3)), output=parts)
    return bool(parts[begin_cell] != 0 and parts[begin_cell] == parts[end_cell])


def _with_ditch(there: Drive) -> Drive:
    """Half a metre deep, beside the way: it lies lower, no radar sees it."""
    elevation_m = there.elevation_m.copy()
    rows = slice(_cell((0.0, -12.0))[0], _cell((0.0, -13.0))[0])
    elevation_m[rows, _cell((4.0, 0.0))[1] :] -= 0.5
    return replace(there, elevation_m=elevation_m, map=traversability_map(elevation_m, CELL_M))


def _kept(there: Drive, result: Cleared) -> float:
    cells = np.zeros_like(result.cleared)
    for thing in there.site.targets:
        if thing.name in ("3 bricks", "4 bricks"):
            part, covered = disc_cells(there.site, thing.xy_m, thing.radius_m + CORE_M)
            cells[part] |= covered
    cells &= result.seen
    return float((cells & ~result.cleared).sum() / cells.sum()) if cells.any() else float("nan")


def _cell(xy_m: tuple[float, float]) -> tuple[int, int]:
    return int((SIDE_M / 2.0 - xy_m[1]) / CELL_M), int((SIDE_M / 2.0 + xy_m[0]) / CELL_M)
