"""Records of one kind out of a vehicle's own log, as columns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mapping.geometry.arrays import F64, Bools
from telemetry.recording.tlog import Data

_NUMBERS = "iuf"
_LARGEST_COUNT = 2**32


@dataclass(frozen=True, slots=True)
class Rows:
    """Columns as the log packs them; what it has no such column for is NaN, or an empty text."""

    packed: NDArray[Any]
    """(N,) structured"""
    scales: Mapping[str, float] = field(default_factory=dict)
    """Units per count, of columns that are written as whole counts."""

    def __len__(self) -> int:
        return len(self.packed)

    def has(self, name: str) -> bool:
        return name in (self.packed.dtype.names or ())

    def column(self, *names: str) -> F64:
        """(N,) of the first of ``names`` that the log has: they were renamed over the years."""
        found = next((name for name in names if self.has(name)), None)
        if found is None or self.packed.dtype[found].kind not in _NUMBERS:
            return np.full(len(self), np.nan)
        return self.packed[found].astype(np.float64) * self.scales.get(found, 1.0)

    def columns(self, name: str, width: int) -> F64:
        """(N, width) of an array of so many; NaN where the log packs it in any other way."""
        packed_as = self.packed.dtype[name] if self.has(name) else None
        if packed_as is None or packed_as.shape != (width,) or packed_as.base.kind not in _NUMBERS:
            return np.full((len(self), width), np.nan)
        return self.packed[name].astype(np.float64)

    def wholes(self, *names: str) -> list[int | None]:
        """As ``column``; None where it is no whole count from 0 on."""
        return [int(n) if 0 <= n < _LARGEST_COUNT else None for n in self.column(*names).tolist()]

    def texts(self, name: str) -> list[str]:
        if not self.has(name) or self.packed.dtype[name].kind != "S":
            return [""] * len(self)
        return [text.split(b"\0", 1)[0].decode(errors="replace") for text in self.packed[name].tolist()]

    def where(self, rows: Bools) -> Rows:
        return Rows(self.packed[rows], self.scales)


NO_ROWS = Rows(np.empty(0, dtype=np.dtype([])))


def gathered(data: Data, offsets: Iterable[int], layout: np.dtype[Any]) -> NDArray[Any]:
    """The records that begin at ``offsets``. Copied: a view would keep the file open."""
    size = layout.itemsize
    return np.frombuffer(b"".join(data[at : at + size] for at in offsets), dtype=layout)
