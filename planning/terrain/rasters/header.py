"""What a raster file says about itself, and whether it may be decoded."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from affine import Affine

from planning.errors import RasterFormatError, RasterTooLargeError

DATUM_TAG = "HEDGEHOP_VERTICAL_DATUM"
"""The tag that ``write_dsm`` leaves."""
STRIP_ROWS = 256
"""Height of the tiles that it writes."""


@dataclass(frozen=True, slots=True)
class RasterLimits:
    """Bounds on a raster file. The header ones are checked before any pixel is decoded."""

    max_px: int = 400_000_000
    """Pixels that are read at once, and squares of the grid that they are brought to."""
    max_file_px: int = 100_000_000_000
    """Pixels of a file, and squares of its grid, of which only parts are read."""
    max_block_bytes: int = 64 * 2**20
    """One decoded tile or strip: a decoder must hold it whole, however small the part asked for."""
    max_memory_bytes: int = 1536 * 2**20
    """Address space of the decoding process."""
    header_s: float = 12.0
    """Wall-clock time until the header is read."""
    decode_s: float = 900.0
    """Wall-clock time until the last pixel is read."""


@dataclass(frozen=True, slots=True)
class RasterHeader:
    """Facts read without decoding a pixel."""

    driver: str
    width_px: int
    height_px: int
    dtypes: tuple[str, ...]
    """One per band, numpy names."""
    colours: tuple[str, ...]
    """One per band: "gray", "red", "alpha", "undefined" ..."""
    transform: tuple[float, float, float, float, float, float]
    """a, b, c, d, e, f of (column, row) -> (x, y)."""
    crs_wkt: str | None
    has_gcps: bool
    block_bytes: int
    """One decoded block, all bands that share it."""
    unit: str | None
    """Band 1's unit tag."""
    scale: float
    offset: float
    """Band 1: value = stored * scale + offset."""
    vertical_datum: str | None
    """By ``DATUM_TAG``."""

    @classmethod
    def from_json(cls, fields: dict[str, Any]) -> RasterHeader:
        """From the JSON object that the decoding process sends."""
        lists = {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
        return cls(**{**fields, **lists})

    def as_json(self) -> dict[str, Any]:
        """The JSON object that ``from_json`` reads."""
        return asdict(self)

    @property
    def affine(self) -> Affine:
        return Affine(*self.transform)

    @property
    def bands(self) -> int:
        return len(self.dtypes)

    @property
    def is_picture(self) -> bool:
        """Whether the bands are colours: red, green and blue, or three or four of eight bits."""
        eight_bit_colours = self.bands in (3, 4) and set(self.dtypes) == {"uint8"}
        return eight_bit_colours or {"red", "green", "blue"} <= set(self.colours)


def check_size(header: RasterHeader, max_px: int, limits: RasterLimits, *, where: str) -> None:
    """RasterTooLargeError when the file has more pixels, or larger blocks, than are allowed."""
    check_pixels(header.height_px, header.width_px, max_px, where=where)
    if header.block_bytes > limits.max_block_bytes:
        raise RasterTooLargeError(
            f"One block of it decodes to {header.block_bytes / 2**20:.0f} MiB, "
            f"more than the limit of {limits.max_block_bytes / 2**20:.0f} MiB.",
            where=where,
            advice="Rewrite it in tiles: gdal_translate -co TILED=YES in.tif out.tif",
        )


def check_pixels(rows: int, columns: int, max_px: int, *, where: str) -> None:
    """RasterTooLargeError when there are more of them than are allowed."""
    if rows * columns > max_px:
        raise RasterTooLargeError(
            f"{columns} x {rows} pixels are more than the limit of {max_px:,}.",
            where=where,
            advice="Crop it to the area of the flight, or export it at a coarser resolution.",
        )


def check_georeference(header: RasterHeader, *, where: str) -> None:
    """RasterFormatError when pixels have no place on a map."""
    transform = header.affine
    if transform.is_identity and header.has_gcps:
        raise RasterFormatError(
            "It is placed by ground control points only, not by a map grid.",
            where=where,
            advice="Rectify it first, for example with gdalwarp.",
        )
    if transform.is_identity:
        raise RasterFormatError(
            "It is not georeferenced: pixels have no place on a map.",
            where=where,
            advice="Export it as GeoTIFF with its georeference.",
        )
    if abs(transform.determinant) < 1e-30:
        raise RasterFormatError(f"Its pixels have no area: {header.transform}.", where=where)


def check_surface_bands(header: RasterHeader, *, where: str) -> None:
    """RasterFormatError unless band 1 can be elevation (a second band may only be a mask)."""
    if header.is_picture:
        raise RasterFormatError(
            f"This looks like an orthomosaic or photo ({header.bands} bands of {header.dtypes[0]}), "
            "not a surface model.",
            where=where,
            advice="Choose the DSM of the same survey; the orthomosaic can be draped on it.",
        )
    if header.bands > 2 or (header.bands == 2 and header.colours[1] != "alpha"):
        raise RasterFormatError(
            f"It has {header.bands} bands; a surface model has one.",
            where=where,
            advice="Extract the elevation: gdal_translate -b 1 in.tif out.tif",
        )
    if header.dtypes[0].startswith("complex"):
        raise RasterFormatError(f"Its values are {header.dtypes[0]}, not heights.", where=where)
