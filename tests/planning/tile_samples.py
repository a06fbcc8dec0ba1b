"""Folders of tiles, and virtual rasters that list them, written for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import rasterio
import rasterio.errors
from affine import Affine

from tests.planning.geotiff_samples import HALF_METRE, write_raster

ROWS, COLUMNS = 96, 120
KINDS: dict[str, tuple[str, Affine]] = {
    "metres": ("EPSG:32633", HALF_METRE),
    "south up": ("EPSG:32633", Affine(0.5, 0.0, 5e5, 0.0, 0.5, 4.17e6)),
    "degrees": ("EPSG:4326", Affine(2e-6, 0.0, 14.99, 0.0, -1.6e-6, 37.73)),
    "feet": ("EPSG:2994", Affine(1.0, 0.0, 7e5, 0.0, -1.0, 1e6)),
}
Cuts = tuple[list[int], list[int], int]
"""Rows and columns to cut at, and by how much tiles overlap."""


def heights_of(seed: int = 3) -> np.ndarray:
    random = np.random.default_rng(seed)
    heights = random.uniform(0.0, 30.0, (ROWS, COLUMNS)).astype(np.float32)
    heights[random.random(heights.shape) < 0.02] = -9999.0
    return heights


def cut(folder: Path, heights: np.ndarray, kind: str, cuts: Cuts, **profile: Any) -> Path:
    """A folder of tiles, each a little larger than its share."""
    folder.mkdir(parents=True)
    crs, transform = KINDS[kind]
    rows, columns, over = sorted({0, *cuts[0]}), sorted({0, *cuts[1]}), cuts[2]
    for row, row_end in zip(rows, [*rows[1:], heights.shape[0]], strict=True):
        for column, column_end in zip(columns, [*columns[1:], heights.shape[1]], strict=True):
            tile = heights[row : row_end + over, column : column_end + over]
            at = transform @ Affine.translation(column, row)
            path = folder / f"{row}_{column}.tif"
            write_raster(path, tile, crs=crs, transform=at, nodata=-9999.0, **profile)
    return folder


def vrt(
    path: Path,
    named: list[str],
    *,
    source: str = "SimpleSource",
    more: str = "",
    band: str = "",
    dataset: str = "",
    attributes: str = "",
    changed: dict[str, str] | None = None,
    relative: int = 1,
) -> Path:
    """A list of tiles as gdalbuildvrt writes it; ``changed`` are parts of its text that are put otherwise."""
    headers = [h for h in (_header(path.parent / name) for name in named) if h is not None]
    first = headers[0] if headers else {"transform": HALF_METRE, "width": 9, "height": 9, "dtype": "float32"}
    places = [~first["transform"] @ h["transform"] for h in headers]
    left, top = min([0.0, *(at.c for at in places)]), min([0.0, *(at.f for at in places)])
    width = max([9.0, *(at.c - left + h["width"] for at, h in zip(places, headers, strict=True))])
    height = max([9.0, *(at.f - top + h["height"] for at, h in zip(places, headers, strict=True))])
    origin = first["transform"] @ Affine.translation(round(left), round(top))
    sources = []
    for name in named:
        header = _header(path.parent / name) or first
        at = ~origin @ header["transform"]
        size = f'xSize="{header["width"]}" ySize="{header["height"]}"'
        sources.append(
            f'<{source}><SourceFilename relativeToVRT="{relative}">{name}</SourceFilename>'
            f'<SourceBand>1</SourceBand><SrcRect xOff="0" yOff="0" {size} />'
            f'<DstRect xOff="{round(at.c)}" yOff="{round(at.f)}" {size} />{more}</{source}>'
        )
    numbers = ", ".join(repr(value) for value in origin.to_gdal())
    dtype = {"float32": "Float32", "int16": "Int16", "uint8": "Byte"}[first["dtype"]]
    text = (
        f'<VRTDataset rasterXSize="{round(width)}" rasterYSize="{round(height)}"{attributes}>'
        f"<GeoTransform>{numbers}</GeoTransform>{dataset}"
        f'<VRTRasterBand dataType="{dtype}" band="1">{band}{"".join(sources)}</VRTRasterBand></VRTDataset>'
    )
    for old, new in (changed or {}).items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text)
    return path


def _header(tile: Path) -> Any:
    try:
        with rasterio.open(tile) as source:
            return source.profile
    except (rasterio.errors.RasterioIOError, ValueError):
        return None
