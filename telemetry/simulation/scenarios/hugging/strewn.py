"""Things in the way of a mission that its surface model knows nothing of: masts, walls and trees."""

from __future__ import annotations

import math

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import length_m
from telemetry.simulation.scenarios.stage.world_objects import Object, cylinder, tree, wall
from telemetry.simulation.simulator.scene import SceneTerrain

FIRST_M, APART_M, LAST_M = 30.0, 35.0, 15.0
"""The first stands so far along the line, the next ones so far apart, and none this near to its end."""
ALONE_M = 25.0
"""Where the line crosses itself nothing stands so near to another thing: stopped before the one, a vehicle would never
have met the other."""
KINDS = ("mast", "wall", "tree")


def strewn(
    line_enu_m: F64, terrain: SceneTerrain, random: np.random.Generator, *, apart_m: float = APART_M
) -> list[Object]:
    """One kind after the other on the (K, 3) line, each reaching some metres above it."""
    objects: list[Object] = []
    places: list[tuple[float, float]] = []
    s_m = FIRST_M + float(random.uniform(0.0, 10.0))
    while s_m < length_m(line_enu_m[:, :2]) - LAST_M:
        (east, north, up), heading_rad = _at(line_enu_m, s_m)
        if all(math.dist((east, north), place) >= ALONE_M for place in places):
            places.append((east, north))
            height_m = up - terrain.up_m(north, east) + float(random.uniform(3.0, 8.0))
            kind = KINDS[len(objects) % len(KINDS)]
            objects.append(_object(kind, f"{kind} {len(objects)}", (east, north), height_m, heading_rad, random))
        s_m += apart_m + float(random.uniform(0.0, 10.0))
    return objects


def _object(
    kind: str,
    name: str,
    at_m: tuple[float, float],
    height_m: float,
    heading_rad: float,
    random: np.random.Generator,
) -> Object:
    if kind == "mast":
        return cylinder(name, at_m, float(random.uniform(0.1, 0.25)), height_m, material="metal")
    if kind == "tree":
        return tree(name, at_m, height_m, float(random.uniform(1.5, 2.8)), 0.3 * height_m)
    across = heading_rad + math.pi / 2 + float(random.uniform(-0.5, 0.5))
    half_m = float(random.uniform(2.5, 5.0))
    east, north = half_m * math.sin(across), half_m * math.cos(across)
    ends = (at_m[0] - east, at_m[1] - north), (at_m[0] + east, at_m[1] + north)
    return wall(name, *ends, height_m, thickness_m=0.3, material="concrete")


def _at(line: F64, s_m: float) -> tuple[tuple[float, float, float], float]:
    """Place and heading so far along the line, as seen from above."""
    steps = np.hypot(*np.diff(line[:, :2], axis=0).T)
    ends = np.cumsum(steps)
    leg = int(np.searchsorted(ends, s_m))
    share = 1.0 - (ends[leg] - s_m) / steps[leg]
    place = line[leg] + share * (line[leg + 1] - line[leg])
    east, north = line[leg + 1, :2] - line[leg, :2]
    return (float(place[0]), float(place[1]), float(place[2])), math.atan2(east, north)
