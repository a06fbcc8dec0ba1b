"""Open rasters in the child process: one file, or the tiles of a mosaic, by the same few questions."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import rasterio
from rasterio.enums import Interleaving
from rasterio.windows import Window

from mapping.geometry.arrays import F32
from planning.terrain.rasters.byte_pipe import Asking, PipeFile
from planning.terrain.rasters.header import RasterHeader
from planning.terrain.rasters.mosaic import mosaic_of

Json = dict[str, Any]

DATUM_TAG = "HEDGEHOP_VERTICAL_DATUM"
_DIGEST_BYTES = 2**22
_OPEN_TILES = 64
"""Kept open at once: a window mostly needs few of them."""


class Grid(Protocol):
    """A raster of heights, of one file or of many."""

    header: RasterHeader
    block: tuple[int, int]
    """Rows and columns that are decoded together."""

    def heights(self, window: Window) -> F32:
        """(rows, columns) stored numbers, NaN where unknown."""
        ...

    def holds(self, window: Window) -> bool:
        """Whether anything was written of this block."""
        ...

    def digest(self) -> str:
        """SHA-256 of the content."""
        ...


@contextmanager
def opened_grid(job: Json) -> Iterator[Grid]:
    """The raster of a job: its "source", its "tiles", or what is asked for through its "pipe"."""
    if "pipe" in job:
        asking = Asking(*job["pipe"])
        with rasterio.open(
            "model.tif", driver=job["driver"], opener=lambda path, mode="rb": PipeFile(asking, job["size_bytes"])
        ) as source:
            yield FileGrid(source, None)
    elif "tiles" in job:
        with rasterio.Env(), ExitStack() as stack:  # one for all: each tile would make its own
            yield TileGrid(job["tiles"], stack)
    else:
        with rasterio.open(job["source"], driver=job["driver"]) as source:
            yield FileGrid(source, Path(job["source"]))


class FileGrid:
    """One file; without a path, one that is not here as a whole."""

    def __init__(self, source: Any, path: Path | None) -> None:
        self._source, self._path = source, path
        self.header, self.block = header_of(source), source.block_shapes[0]

    def heights(self, window: Window) -> F32:
        return known_heights(self._source, window)

    def holds(self, window: Window) -> bool:
        """Of a sparse file blocks that it does not hold are unknown."""
        if self._source.driver != "GTiff":
            return True
        down, across = window.row_off // self.block[0], window.col_off // self.block[1]
        return self._source.get_tag_item(f"BLOCK_OFFSET_{across}_{down}", "TIFF", bidx=1) is not None

    def digest(self) -> str:
        return "" if self._path is None else digest_of(self._path)


class TileGrid:
    """Tiles of one grid; where several know a cell, the highest counts: which of them is right nobody said."""

    def __init__(self, tiles: Sequence[Json], stack: ExitStack) -> None:
        self._tiles = tiles
        self._open: OrderedDict[int, Any] = OrderedDict()
        stack.callback(self._close, 0)
        headers: list[tuple[str, RasterHeader]] = []
        for tile in tiles:
            with rasterio.open(tile["source"], driver=tile["driver"]) as source:
                headers.append((tile["name"], header_of(source)))
                if not headers[:-1]:
                    self.block = source.block_shapes[0]
        mosaic = mosaic_of(headers)
        self.header, self._spots = mosaic.header, mosaic.spots
        self._edges = np.array([(s.row0, s.column0, s.row0 + s.rows, s.column0 + s.columns) for s in mosaic.spots])

    def heights(self, window: Window) -> F32:
        row0, column0, rows, columns = window.row_off, window.col_off, window.height, window.width
        out = np.full((rows, columns), np.nan, dtype=np.float32)
        for number in self._touched(window):
            spot = self._spots[number]
            if (shared := spot.shared(row0, column0, rows, columns)) is None:
                continue
            (top, bottom), (left, right) = ((part.start, part.stop) for part in shared)
            inside = Window(left - spot.column0, top - spot.row0, right - left, bottom - top)  # pyright: ignore[reportCallIssue]
            part = out[top - row0 : bottom - row0, left - column0 : right - column0]
            np.fmax(part, known_heights(self._source(number), inside), out=part)
        return out

    def holds(self, window: Window) -> bool:
        return bool(self._touched(window))

    def digest(self) -> str:
        """Of the tiles' own: neither their names nor their order change the ground."""
        own = sorted(digest_of(Path(tile["source"])) for tile in self._tiles)
        return hashlib.sha256("\n".join(own).encode()).hexdigest()

    def _touched(self, window: Window) -> list[int]:
        """Numbers of the tiles that reach into a window."""
        top, left, bottom, right = self._edges.T
        rows = (top < window.row_off + window.height) & (bottom > window.row_off)
        return np.flatnonzero(rows & (left < window.col_off + window.width) & (right > window.col_off)).tolist()

    def _source(self, number: int) -> Any:
        if number not in self._open:
            self._close(_OPEN_TILES - 1)
            tile = self._tiles[number]
            self._open[number] = rasterio.open(tile["source"], driver=tile["driver"])
        self._open.move_to_end(number)
        return self._open[number]

    def _close(self, most: int) -> None:
        while len(self._open) > most:
            self._open.popitem(last=False)[1].close()


def header_of(source: Any) -> RasterHeader:
    """The header of an open dataset."""
    block_height, block_width = source.block_shapes[0]
    shared = source.count if source.interleaving == Interleaving.pixel else 1
    return RasterHeader(
        driver=source.driver,
        width_px=source.width,
        height_px=source.height,
        dtypes=tuple(source.dtypes),
        colours=tuple(colour.name for colour in source.colorinterp),
        transform=tuple(source.transform)[:6],
        crs_wkt=source.crs.to_wkt() if source.crs else None,
        has_gcps=bool(source.gcps[0]),
        block_bytes=block_height * block_width * shared * np.dtype(source.dtypes[0]).itemsize,
        unit=source.units[0],
        scale=source.scales[0],
        offset=source.offsets[0],
        vertical_datum=source.tags().get(DATUM_TAG),
    )


def known_heights(source: Any, window: Window) -> F32:
    """Band 1 of an open dataset, NaN where the file says unknown."""
    block = source.read(1, window=window, masked=True)
    with np.errstate(over="ignore", invalid="ignore"):
        heights = block.data.astype(np.float32)
        heights[np.ma.getmaskarray(block)] = np.nan
    if source.count == 2:  # GDAL masks by an alpha band only where it is of whole numbers
        heights[source.read(2, window=window) == 0] = np.nan
    return heights


def digest_of(path: Path) -> str:
    """SHA-256 of a file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while part := file.read(_DIGEST_BYTES):
            digest.update(part)
    return digest.hexdigest()
