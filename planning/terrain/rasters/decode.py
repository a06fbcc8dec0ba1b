"""What the child process does with rasterio: header, heights, pictures, and writing a surface model."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import rasterio
from affine import Affine
from rasterio.enums import Resampling
from rasterio.errors import NotGeoreferencedWarning
from rasterio.windows import Window

from mapping.geometry.arrays import F32
from planning.terrain.rasters.dataset import DATUM_TAG, Grid, header_of, opened_grid
from planning.terrain.rasters.heights import HeightStats

Json = dict[str, Any]
Send = Callable[..., None]
Ask = Callable[[Json], Json]

_PART_PX = 4_000_000
_SAMPLE_BLOCKS, _SAMPLE_TRIES = 49, 20_000
_GOLDEN = 0.6180339887498949
"""Its multiples, their whole parts cut off, lie evenly between 0 and 1."""
# A file's own georeference is judged by the parent, in its own words.
warnings.simplefilter("ignore", NotGeoreferencedWarning)


def read_grid(job: Json, send: Send, ask: Ask) -> None:
    """Band 1 as raw float32 rows in ``job["target"]``, NaN where the file says unknown.

    What is asked for: "pixels", [first row, first column, rows, columns], or null for none; the file's "digest"; the
    statistics of a "sample" of it.
    """
    with opened_grid(job) as grid:
        order = ask(grid.header.as_json())
        digest = grid.digest() if order["digest"] else ""
        sample, stats = HeightStats(), HeightStats()
        for window in _sample(grid) if order["sample"] else ():
            sample.add(grid.heights(window))
        if order["pixels"] is not None:
            row0, column0, rows, columns = order["pixels"]
            with Path(job["target"]).open("wb") as target:
                for window in _windows(grid, row0, column0, rows, columns):
                    heights = stats.add(grid.heights(window))
                    _place(target, heights, window.row_off - row0, window.col_off - column0, columns)
                    send("progress", stage="decode", share=(window.row_off - row0 + window.height) / rows)
    send("done", sha256=digest, stats=stats.as_json(), sample=sample.as_json())


def read_picture(job: Json, send: Send, ask: Ask) -> None:
    """Colours as raw uint8 (height, width, 4) in ``job["target"]``: red, green, blue, known."""
    with rasterio.open(job["source"], driver=job["driver"]) as source:
        order = ask(header_of(source).as_json())
        window = Window(*order["window"])
        height, width = order["out_shape"]
        bands = [1, 2, 3] if source.count >= 3 else [1, 1, 1]
        rgba = np.empty((height, width, 4), dtype=np.uint8)
        for channel, band in enumerate(bands):
            rgba[..., channel] = source.read(
                band, window=window, out_shape=(height, width), resampling=Resampling.average
            )
            send("progress", stage="decode", share=(channel + 1) / 4)
        rgba[..., 3] = source.dataset_mask(window=window, out_shape=(height, width))
        Path(job["target"]).write_bytes(rgba.tobytes())
    send("done")


def write_grid(job: Json, send: Send, ask: Ask) -> None:
    """A tiled, compressed GeoTIFF at ``job["target"]`` of the raw float32 rows in ``job["source"]``."""
    del ask
    height, width = job["shape"]
    rows = np.memmap(job["source"], dtype=np.float32, mode="r", shape=(height, width))
    profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": height, "width": width, "nodata": -9999.0}
    layout = {"tiled": True, "blockxsize": 256, "blockysize": 256, "compress": "deflate", "predictor": 3}
    with rasterio.open(
        job["target"],
        "w",
        **profile,
        **layout,
        BIGTIFF="IF_SAFER",
        crs=rasterio.CRS.from_wkt(job["crs_wkt"]),
        transform=Affine(*job["transform"]),
    ) as target:
        target.update_tags(**({DATUM_TAG: job["vertical_datum"]} if job["vertical_datum"] else {}))
        for row in range(0, height, 256):
            part = rows[row : row + 256]
            target.write(
                np.where(np.isnan(part), np.float32(-9999.0), part),
                1,
                window=Window(0, row, width, len(part)),  # pyright: ignore[reportCallIssue]
            )
    send("done")


JOBS: dict[str, Callable[[Json, Send, Ask], None]] = {
    "read_grid": read_grid,
    "read_picture": read_picture,
    "write_grid": write_grid,
}


def _windows(grid: Grid, row0: int, column0: int, rows: int, columns: int) -> list[Window]:
    """Parts of about ``_PART_PX`` that cut no block inside: whole rows, or less of them where blocks are tall."""
    block_height, block_width = grid.block
    high = max(1, _PART_PX // (columns * block_height)) * block_height
    wide = grid.header.width_px
    if high * columns > _PART_PX:
        wide = max(1, _PART_PX // (high * block_width)) * block_width
    tops, lefts = _cuts(row0, rows, high, block_height), _cuts(column0, columns, wide, block_width)
    return [
        Window(left, top, right - left, bottom - top)  # pyright: ignore[reportCallIssue]
        for top, bottom in pairwise(tops)
        for left, right in pairwise(lefts)
    ]


def _cuts(first: int, count: int, step: int, block: int) -> list[int]:
    """Where to cut ``count`` from ``first`` on: both ends, and between blocks every ``step``."""
    inner = range(first // block * block + step, first + count, step)
    return [first, *inner, first + count]


def _sample(grid: Grid) -> list[Window]:
    """Blocks spread evenly over what was written of the raster."""
    (height, width), header = grid.block, grid.header
    down, across = -(-header.height_px // height), -(-header.width_px // width)
    count = min(_SAMPLE_BLOCKS, max(1, _PART_PX // (height * width)))
    numbers = dict.fromkeys(int(k * _GOLDEN % 1.0 * down * across) for k in range(_SAMPLE_TRIES))
    blocks = [_block(grid, number // across, number % across) for number in numbers]
    written = list(islice(filter(grid.holds, blocks), count))
    return sorted(written or blocks[:count], key=lambda window: (window.row_off, window.col_off))


def _block(grid: Grid, down: int, across: int) -> Window:
    (height, width), header = grid.block, grid.header
    top, left = down * height, across * width
    return Window(left, top, min(width, header.width_px - left), min(height, header.height_px - top))  # pyright: ignore[reportCallIssue]


def _place(target: BinaryIO, part: F32, row: int, column: int, width: int) -> None:
    """Write a part where it belongs in a file of rows of ``width`` float32."""
    lines = part.reshape(1, -1) if part.shape[1] == width else part
    for line, heights in enumerate(lines):
        target.seek(4 * ((row + line) * width + column))
        target.write(np.ascontiguousarray(heights).data)
