"""What a raster file may ask for before it is refused."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class RasterLimits:
    """Bounds on a raster file. The header ones are checked before any pixel is decoded."""

    max_px: int = 400_000_000
    """Pixels of the file, and of the grid it is resampled to."""
    max_block_bytes: int = 64 * 2**20
    """One decoded tile or strip: a decoder must hold it whole, however small the part asked for."""
    max_memory_bytes: int = 1536 * 2**20
    """Address space of the decoding process."""
    header_s: float = 12.0
    """Wall-clock time until the header is read."""
    decode_s: float = 900.0
    """Wall-clock time until the last pixel is read."""
