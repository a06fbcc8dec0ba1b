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

    def chunks(self) -> Iterator[Chunk]:
        """(N, 3) x, y, z in the file's units, and (N,) classes; deleted ("withheld") points are left out."""
        read = 0
        # Its types leave this argument out.
        with laspy.open(self.path, decompression_selection=_NEEDED) as file:  # pyright: ignore[reportCallIssue]
            for points in file.chunk_iterator(CHUNK):
                read += len(points)
                xyz = np.column_stack([np.asarray(axis) for axis in (points.x, points.y, points.z)])
                classes = np.asarray(points.classification, dtype=np.uint8)
                kept = np.asarray(points.withheld) == 0
                yield (xyz, classes) if kept.all() else (xyz[kept], classes[kept])
        if read < self.rows:
            raise RasterFormatError(f"It ends after {read:,} of {self.rows:,} points.", advice="Copy it again.")


def open_las(path: Path) -> LasFile:
    with laspy.open(path) as file:
        header = file.header
        (west, south, _), (east, north, _) = header.mins, header.maxs
        wkt, unit = _reference(header)
        return LasFile(path, header.point_count, (float(west), float(south), float(east), float(north)), wkt, unit)


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
