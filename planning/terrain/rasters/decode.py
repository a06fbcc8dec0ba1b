"""What the child process does with rasterio: header, heights, pictures, and writing a surface model."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import rasterio
from affine import Affine
from rasterio.enums import Resampling
from rasterio.errors import NotGeoreferencedWarning
from rasterio.windows import Window

from mapping.geometry.arrays import F32
from planning.terrain.rasters.dataset import Grid, header_of, opened_grid
from planning.terrain.rasters.header import DATUM_TAG, STRIP_ROWS
from planning.terrain.rasters.heights import HeightStats

Json = dict[str, Any]
Send = Callable[..., None]
Ask = Callable[[Json], Json]

_PART_PX = 4_000_000
_SAMPLE_BLOCKS = 49
_SEARCH = 8
"""As many times a sample is looked through where nothing of it is known."""
# A file's own georeference is judged by the parent, in its own words.
warnings.simplefilter("ignore", NotGeoreferencedWarning)


def read_grid(job: Json, send: Send, ask: Ask) -> None:
    """Band 1 as raw float32 rows in ``job["target"]``, NaN where the file says unknown.

    What is asked for: "pixels", [first row, first column, rows, columns], or null for none; the file's "digest"; the
    statistics of a "sample" of it. At the first look of a mosaic its "layout" comes back.
    """
    with opened_grid(job) as grid:
        order = ask(grid.header.as_json())
        told = partial(send, "progress", stage="digest")
        digest = grid.digest(lambda share: told(share=share)) if order["digest"] else ""
        layout = grid.layout() if order["digest"] else None
        sample, stats = _sample(grid) if order["sample"] else HeightStats(), HeightStats()
        if order["pixels"] is not None:
            row0, column0, rows, columns = order["pixels"]
            with Path(job["target"]).open("wb") as target:
                for window in _windows(grid, row0, column0, rows, columns):
                    heights = stats.add(grid.heights(window))
                    _place(target, heights, window.row_off - row0, window.col_off - column0, columns)
                    send("progress", stage="decode", share=(window.row_off - row0 + window.height) / rows)
    send("done", sha256=digest, stats=stats.as_json(), sample=sample.as_json(), layout=layout)


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
    """A tiled, compressed GeoTIFF at ``job["target"]`` of the raw float32 rows from the pipe ``job["rows"]``.

    Asks, with nothing, when it is ready for them. Raises OSError where they end too early, or go on, and where what is
    written last cannot be read back: closing a file tells nothing of a disk that is full.
    """
    height, width = job["shape"]
    profile = {"driver": "GTiff", "dtype": "float32", "count": 1, "height": height, "width": width, "nodata": -9999.0}
    layout = {"tiled": True, "blockxsize": 256, "blockysize": STRIP_ROWS, "compress": "deflate", "predictor": 3}
    with (
        os.fdopen(job["rows"], "rb") as rows,
        rasterio.open(
            job["target"],
            "w",
            **profile,
            **layout,
            BIGTIFF="IF_SAFER",
            crs=rasterio.CRS.from_wkt(job["crs_wkt"]),
            transform=Affine(*job["transform"]),
        ) as target,
    ):
        target.update_tags(**({DATUM_TAG: job["vertical_datum"]} if job["vertical_datum"] else {}))
        ask({})
        part, last = np.empty((0, width), np.float32), Window(0, 0, width, 0)  # pyright: ignore[reportCallIssue]
        for row in range(0, height, STRIP_ROWS):
            part = _next_rows(rows, min(STRIP_ROWS, height - row), width)
            part[np.isnan(part)] = -9999.0
            last = Window(0, row, width, len(part))  # pyright: ignore[reportCallIssue]
            target.write(part, 1, window=last)
        if rows.read(1):
            raise OSError("there are more rows than it has")
    _check_read_back(job["target"], last, part)
    send("done")


def _check_read_back(path: str, window: Window, heights: F32) -> None:
    try:
        with rasterio.open(path) as written:
            found = written.read(1, window=window)
    except rasterio.RasterioIOError as error:
        raise OSError("it was cut short") from error
    if not np.array_equal(found, heights):
        raise OSError("it was cut short")


def _next_rows(source: BinaryIO, count: int, width: int) -> F32:
    part = np.empty((count, width), np.float32)
    if source.readinto(part.reshape(-1).view(np.uint8).data) != part.nbytes:  # type: ignore[attr-defined]
        raise OSError("its rows end too early")
    return part


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


def _sample(grid: Grid) -> HeightStats:
    """Of blocks spread evenly over what was written of the raster; of more where these are unknown."""
    found, pixels = HeightStats(), 0
    for count, window in enumerate(grid.blocks(), start=1):
        found.add(grid.heights(window))
        pixels += window.width * window.height
        times = 1 if found.known or found.sentinels else _SEARCH
        if count >= _SAMPLE_BLOCKS * times or pixels >= _PART_PX * times:
            break
    return found


def _place(target: BinaryIO, part: F32, row: int, column: int, width: int) -> None:
    """Write a part where it belongs in a file of rows of ``width`` float32."""
    lines = part.reshape(1, -1) if part.shape[1] == width else part
    for line, heights in enumerate(lines):
        target.seek(4 * ((row + line) * width + column))
        target.write(np.ascontiguousarray(heights).data)
