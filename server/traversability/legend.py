"""The colours of each layer of traversability: which classes it has, what they are called, how they look.

Red, orange and green mean clearance in the 3D view, magenta and yellow what sensors saw: none of them is used here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F32, U8, Bools
from server.schemas import LayerName


@dataclass(frozen=True, slots=True)
class Shade:
    """One class of a layer."""

    text: str
    rgb: tuple[int, int, int]
    opacity: float = 0.75

    @property
    def color(self) -> str:
        return "#{:02x}{:02x}{:02x}".format(*self.rgb)


_HARD, _UNTRAVERSABLE, _SOFT = (166, 150, 214), (58, 28, 120), (232, 224, 196)
HALF = 0.5
"""Of the limit: from here on ground is shown as hard to drive on."""
CHANCES = (0.1, 0.3, 0.5, 0.7)
"""Between the classes of the probability."""
SECONDS = (0.0, 2.0, 5.0, 10.0)

LEGENDS: Mapping[LayerName, tuple[Shade, ...]] = {
    "before": (Shade("Hard: over half the limit", _HARD, 0.55), Shade("Untraversable", _UNTRAVERSABLE)),
    "cleared": (
        Shade("Hard: over half the limit", _HARD, 0.55),
        Shade("Soft vegetation: a rover may pass, never land", _SOFT, 0.85),
        Shade("Untraversable", _UNTRAVERSABLE),
    ),
    "probability": (
        Shade("Obstacle: under 10 %", (232, 224, 196)),
        Shade("10 to 30 %", (196, 184, 204)),
        Shade("30 to 50 %", (160, 140, 204)),
        Shade("50 to 70 %", (110, 80, 168)),
        Shade("Over 70 %", _UNTRAVERSABLE),
    ),
    "time_in_view": (
        Shade("In view: up to 2 s", (206, 222, 240)),
        Shade("2 to 5 s", (148, 186, 226)),
        Shade("5 to 10 s", (82, 130, 200)),
        Shade("Over 10 s", (24, 62, 140)),
    ),
}
_WITHOUT_RADAR: Mapping[LayerName, tuple[Shade, ...]] = {"cleared": LEGENDS["before"]}


def legend_of(layer: LayerName, *, with_radar: bool) -> tuple[Shade, ...]:
    """From the lowest class to the highest. Without a radar log there is nothing but the map before clearing."""
    return LEGENDS[layer] if with_radar else _WITHOUT_RADAR.get(layer, LEGENDS["before"])


def classes(layer: Literal["before", "cleared"], value: F32, cleared: Bools) -> U8:
    """(rows, cols) 0: nothing is drawn, else the number of the class; ``value`` is the share of the limit."""
    codes = np.zeros(value.shape, np.uint8)
    codes[value >= HALF] = 1
    codes[value >= 1.0] = 2 if layer == "before" else 3
    if layer == "cleared":
        codes[cleared] = 2
    return codes


def chance_classes(probability: F32, told: Bools) -> U8:
    """Of the cells that the radar had a word in."""
    codes = np.digitize(probability, CHANCES).astype(np.uint8) + np.uint8(1)
    return np.where(told & np.isfinite(probability), codes, np.uint8(0))


def time_classes(time_in_view_s: F32) -> U8:
    return np.digitize(time_in_view_s, SECONDS, right=True).astype(np.uint8)


def painted(codes: U8, shades: tuple[Shade, ...]) -> U8:
    """(rows, cols, 4) colours and opacities."""
    table = np.zeros((256, 4), np.uint8)
    for number, shade in enumerate(shades, 1):
        table[number] = (*shade.rgb, round(255 * shade.opacity))
    return table[codes]
