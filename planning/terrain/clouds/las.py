"""Point clouds in LAS and LAZ files (ASPRS LAS 1.0 to 1.4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import laspy
import numpy as np
from laspy.vlrs.known import GeoKeyDirectoryVlr
from pyproj import CRS
from pyproj.crs import CompoundCRS

from mapping.geometry.arrays import U16
from planning.errors import RasterFormatError
from planning.terrain.clouds.cloud import CHUNK, Box, Chunk

_VERTICAL_KEY, _VERTICAL_UNIT_KEY = 4096, 4099
_UNITS = {9001: "m", 9002: "ft", 9003: "us-ft"}
_CODES = range(1024, 32767)
_NEEDED = (
    laspy.DecompressionSelection.XY_RETURNS_CHANNEL
    | laspy.DecompressionSelection.Z
    | laspy.DecompressionSelection.CLASSIFICATION
    | laspy.DecompressionSelection.FLAGS
)
"""The rest of newer point formats stays compressed: that is half of the time."""


@dataclass(frozen=True, slots=True)
class LasFile:
    """What the header says; points are read by ``chunks``."""

    path: Path
    rows: int
    bounds: Box | None
    crs_wkt: str | None
    unit: str | None
    classified: bool = True
    coarse: bool = False
    notes: tuple[str, ...] = ()

    def chunks(self, *, colors: bool) -> Iterator[Chunk]:
        """Deleted ("withheld") points are left out."""
        read, needed = 0, _NEEDED | (laspy.DecompressionSelection.RGB if colors else 0)
        # Its types leave this argument out.
        with laspy.open(self.path, decompression_selection=needed) as file:  # pyright: ignore[reportCallIssue]
            colored = colors and "red" in file.header.point_format.dimension_names
            for points in file.chunk_iterator(CHUNK):
                read += len(points)
                xyz = np.column_stack([np.asarray(axis) for axis in (points.x, points.y, points.z)])
                classes = np.asarray(points.classification, dtype=np.uint8)
                kept = np.asarray(points.withheld) == 0
                rgb = _rgb(points) if colored else None
                if kept.all():
                    yield xyz, classes, rgb
                else:
                    yield xyz[kept], classes[kept], None if rgb is None else rgb[kept]
        if read < self.rows:
            raise RasterFormatError(f"It ends after {read:,} of {self.rows:,} points.", advice="Copy it again.")


def open_las(path: Path) -> LasFile:
    with laspy.open(path) as file:
        header = file.header
        (west, south, _), (east, north, _) = header.mins, header.maxs
        wkt, unit = _reference(header)
        return LasFile(path, header.point_count, (float(west), float(south), float(east), float(north)), wkt, unit)


def _rgb(points: laspy.ScaleAwarePointRecord) -> U16:
    return np.column_stack([np.asarray(points[name], np.uint16) for name in ("red", "green", "blue")])


def _reference(header: laspy.LasHeader) -> tuple[str | None, str | None]:
    """The reference system, with the vertical one that GeoTIFF keys name beside it, and the unit of heights."""
    crs = header.parse_crs()
    records = [*header.vlrs, *(header.evlrs or [])]
    keys = {
        key.id: key.value_offset for record in records if isinstance(record, GeoKeyDirectoryVlr)
        for key in record.geo_keys
    }  # fmt: skip
    code = keys.get(_VERTICAL_KEY) or 0
    if crs is not None and not crs.is_compound and code in _CODES:
        vertical = CRS.from_epsg(code)
        if vertical.is_vertical:
            crs = CompoundCRS(f"{crs.name} + {vertical.name}", [crs.to_2d(), vertical])
    return (None if crs is None else crs.to_wkt()), _UNITS.get(keys.get(_VERTICAL_UNIT_KEY, 0))
