"""Which stored numbers are heights: undeclared no-data values, statistics, and doubts about the unit."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from mapping.geometry.arrays import F32

ABSURD = 1e30
"""No height in any unit: float32's limits and the like, written for "unknown"."""
SENTINELS = (-9999.0, -10000.0, -32767.0, -32768.0, -99999.0)
"""Numbers that programs write for "unknown" without always declaring it."""
_FAR_M = 1000.0
_HIGHEST_M = 9000.0


@dataclass(slots=True)
class HeightStats:
    """What was met in the stored numbers; sentinels are counted apart and not in the range."""

    known: int = 0
    lowest: float = np.inf
    highest: float = -np.inf
    zeros: int = 0
    absurd: int = 0
    """Infinite or beyond ``ABSURD``: masked at once."""
    sentinels: dict[str, int] = field(default_factory=dict)
    """Count by number, as text."""

    def add(self, heights: F32) -> F32:
        """Count a block and mask its absurd numbers in place; returns it."""
        absurd = np.abs(heights) > ABSURD
        if absurd.any():
            self.absurd += int(np.count_nonzero(absurd))
            heights[absurd] = np.nan
        ordinary = heights[~np.isnan(heights)]
        if ordinary.size and ordinary.min() <= max(SENTINELS):
            ordinary = self._set_sentinels_apart(ordinary)
        if ordinary.size:
            self.known += ordinary.size
            self.lowest = min(self.lowest, float(ordinary.min()))
            self.highest = max(self.highest, float(ordinary.max()))
            self.zeros += ordinary.size - int(np.count_nonzero(ordinary))
        return heights

    def _set_sentinels_apart(self, values: F32) -> F32:
        for sentinel in SENTINELS:
            hit = values == np.float32(sentinel)
            if count := int(np.count_nonzero(hit)):
                self.sentinels[str(sentinel)] = self.sentinels.get(str(sentinel), 0) + count
                values = values[~hit]
        return values

    def as_json(self) -> dict[str, Any]:
        """Finite numbers only, JSON knows no others."""
        fields = asdict(self)
        return {
            **fields,
            "lowest": self.lowest if self.known else None,
            "highest": self.highest if self.known else None,
        }

    @classmethod
    def from_json(cls, fields: dict[str, Any]) -> HeightStats:
        """What ``as_json`` wrote."""
        unknown_range = {"lowest": np.inf, "highest": -np.inf} if fields["lowest"] is None else {}
        return cls(**{**fields, **unknown_range})


def false_sentinels(stats: HeightStats) -> tuple[float, ...]:
    """Sentinels that lie so far below all other heights that they cannot be heights."""
    if not stats.known:
        return tuple(float(text) for text in stats.sentinels)
    gap = max(_FAR_M, 2.0 * (stats.highest - stats.lowest))
    return tuple(value for text in stats.sentinels if (value := float(text)) < stats.lowest - gap)


def mask_and_scale(heights: F32, *, sentinels: tuple[float, ...], scale: float, offset: float) -> None:
    """In place, by rows: sentinels become NaN, the rest ``stored * scale + offset``."""
    if not sentinels and scale == 1.0 and offset == 0.0:
        return
    rows = max(1, 4_000_000 // heights.shape[1])
    for row in range(0, heights.shape[0], rows):
        part = heights[row : row + rows]
        for sentinel in sentinels:
            part[part == np.float32(sentinel)] = np.nan
        part *= np.float32(scale)
        part += np.float32(offset)


def doubts(stats: HeightStats, *, dtype: str, scaled: bool) -> tuple[str, ...]:
    """Plain warnings about numbers that may not be heights in metres."""
    found: list[str] = []
    span = f"{stats.lowest:g} to {stats.highest:g}"
    if not scaled and stats.highest > _HIGHEST_M:
        factor, name = (0.01, "centimetres") if stats.highest * 0.01 <= _HIGHEST_M else (0.001, "millimetres")
        found.append(f"Heights of {span} ({dtype}) look like {name}, not metres: use --z-scale {factor:g} if so.")
    if dtype == "uint8" and not scaled:
        found.append(f"Heights are 8-bit whole numbers, {span}: this may be a picture or a hill shading, not heights.")
    if stats.lowest == 0 and 0 < stats.zeros < stats.known and stats.zeros >= 0.01 * stats.known:
        found.append(
            f"{stats.zeros / stats.known:.0%} of the known cells are exactly 0: "
            "if 0 means unknown, declare it: gdal_translate -a_nodata 0 in.tif out.tif"
        )
    return tuple(found)
