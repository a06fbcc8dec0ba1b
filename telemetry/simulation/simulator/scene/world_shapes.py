"""The shapes that worlds are made of, as a world file gives them, and what they consist of."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from mapping.radar.radar_params import LIGHT_M_S
from telemetry.simulation.simulator.scene.motion import Motion

WAVELENGTH_M = LIGHT_M_S / 77.5e9
"""Of the radar that corner reflectors are made for."""

Above = Literal["ground", "origin"]
"""What a base is counted from: the ground under the shape's middle, or the height of the world's origin."""


@dataclass(frozen=True, slots=True)
class Material:
    """What a surface is made of, as radar and cameras see it."""

    reflectivity_db: float
    """Radar cross section over the area seen, at 77 GHz: rough surfaces scatter as much whatever their slant."""
    texture: float
    """Share of its patches on which stereo vision finds something to match."""


MATERIALS: dict[str, Material] = {
    "concrete": Material(-8.0, 0.85),
    "stone": Material(-7.0, 0.97),
    "plaster": Material(-9.0, 0.3),
    "glass": Material(-12.0, 0.1),
    "metal": Material(0.0, 0.7),
    "wood": Material(-10.0, 0.95),
    "leaves": Material(-11.0, 0.97),
    "earth": Material(-16.0, 0.98),
}
GROUND = MATERIALS["earth"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    name: str
    at_m: tuple[float, float]
    """East and north of the world's origin, of its middle."""
    base_m: float = 0.0
    """Height of its lower end; a base of 0 above the ground reaches down to it on slopes."""
    above: Above = "ground"
    motion: Motion | None = None
    """None: it stays at ``at_m``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Box(Shape):
    """Upright, turned about the vertical. Walls are thin ones."""

    size_m: tuple[float, float, float]
    """Width, depth and height; without a turn east, north and up."""
    heading_rad: float = 0.0
    """Of its depth, clockwise from north."""
    material: str = "concrete"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylinder(Shape):
    """Upright."""

    radius_m: float
    height_m: float
    material: str = "concrete"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tree(Shape):
    """A trunk, and a crown that rays get into."""

    height_m: float
    crown_radius_m: float
    crown_base_m: float
    """Above the tree's base."""
    trunk_radius_m: float = 0.15
    leaf_path_m: float = 0.6
    """How far a ray gets into the crown on average; 0: not at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerReflector(Shape):
    """Three metal triangles at right angles; ``base_m`` is the height of its middle. It always faces the radar."""

    edge_m: float = 0.1
    """Of the right angle."""

    @property
    def cross_section_m2(self) -> float:
        """Of a trihedral at its best: 4 pi a^4 / (3 lambda^2)."""
        return 4 * math.pi * self.edge_m**4 / (3 * WAVELENGTH_M**2)


AnyShape = Box | Cylinder | Tree | CornerReflector


def wall(
    name: str,
    from_m: tuple[float, float],
    to_m: tuple[float, float],
    *,
    height_m: float,
    thickness_m: float,
    material: str,
    base_m: float = 0.0,
    above: Above = "ground",
) -> Box:
    """An upright slab between two places."""
    east, north = to_m[0] - from_m[0], to_m[1] - from_m[1]
    return Box(
        name=name,
        at_m=((from_m[0] + to_m[0]) / 2, (from_m[1] + to_m[1]) / 2),
        base_m=base_m,
        above=above,
        size_m=(thickness_m, math.hypot(east, north), height_m),
        heading_rad=math.atan2(east, north),
        material=material,
    )
