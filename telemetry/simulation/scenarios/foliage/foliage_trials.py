"""The UWB paper's test sites: lawns with obstacles and foliage, and what a LIDAR makes of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from mapping.geometry.arrays import F32, Bools
from telemetry.simulation.simulator.sensors.uwb_scene import Foliage, Target, screen, target

CELL_M = 0.1
SITE_M = 30.0
OBSTACLES = (
    ("3 bricks", (-5.5, 2.0)),
    ("2 bricks", (4.0, 4.5)),
    ("Stone", (-5.0, -3.5)),
    ("Small reflector", (5.0, -3.0)),
)
PLACED = frozenset(name for name, _ in OBSTACLES)
CLEAR_SPOTS = ((-0.5, 6.5), (0.0, -6.0))
IN_FRONT_M, BRANCHES_WIDE_M, BRANCHES_HIGH_M = 1.0, 1.2, 0.6
"""As in fig. 6: there the branches stood 1 m before the bricks. For the trials the paper gives no distance."""
LIDAR_SIGMA_M = 0.01


@dataclass(frozen=True, slots=True)
class Site:
    """A square of ``side_m`` around (0, 0), x east and y north."""

    name: str
    targets: Sequence[Target]
    foliage: Sequence[Foliage] = ()
    side_m: float = SITE_M


@dataclass(frozen=True, slots=True)
class Printed:
    """A row of Table III; None where the paper has no foliage."""

    tnr: float | None
    fnr: float


TRIAL_1 = {
    "a": ("empty", Printed(None, 0.0671)),
    "b": ("obstacles", Printed(None, 0.0821)),
    "c": ("sparse", Printed(0.9052, 0.0963)),
    "d": ("dense", Printed(0.8649, 0.0948)),
}
TRIAL_2 = {
    "a": ("empty", Printed(None, 0.0681)),
    "b": ("obstacles", Printed(None, 0.1542)),
    "c": ("1 layer", Printed(0.8898, 0.0859)),
    "d": ("2 layers", Printed(0.8849, 0.1760)),
    "e": ("3 layers", Printed(0.7500, 0.1387)),
    "f": ("4 layers", Printed(0.6569, 0.1037)),
}
LAYERS = {"1c": 1.0, "1d": 2.5, "2c": 1.0, "2d": 2.0, "2e": 3.0, "2f": 4.0}


def trial_site(trial: int, letter: str) -> Site:
    """Trial 1: a fence along two sides and four things on the lawn. Trial 2: without the fence, a shed and trees."""
    targets = _fence() if trial == 1 else _surroundings()
    chosen = OBSTACLES if trial == 1 else OBSTACLES[:3]
    if letter != "a":
        targets = targets + [target(name, xy_m) for name, xy_m in chosen]
    layers = LAYERS.get(f"{trial}{letter}", 0.0)
    foliage = _branches(layers, CLEAR_SPOTS[:trial], [xy_m for _, xy_m in chosen]) if layers else []
    words = (TRIAL_1 if trial == 1 else TRIAL_2)[letter][0]
    return Site(f"trial {trial} {letter}, {words}", targets, foliage)


def _fence() -> list[Target]:
    posts = np.arange(-11.0, 11.01, 0.25)
    north = [Target("fence", (float(x), 12.0), 0.06, 1.1, 0.10, solid=False) for x in posts]
    return north + [Target("fence", (11.5, float(y)), 0.06, 1.1, 0.10, solid=False) for y in posts]


def _surroundings() -> list[Target]:
    wall = [Target("shed", (float(x), 12.5), 0.15, 2.2, 1.5) for x in np.arange(-8.0, 2.01, 0.25)]
    trunks = ((11.0, 8.0), (11.5, 0.5), (10.5, -7.5), (-11.5, 6.0), (-11.0, -2.0), (6.0, 11.5))
    return wall + [Target("tree", xy_m, 0.25, 3.0, 3.0) for xy_m in trunks]


def _branches(
    layers: float, clear_spots: Sequence[tuple[float, float]], behind: Sequence[tuple[float, float]]
) -> list[Foliage]:
    """Screens across the line to the lawn's middle: on clear spots, and before each obstacle."""
    return [
        clump
        for x_m, y_m in (*clear_spots, *map(before, behind))
        for clump in screen(
            (x_m, y_m), BRANCHES_WIDE_M, BRANCHES_HIGH_M, layers, along_rad=math.atan2(x_m, -y_m), per_radius=3.0
        )
    ]


def before(xy_m: tuple[float, float]) -> tuple[float, float]:
    """Where branches before an obstacle lie, on the side of the lawn's middle."""
    nearer = 1.0 - IN_FRONT_M / math.hypot(*xy_m)
    return xy_m[0] * nearer, xy_m[1] * nearer


def elevation(site: Site, random: Generator) -> F32:
    """(rows, cols) What a LIDAR makes of the site, row 0 northernmost: the highest of each cell, ground at 0."""
    cells = round(site.side_m / CELL_M)
    up_m = np.zeros((cells, cells))
    ragged = random.uniform(0.6, 1.0, up_m.shape)
    for thing in (*site.targets, *site.foliage):
        leaves = isinstance(thing, Foliage)
        part, covered = disc_cells(site, thing.xy_m, thing.radius_m)
        up_m[part] = np.where(
            covered, np.maximum(up_m[part], thing.height_m * (ragged[part] if leaves else 1.0)), up_m[part]
        )
    return (up_m + random.normal(0.0, LIDAR_SIGMA_M, up_m.shape)).astype(np.float32)


def disc_cells(site: Site, xy_m: tuple[float, float], reach_m: float) -> tuple[tuple[slice, slice], Bools]:
    """The part of the grid around a place, and which of its cells have their middle no further away; at least one."""
    reach_m = max(reach_m, CELL_M / math.sqrt(2.0))
    cells, reach = round(site.side_m / CELL_M), reach_m / CELL_M
    col, row = (site.side_m / 2.0 + xy_m[0]) / CELL_M, (site.side_m / 2.0 - xy_m[1]) / CELL_M
    spans = [
        slice(*(min(cells, max(0, end)) for end in (math.floor(at - reach), math.ceil(at + reach) + 1)))
        for at in (row, col)
    ]
    down, right = ((np.arange(span.start, span.stop) + 0.5 - at) for span, at in zip(spans, (row, col), strict=True))
    return (spans[0], spans[1]), np.hypot(down[:, None], right[None, :]) * CELL_M <= reach_m
