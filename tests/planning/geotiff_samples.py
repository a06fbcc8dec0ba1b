"""Small rasters that the tests of the raster readers write."""

from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from affine import Affine
from numpy.typing import NDArray

from mapping.geometry.arrays import F32

UTM = "EPSG:32633"
HALF_METRE = Affine(0.5, 0.0, 500_000.0, 0.0, -0.5, 4_170_000.0)


def write_raster(
    path: Path,
    bands: NDArray[Any],
    *,
    crs: str | None = UTM,
    transform: Affine = HALF_METRE,
    tags: dict[str, str] | None = None,
    unit: str | None = None,
    scale: tuple[float, float] | None = None,
    **profile: Any,
) -> Path:
    """A GeoTIFF of (H, W) or (B, H, W) ``bands``; ``scale`` is (scale, offset) of band 1."""
    stack = bands if bands.ndim == 3 else bands[None]
    count, height, width = stack.shape
    shape = {"count": count, "height": height, "width": width, "dtype": str(stack.dtype)}
    with rasterio.open(path, "w", driver="GTiff", crs=crs, transform=transform, **shape, **profile) as file:
        file.write(stack)
        if tags:
            file.update_tags(**tags)
        if unit:
            file.units = (unit,) * count
        if scale:
            file.scales, file.offsets = (scale[0],), (scale[1],)
    return path


def geotiff(elevation: NDArray[Any], **changes: Any) -> bytes:
    """A GeoTIFF of (H, W) ``elevation`` in metres, one cell a metre; ``changes`` to its profile."""
    profile = {
        "driver": "GTiff",
        "height": elevation.shape[0],
        "width": elevation.shape[1],
        "count": 1,
        "dtype": "float32",
        "crs": UTM,
        "transform": Affine(1.0, 0.0, 500_000.0, 0.0, -1.0, 4_176_000.0),
        **changes,
    }
    with rasterio.MemoryFile() as memory:
        with memory.open(**profile) as dataset:
            dataset.write(elevation.astype(np.float32), 1)
        return memory.read()


def hill(rows: int = 40, columns: int = 50) -> F32:
    """A smooth hill around 100 m."""
    y, x = np.mgrid[:rows, :columns]
    return (100.0 + 8.0 * np.exp(-((x - columns / 2) ** 2 + (y - rows / 2) ** 2) / 90.0)).astype(np.float32)
