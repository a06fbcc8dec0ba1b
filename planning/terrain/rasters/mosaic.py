"""Tiles of one grid as one raster: whether they are, and where each of them lies in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from planning.errors import RasterFormatError
from planning.terrain.rasters.header import RasterHeader, check_georeference, check_surface_bands

_OFF_GRID_PX = 2e-4
"""Tiles that lie farther than this from the first one's grid are on another one."""


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a tile lies in the mosaic."""

    row0: int
    column0: int
    rows: int
    columns: int

    def shared(self, row0: int, column0: int, rows: int, columns: int) -> tuple[slice, slice] | None:
        """Rows and columns of the mosaic that it shares with a window; None: none."""
        top, left = max(self.row0, row0), max(self.column0, column0)
        bottom, right = min(self.row0 + self.rows, row0 + rows), min(self.column0 + self.columns, column0 + columns)
        return (slice(top, bottom), slice(left, right)) if top < bottom and left < right else None


@dataclass(frozen=True, slots=True)
class Mosaic:
    """The raster that tiles make together."""

    header: RasterHeader
    spots: tuple[Spot, ...]
    """One for each tile, in their order."""


def mosaic_of(tiles: Sequence[tuple[str, RasterHeader]]) -> Mosaic:
    """The mosaic of named tiles; RasterFormatError, with the tile's name, where one does not belong to the others."""
    first_name, first = tiles[0]
    for name, header in tiles:
        check_surface_bands(header, where=name)
        check_georeference(header, where=name)
        if (fault := _difference(first, header)) is not None:
            raise RasterFormatError(
                f"The tiles do not fit together: {name} has {fault} than {first_name}.",
                where=name,
                advice="Bring all tiles to one grid, heights never lowered: gdalwarp -r max -tap -tr CELL CELL, "
                "or leave those out that belong to another model.",
            )
    places = [_place(first, header) for _, header in tiles]
    top, left = min(row for row, _ in places), min(column for _, column in places)
    spots = tuple(
        Spot(row - top, column - left, header.height_px, header.width_px)
        for (row, column), (_, header) in zip(places, tiles, strict=True)
    )
    north = next(k for k, spot in enumerate(spots) if spot.row0 == 0)
    west = next(k for k, spot in enumerate(spots) if spot.column0 == 0)
    transform = (*first.transform[:2], tiles[west][1].transform[2], *first.transform[3:5], tiles[north][1].transform[5])
    header = replace(
        first,
        width_px=max(spot.column0 + spot.columns for spot in spots),
        height_px=max(spot.row0 + spot.rows for spot in spots),
        transform=transform,
        block_bytes=max(header.block_bytes for _, header in tiles),
    )
    return Mosaic(header, spots)


def _difference(first: RasterHeader, other: RasterHeader) -> str | None:
    """What of a tile is another than the first one's, in words; None: nothing that matters."""
    a, b = first.transform, other.transform
    sizes = ((a[0], b[0], other.width_px), (a[4], b[4], other.height_px))
    if (a[1], a[3]) != (0.0, 0.0) or (b[1], b[3]) != (0.0, 0.0):
        return "a grid that is turned, or lies otherwise"
    if any(abs(one - two) * count > _OFF_GRID_PX * abs(one) for one, two, count in sizes):
        return f"other cells ({b[0]:g} x {-b[4]:g} instead of {a[0]:g} x {-a[4]:g})"
    if any(abs(place - round(place)) > _OFF_GRID_PX for place in _exact_place(first, other)):
        return "a grid that lies between the cells"
    same = (
        ("another reference system", first.crs_wkt, other.crs_wkt),
        ("another unit of height", first.unit, other.unit),
        ("another scale or offset of heights", (first.scale, first.offset), (other.scale, other.offset)),
        ("another vertical datum", first.vertical_datum, other.vertical_datum),
    )
    return next((what for what, one, two in same if one != two), None)


def _exact_place(first: RasterHeader, other: RasterHeader) -> tuple[float, float]:
    a, b = first.transform, other.transform
    return (b[5] - a[5]) / a[4], (b[2] - a[2]) / a[0]


def _place(first: RasterHeader, other: RasterHeader) -> tuple[int, int]:
    """Row and column of a tile's first cell in the first one's grid."""
    row, column = _exact_place(first, other)
    return round(row), round(column)
