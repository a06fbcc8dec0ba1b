"""A file of raw samples, whatever its format: parameters of its radar, and one cube per frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mapping.errors import RadarDataError
from mapping.radar.params import FmcwParams

C64 = NDArray[np.complex64]


@dataclass(frozen=True, slots=True)
class AdcFrame:
    t_s: float
    """Since the file's first frame."""
    cube: C64
    """(chirps of one transmitter, virtual antennas, samples)"""


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


def dimensions(shape: tuple[int, ...]) -> str:
    """For messages: ``64 x 12 x 256``."""
    return " x ".join(str(n) for n in shape)


def refuse_empty(name: str, size_bytes: int) -> None:
    """Raises RadarDataError."""
    if not size_bytes:
        raise RadarDataError("The file is empty.", where=name, advice="Record it again.")
