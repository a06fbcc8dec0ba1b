"""Shapes set on a world's ground: rows of primitives, and whose they are."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64, I32
from telemetry.simulation.simulator.scene.ground_columns import SceneTerrain
from telemetry.simulation.simulator.scene.primitives import COLUMNS, box_row, cylinder_row, ellipsoid_row
from telemetry.simulation.simulator.scene.world_shapes import (
    MATERIALS,
    AnyShape,
    Box,
    CornerReflector,
    Cylinder,
    Material,
    Tree,
)


@dataclass(frozen=True, slots=True)
class Placed:
    rows: F64
    """(K, 10) primitives"""
    owner: I32
    """(K,) number of the shape that each belongs to"""
    reflectivity: F64
    """(K,) radar cross section over the area seen"""
    texture: F64
    """(K,)"""
    corner_m2: F64
    """(K,) radar cross section of a corner reflector; 0 for all else"""
    velocity_enu_m_s: F64
    """(K, 3)"""


def place(shapes: tuple[AnyShape, ...], terrain: SceneTerrain, shift_m: tuple[float, float]) -> Placed:
    """``shift_m`` is where the file's origin lies in the frame, east and north."""
    rows: list[list[float]] = []
    owner: list[int] = []
    materials: list[Material] = []
    corners: list[float] = []
    for number, shape in enumerate(shapes):
        for row, material, corner_m2 in _parts(shape, terrain, shift_m):
            rows.append(row)
            owner.append(number)
            materials.append(MATERIALS[material])
            corners.append(corner_m2)
    return Placed(
        np.array(rows, dtype=np.float64).reshape(-1, COLUMNS),
        np.array(owner, dtype=np.int32),
        np.array([10 ** (m.reflectivity_db / 10) for m in materials], dtype=np.float64),
        np.array([m.texture for m in materials], dtype=np.float64),
        np.array(corners, dtype=np.float64),
        np.zeros((len(rows), 3)),
    )


def moved(
    placed: Placed, shapes: tuple[AnyShape, ...], terrain: SceneTerrain, shift_m: tuple[float, float], t_s: float
) -> Placed:
    """With the shapes that move where they are at ``t_s``; what counts from the ground goes up and down with it."""
    rows, velocity = placed.rows.copy(), placed.velocity_enu_m_s.copy()
    for number, shape in enumerate(shapes):
        if shape.motion is None:
            continue
        at_m, (v_east, v_north) = shape.motion.at(t_s)
        of_shape = placed.owner == number
        rows[of_shape] = [row for row, _, _ in _parts(replace(shape, at_m=at_m), terrain, shift_m)]
        velocity[of_shape] = (v_east, v_north, 0.0)
    return replace(placed, rows=rows, velocity_enu_m_s=velocity)


_Part = tuple[list[float], str, float]


def _parts(shape: AnyShape, terrain: SceneTerrain, shift_m: tuple[float, float]) -> list[_Part]:
    at = (shape.at_m[0] + shift_m[0], shape.at_m[1] + shift_m[1])
    base = shape.base_m + (terrain.up_m(at[1], at[0]) if shape.above == "ground" else 0.0)
    low = _foot(shape, at, base, terrain)
    match shape:
        case Box(size_m=(width_m, depth_m, height_m), heading_rad=heading_rad, material=material):
            return [(box_row(at, low, base + height_m, width_m, depth_m, heading_rad), material, 0.0)]
        case Cylinder(radius_m=radius_m, height_m=height_m, material=material):
            return [(cylinder_row(at, low, base + height_m, radius_m), material, 0.0)]
        case Tree():
            crown = (base + shape.crown_base_m, base + shape.height_m)
            middle = (crown[0] + crown[1]) / 2
            return [
                (cylinder_row(at, low, middle, shape.trunk_radius_m), "wood", 0.0),
                (ellipsoid_row(at, *crown, shape.crown_radius_m, shape.leaf_path_m), "leaves", 0.0),
            ]
        case CornerReflector(edge_m=edge_m):
            half = edge_m / 2
            return [(ellipsoid_row(at, base - half, base + half, half), "metal", shape.cross_section_m2)]


def _foot(shape: AnyShape, at: tuple[float, float], base: float, terrain: SceneTerrain) -> float:
    """What stands on a slope reaches down to the ground under all of it."""
    if shape.above != "ground" or shape.base_m != 0.0:
        return base
    half = _reach(shape)
    around = [(at[0] + x * half, at[1] + y * half) for x in (-1, 0, 1) for y in (-1, 0, 1)]
    return min(base, *(terrain.up_m(north, east) for east, north in around))


def _reach(shape: AnyShape) -> float:
    match shape:
        case Box(size_m=(width_m, depth_m, _)):
            return math.hypot(width_m, depth_m) / 2
        case Cylinder(radius_m=radius_m):
            return radius_m
        case _:
            return 0.0
