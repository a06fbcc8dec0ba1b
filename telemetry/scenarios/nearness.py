"""Distances to the single objects of a world, in space and as seen from above."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from telemetry.simulator.scene import World
from telemetry.simulator.scene.primitives import distances

F64 = NDArray[np.float64]

LOW, HIGH = 3, 4
"""Columns of a primitive's row."""


def objects_of(world: World) -> dict[str, F64]:
    """The rows of each object's primitives, by its name; of several with one name all."""
    rows: dict[str, list[F64]] = {}
    for row, owner in zip(world.placed.rows, world.placed.owner.tolist(), strict=True):
        rows.setdefault(world.shapes[owner].name, []).append(row)
    return {name: np.array(several) for name, several in rows.items()}


def away_m(rows: F64, points_enu: F64) -> F64:
    """(N, 3) -> (N,) to the nearest of the primitives, 0 inside."""
    points = np.ascontiguousarray(points_enu, np.float64).reshape(-1, 3)
    nearest_m, index = np.empty(len(points)), np.empty(len(points), np.int32)
    distances(np.ascontiguousarray(rows), points, nearest_m, index)
    return np.maximum(nearest_m, 0.0)


def level_away_m(rows: F64, place_enu: F64) -> float:
    """As seen from above, of one place: infinite where there are no primitives."""
    found = np.inf
    for row in rows:
        middle = np.array([[place_enu[0], place_enu[1], (row[LOW] + row[HIGH]) / 2]])
        found = min(found, float(away_m(row[None], middle)[0]))
    return found
