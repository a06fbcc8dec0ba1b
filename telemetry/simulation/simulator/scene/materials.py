"""What surfaces are made of, as radar and cameras see them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Material:
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
