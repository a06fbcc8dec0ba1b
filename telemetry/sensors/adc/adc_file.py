"""A file of raw samples, whatever its format: parameters of its radar, and one cube per frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from mapping.errors import RadarDataError
from mapping.geometry.arrays import C64
from mapping.radar.radar_params import FmcwParams


@dataclass(frozen=True, slots=True)
class AdcFrame:
    t_s: float
    """Since the file's first frame."""
    cube: C64
    """(chirps of one transmitter, virtual antennas, samples)"""


@dataclass(frozen=True, slots=True)
class AnyFrame:
    """A file's frames for who looks at them in any order."""

    count: int
    read: Callable[[int], AdcFrame]
    """Frame 0 to ``count`` - 1. Raises RadarDataError where the file is wrong."""

    def in_order(self) -> Iterator[AdcFrame]:
        return (self.read(number) for number in range(self.count))


@dataclass(frozen=True, slots=True)
class AdcFile:
    """Opened and checked; ``frames`` reads one after the other and raises RadarDataError where the file is wrong."""

    name: str
    params: FmcwParams
    period_s: float
    """Of frames; an assumption where nothing tells it."""
    notes: tuple[str, ...]
    """What was assumed or put right, a sentence each."""
    frames: Callable[[], Iterator[AdcFrame]]
    any_frame: Callable[[], AnyFrame]
    """Finds out where each frame lies, which of a file of lines takes reading all of it. Raises RadarDataError."""


CLIPPED = 0.01
"""Share of a frame's samples at one and the same end of its values that no unclipped signal comes to."""
_VALUES = 64
"""Cubes of fewer different values are made by hand: nothing is said of them."""


def refuse_clipped(cube: C64, where: str) -> None:
    """Raises RadarDataError where many samples have the very highest or lowest value, and few come near it."""
    parts = np.ascontiguousarray(cube).view(np.float32).ravel()
    high, low = float(parts.max()), float(parts.min())
    if not (np.isfinite(high) and np.isfinite(low) and high > low):
        return
    step = (high - low) / 64
    for end, beside in ((high, parts > high - step), (low, parts < low + step)):
        at_end = float(np.mean(parts == end))
        if at_end > CLIPPED and np.mean(beside) - at_end < at_end / 5 and len(np.unique(parts)) > _VALUES:
            raise RadarDataError(
                f"{at_end:.1%} of its samples have the value {end:,.6g}, and hardly any come near it: clipped.",
                where=where,
                advice="Record again with less gain, or farther from what echoes so strongly.",
            )


def dimensions(shape: tuple[int, ...]) -> str:
    """For messages: ``64 x 12 x 256``."""
    return " x ".join(str(n) for n in shape)


def refuse_empty(name: str, size_bytes: int) -> None:
    """Raises RadarDataError."""
    if not size_bytes:
        raise RadarDataError("The file is empty.", where=name, advice="Record it again.")
