"""Tiles of one grid as one raster: whether they are, and where each of them lies in it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from affine import Affine

from planning.errors import RasterFormatError
from planning.terrain.rasters.header import RasterHeader, check_georeference, check_surface_bands

_OFF_GRID_PX = 2e-4
"""Tiles that lie farther than this from the first one's grid are on another one."""
_CLAIM_OFF_PX = 0.01


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
class Claim:
    """What a virtual raster says of one of its tiles."""

    nodata: tuple[float, ...]
    """Numbers that it calls unknown."""
    source_rect: tuple[float, float, float, float]
    """First column and row, columns and rows of the tile; those of the virtual raster are ``target_rect``."""
    target_rect: tuple[float, float, float, float]
    size_px: tuple[int, int]
    """Columns and rows of the virtual raster."""
    transform: tuple[float, ...]
    """a, b, c, d, e, f of (column, row) -> (x, y) of the virtual raster."""
    dtype: str
    scale: float
    offset: float
    unit: str
    """Empty: it says none, as ``vertical_datum``."""
    vertical_datum: str

    @classmethod
    def from_json(cls, fields: dict[str, Any]) -> Claim:
        """What ``as_json`` wrote."""
        lists: dict[str, Any] = {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
        return cls(**{**fields, **lists})

    def as_json(self) -> dict[str, Any]:
        return asdict(self)

    def difference(self, tile: RasterHeader) -> str | None:
        """What it says otherwise than the tile does, in words; None: nothing."""
        whole = (0.0, 0.0, float(tile.width_px), float(tile.height_px))
        left, top, *size = self.target_rect
        if self.source_rect != whole or (*size,) != whole[2:]:
            return "crops or stretches it"
        if min(left, top) < -_CLAIM_OFF_PX or any(
            at + count > most + _CLAIM_OFF_PX for at, count, most in zip((left, top), size, self.size_px, strict=True)
        ):
            return "crops it"
        if not self._places(tile):
            return "puts it elsewhere than it lies"
        if self.dtype != tile.dtypes[0]:
            return f"changes its numbers from {tile.dtypes[0]} to {self.dtype or 'something else'}"
        if (self.scale, self.offset) != (tile.scale, tile.offset):
            return f"scales it by {self.scale:g} from {self.offset:g} on, not by {tile.scale:g} from {tile.offset:g} on"
        if self.unit and self.unit != (tile.unit or ""):
            return f'gives its heights the unit "{self.unit}"'
        if self.vertical_datum and self.vertical_datum != (tile.vertical_datum or ""):
            return f'gives it the vertical datum "{self.vertical_datum}"'
        return None

    def _places(self, tile: RasterHeader) -> bool:
        here = Affine(*self.transform)
        if here.is_degenerate or tile.affine.is_degenerate:
            return False
        brought, (left, top) = ~here @ tile.affine, self.target_rect[:2]
        corners = ((0, 0), (tile.width_px, 0), (0, tile.height_px))
        return all(
            math.dist(brought @ corner, (left + corner[0], top + corner[1])) <= _CLAIM_OFF_PX for corner in corners
        )


@dataclass(frozen=True, slots=True)
class Mosaic:
    """The raster that tiles make together."""

    header: RasterHeader
    first: RasterHeader
    """The first tile's, with which all others were compared."""
    spots: tuple[Spot, ...]
    """One for each tile, in their order."""
    unknown: Mapping[int, tuple[float, ...]]
    """By a tile's number: what a virtual raster calls unknown and the tile does not."""

    def is_tile(self, number: int, header: RasterHeader) -> bool:
        """Whether a tile that is opened again is still the one that was judged."""
        spot, start = self.spots[number], self.spots[0]
        return (
            (header.height_px, header.width_px, header.bands) == (spot.rows, spot.columns, self.first.bands)
            and _difference(self.first, header) is None
            and _place(self.first, header) == (spot.row0 - start.row0, spot.column0 - start.column0)
        )

    @classmethod
    def from_json(cls, fields: dict[str, Any]) -> Mosaic:
        """What ``as_json`` wrote."""
        return cls(
            RasterHeader.from_json(fields["header"]),
            RasterHeader.from_json(fields["first"]),
            tuple(Spot(*spot) for spot in fields["spots"]),
            {int(number): tuple(values) for number, values in fields["unknown"].items()},
        )

    def as_json(self) -> dict[str, Any]:
        spots = [(spot.row0, spot.column0, spot.rows, spot.columns) for spot in self.spots]
        headers = {"header": self.header.as_json(), "first": self.first.as_json()}
        return {**headers, "spots": spots, "unknown": self.unknown}


def mosaic_of(
    tiles: Sequence[tuple[str, RasterHeader]], unknown: Mapping[int, tuple[float, ...]] | None = None
) -> Mosaic:
    """The mosaic of named tiles; RasterFormatError, with the tile's name, where one does not belong to the others.

    ``unknown`` are numbers that a virtual raster calls so, by a tile's number.
    """
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
    return Mosaic(header, first, spots, unknown or {})


def more_than_a_list(where: str, why: str) -> RasterFormatError:
    """The refusal of a virtual raster."""
    return RasterFormatError(
        f"This virtual raster (VRT) is more than a list of tiles: {why}.",
        where=where,
        advice="Write it out as a GeoTIFF: gdal_translate in.vrt out.tif",
    )


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
