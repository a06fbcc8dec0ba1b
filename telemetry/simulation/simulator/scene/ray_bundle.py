"""What a bundle of rays meets first: ground, a shape, or nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I32
from telemetry.simulation.simulator.scene.ground_columns import SceneTerrain, first_ground
from telemetry.simulation.simulator.scene.primitives import bounding_spheres, span

GROUND, NOTHING = -1, -2


@dataclass(frozen=True, slots=True)
class Hits:
    distance_m: F64
    """(N,); inf where nothing was met."""
    what: I32
    """(N,) number of the primitive, GROUND or NOTHING."""


def cast(
    terrain: SceneTerrain, rows: F64, numbers: I32, origin_enu: F64, directions_enu: F64, luck: F64, *, most_m: float
) -> Hits:
    """Rays from one place, at most ``most_m`` long.

    ``rows`` are the primitives that may be met, nearest first (``World.ahead``): a ray looks at none that begins beyond
    what it has met. ``numbers`` is what to call them; ``directions_enu`` (N, 3) are unit vectors; ``luck`` (N,) in
    (0, 1) says how far each ray gets into leaves: the share of such rays that get farther.
    """
    distance_m, what = np.empty(len(directions_enu)), np.empty(len(directions_enu), np.int32)
    _cast(
        terrain.up, terrain.maxima, terrain.to_cells, terrain.floor_up_m, rows, bounding_spheres(rows), numbers,
        origin_enu, np.ascontiguousarray(directions_enu, dtype=np.float64), luck, most_m, distance_m, what,
    )  # fmt: skip
    return Hits(distance_m, what)


@njit(cache=True, nogil=True)
def _cast(up, maxima, to_cells, floor, rows, spheres, numbers, origin, directions, luck, most_m, distance_m, what):
    ox, oy, oz = origin[0], origin[1], origin[2]
    around = _around(spheres, ox, oy, oz)
    for n in range(directions.shape[0]):
        dx, dy, dz = directions[n, 0], directions[n, 1], directions[n, 2]
        best, number = most_m, NOTHING
        t = first_ground(up, maxima, to_cells, floor, ox, oy, oz, dx, dy, dz, best)
        if t <= best and t < math.inf:
            best, number = t, GROUND
        depth = -math.log(luck[n])
        for k in range(rows.shape[0]):
            if around[k, 5] > best:
                break
            along = around[k, 0] * dx + around[k, 1] * dy + around[k, 2] * dz
            if around[k, 4] > along * along or along < -around[k, 3]:
                continue
            t0, t1 = span(rows[k], ox, oy, oz, dx, dy, dz)
            t = t0 + depth * rows[k, 9]
            if t0 <= t1 and t <= t1 and (t < best or (t == best and number != GROUND)):
                best, number = t, numbers[k]
        distance_m[n] = best if number != NOTHING else math.inf
        what[n] = number


@njit(cache=True, nogil=True)
def _around(spheres, ox, oy, oz):
    """(K, 6) Of each sphere, seen from o: its middle, radius, squared tangent, and how far away it is at least."""
    found = np.empty((spheres.shape[0], 6))
    for k in range(spheres.shape[0]):
        x, y, z, radius = spheres[k, 0] - ox, spheres[k, 1] - oy, spheres[k, 2] - oz, spheres[k, 3]
        squared = x * x + y * y + z * z
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = x, y, z, radius
        found[k, 4], found[k, 5] = squared - radius * radius, math.sqrt(squared) - radius
    return found
