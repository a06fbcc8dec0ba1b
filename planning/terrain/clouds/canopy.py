"""What classified points say of a model: how many of them are what, and how high it stands above its ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mapping.geometry.arrays import F32

_KINDS: dict[str, tuple[int, ...]] = {
    "ground": (2,),
    "vegetation": (3, 4, 5),
    "buildings": (6,),
    "wires and masts": (13, 14, 15, 16),
    "water": (9,),
    "never classified": (0, 1),
}
"""ASPRS LAS 1.4 R15, table 17."""


@dataclass(frozen=True, slots=True)
class Canopy:
    """The highest point over the highest ground point of the same cell, where a cell has both."""

    cells: int
    greatest_m: float
    median_m: float
    """Of the cells that stand at least 2 m above their ground; 0 where none does."""
    share: float
    """Of the cells that do, among all with both."""


CANOPY_FROM_M = 2.0


def canopy_of(highest_m: F32, ground_m: F32) -> Canopy:
    """(H, W) each, NaN where there is no point."""
    above_m = (highest_m - ground_m)[np.isfinite(ground_m)]
    if not len(above_m):
        return Canopy(0, 0.0, 0.0, 0.0)
    tall_m = above_m[above_m >= CANOPY_FROM_M]
    median_m = float(np.median(tall_m)) if len(tall_m) else 0.0
    return Canopy(len(above_m), float(above_m.max()), median_m, len(tall_m) / len(above_m))


def shares_of(classes: Sequence[int]) -> dict[str, float]:
    """(256,) points of each class -> the shares of what is known and there, largest first; {} without any classes."""
    total = sum(classes)
    found = {name: sum(classes[number] for number in numbers) for name, numbers in _KINDS.items()}
    found["other classes"] = total - sum(found.values())
    if total == 0 or found["never classified"] == total:
        return {}
    there = {name: count / total for name, count in found.items() if count}
    return dict(sorted(there.items(), key=lambda item: -item[1]))
