"""What all formats of point clouds have in common once they are opened."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from mapping.geometry.arrays import F64, U8, U16

Chunk = tuple[F64, U8 | None, U16 | None]
"""(N, 3) x, y, z in the file's units, (N,) ASPRS classes where it has them, and (N, 3) red, green, blue where it has
them and they were asked for: of 8 bits or of 16, all points of a file alike."""
Box = tuple[float, float, float, float]
"""Least x and y, greatest x and y, in the file's units."""
CHUNK = 1_000_000
"""Points that are held at once."""


class Cloud(Protocol):
    """Facts of the header at once; points when they are asked for."""

    @property
    def rows(self) -> int:
        """As the file counts its points."""
        ...

    @property
    def bounds(self) -> Box | None:
        """None: the file does not tell, its points must be looked at."""
        ...

    @property
    def crs_wkt(self) -> str | None: ...

    @property
    def unit(self) -> str | None:
        """Of the heights, where the file gives them one of their own."""
        ...

    @property
    def classified(self) -> bool: ...

    @property
    def coarse(self) -> bool:
        """Whether places are kept in 32 bits, too few for coordinates of a map grid."""
        ...

    @property
    def notes(self) -> tuple[str, ...]: ...

    def chunks(self, *, colors: bool) -> Iterator[Chunk]:
        """RasterFormatError when there are fewer points than the header says."""
        ...
