"""Objects as a world file has them, for worlds that are built in code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Object = dict[str, Any]
Place = tuple[float, float]
"""East and north of the world's origin."""


def world_document(name: str, objects: Sequence[Object]) -> dict[str, Any]:
    return {"format": "hedgehop-world", "version": 1, "name": name, "objects": list(objects)}


def box(name: str, at_m: Place, size_m: tuple[float, float, float], **more: Any) -> Object:
    """``size_m``: width, depth, height. ``more``: base_m, above, heading_deg, material."""
    return {"type": "box", "name": name, "at_m": list(at_m), "size_m": list(size_m), **more}


def wall(name: str, from_m: Place, to_m: Place, height_m: float, **more: Any) -> Object:
    """``more``: thickness_m, base_m, above, material."""
    return {"type": "wall", "name": name, "from_m": list(from_m), "to_m": list(to_m), "height_m": height_m, **more}


def cylinder(name: str, at_m: Place, radius_m: float, height_m: float, **more: Any) -> Object:
    return {
        "type": "cylinder", "name": name, "at_m": list(at_m), "radius_m": radius_m, "height_m": height_m, **more
    }  # fmt: skip


def tree(name: str, at_m: Place, height_m: float, crown_radius_m: float, crown_base_m: float) -> Object:
    return {
        "type": "tree",
        "name": name,
        "at_m": list(at_m),
        "height_m": height_m,
        "crown_radius_m": crown_radius_m,
        "crown_base_m": crown_base_m,
    }


def reflector(name: str, at_m: Place, up_m: float, edge_m: float) -> Object:
    return {
        "type": "corner_reflector",
        "name": name,
        "at_m": list(at_m),
        "base_m": up_m,
        "edge_m": edge_m,
    }
