"""Open rasters in the child process: one file, or the tiles of a mosaic, by the same few questions."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import islice
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import rasterio
from rasterio.enums import Interleaving
from rasterio.windows import Window

from mapping.geometry.arrays import F32
from planning.errors import RasterFormatError
from planning.terrain.rasters.byte_pipe import Asking, PipeFile
from planning.terrain.rasters.header import DATUM_TAG, RasterHeader
from planning.terrain.rasters.mosaic import Claim, Mosaic, more_than_a_list, mosaic_of

Json = dict[str, Any]

Share = Callable[[float], None]
_DIGEST_BYTES = 2**22
_TOLD_BYTES = 2**26
_OPEN_TILES = 64
"""Kept open at once: a window mostly needs few of them."""
_GOLDEN = 0.6180339887498949
"""Its multiples, their whole parts cut off, lie evenly between 0 and 1."""
_TRIES = 20_000


class Grid(Protocol):
    """A raster of heights, of one file or of many."""

    header: RasterHeader
    block: tuple[int, int]
    """Rows and columns that are decoded together."""

    def heights(self, window: Window) -> F32:
        """(rows, columns) stored numbers, NaN where unknown."""
        ...

    def blocks(self) -> Iterator[Window]:
        """Blocks that were written, spread evenly over the raster."""
        ...

    def digest(self, progress: Share) -> str:
        """SHA-256 of the content."""
        ...

    def layout(self) -> Json | None:
        """What spares the next look that of every tile: a job's "layout"; None: it is one file."""
        ...


@contextmanager
def opened_grid(job: Json) -> Iterator[Grid]:
    """The raster of a job: its "source", its "tiles", or what is asked for through its "pipe"."""
    if "pipe" in job:
        asking = Asking(*job["pipe"])
        with rasterio.open(
            "model.tif", driver=job["driver"], opener=lambda path, mode="rb": PipeFile(asking, job["size_bytes"])
        ) as source:
            grid = FileGrid(source, None)
            asking.check()
            yield grid
        asking.check()
    elif "tiles" in job:
        with rasterio.Env(), ExitStack() as stack:  # one for all: each tile would make its own
            yield TileGrid(job["tiles"], stack, job.get("layout"))
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

    def blocks(self) -> Iterator[Window]:
        """Of a sparse file blocks that it does not hold are unknown."""
        yield from written_blocks(self._source)

    def digest(self, progress: Share) -> str:
        return "" if self._path is None else digests_of([self._path], progress)[0]

    def layout(self) -> Json | None:
        return None


class TileGrid:
    """Tiles of one grid; where several know a cell, the highest counts: which of them is right nobody said."""

    def __init__(self, tiles: Sequence[Json], stack: ExitStack, layout: Json | None = None) -> None:
        self._tiles = tiles
        self._open: OrderedDict[int, Any] = OrderedDict()
        stack.callback(self._close, 0)
        if layout is None:
            self._mosaic, self.block = _looked_through(tiles)
        else:
            self._mosaic, self.block = Mosaic.from_json(layout), tuple(layout["block"])
        self.header, self._spots = self._mosaic.header, self._mosaic.spots
        self._edges = np.array([(s.row0, s.column0, s.row0 + s.rows, s.column0 + s.columns) for s in self._spots])

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
            found = known_heights(self._source(number), inside, unknown=self._mosaic.unknown.get(number, ()))
            np.fmax(part, found, out=part)
        return out

    def blocks(self) -> Iterator[Window]:
        """One of each tile in turn: between tiles, and in most of one, may be nothing."""
        for turn in range(_TRIES):
            more = False
            for number in _spread(len(self._tiles)):
                block = next(islice(written_blocks(self._source(number)), turn, None), None)
                if block is not None:
                    more = True
                    row, column = self._spots[number].row0 + block.row_off, self._spots[number].column0 + block.col_off
                    yield Window(column, row, block.width, block.height)  # pyright: ignore[reportCallIssue]
            if not more:
                return

    def digest(self, progress: Share) -> str:
        """Of the tiles' own: neither their names nor their order change the ground; what is unknown in them does."""
        own = digests_of([Path(tile["source"]) for tile in self._tiles], progress)
        for number, unknown in self._mosaic.unknown.items():
            own[number] += f" without {unknown}"
        return hashlib.sha256("\n".join(sorted(own)).encode()).hexdigest()

    def layout(self) -> Json | None:
        return {**self._mosaic.as_json(), "block": self.block}

    def _touched(self, window: Window) -> list[int]:
        """Numbers of the tiles that reach into a window."""
        top, left, bottom, right = self._edges.T
        rows = (top < window.row_off + window.height) & (bottom > window.row_off)
        return np.flatnonzero(rows & (left < window.col_off + window.width) & (right > window.col_off)).tolist()

    def _source(self, number: int) -> Any:
        if number not in self._open:
            self._close(_OPEN_TILES - 1)
            tile = self._tiles[number]
            source = rasterio.open(tile["source"], driver=tile["driver"])
            self._open[number] = source
            if not self._mosaic.is_tile(number, header_of(source)):
                raise RasterFormatError(
                    f"The tile {tile['name']} was changed while it was read.", where=tile["name"], advice="Start again."
                )
        self._open.move_to_end(number)
        return self._open[number]

    def _close(self, most: int) -> None:
        while len(self._open) > most:
            self._open.popitem(last=False)[1].close()


def _looked_through(tiles: Sequence[Json]) -> tuple[Mosaic, tuple[int, int]]:
    """The mosaic by every tile's header, and the first one's block."""
    headers: list[tuple[str, RasterHeader]] = []
    unknown: dict[int, tuple[float, ...]] = {}
    block = (1, 1)
    for number, tile in enumerate(tiles):
        with rasterio.open(tile["source"], driver=tile["driver"]) as source:
            header = header_of(source)
            headers.append((tile["name"], header))
            block = block if number else source.block_shapes[0]
            if "claim" in tile:
                claim = Claim.from_json(tile["claim"])
                if (fault := claim.difference(header)) is not None:
                    raise more_than_a_list(tile["name"], f"of {tile['name']} it {fault}")
                if others := tuple(value for value in claim.nodata if value != source.nodata):
                    unknown[number] = others
    return mosaic_of(headers, unknown), block


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


def _spread(count: int) -> Iterator[int]:
    """Numbers below ``count``, each once, such that any first few lie evenly; of very many some."""
    seen: set[int] = set()
    for k in range(min(_TRIES, 3 * count)):
        number = int(k * _GOLDEN % 1.0 * count)
        if number not in seen:
            seen.add(number)
            yield number


def written_blocks(source: Any) -> Iterator[Window]:
    """Blocks of an open dataset that it holds, spread evenly; of very many some."""
    height, width = source.block_shapes[0]
    across = -(-source.width // width)
    count = -(-source.height // height) * across
    for number in _spread(count):
        row, column = divmod(number, across)
        # Without a number for unknown, what is not held reads as 0, and is known.
        if (
            source.driver != "GTiff"
            or source.nodata is None
            or source.get_tag_item(f"BLOCK_OFFSET_{column}_{row}", "TIFF", bidx=1) is not None
        ):
            top, left = row * height, column * width
            yield Window(left, top, min(width, source.width - left), min(height, source.height - top))  # pyright: ignore[reportCallIssue]


def known_heights(source: Any, window: Window, *, unknown: Iterable[float] = ()) -> F32:
    """Band 1 of an open dataset, NaN where the file says unknown, and where its number is one of ``unknown``."""
    block = source.read(1, window=window, masked=True)
    with np.errstate(over="ignore", invalid="ignore"):
        heights = block.data.astype(np.float32)
        heights[np.ma.getmaskarray(block)] = np.nan
        for value in np.array(list(unknown), dtype=np.float32):
            # As GDAL compares them: texts of numbers may be rounded.
            heights[np.abs(heights - value) <= 2 * np.spacing(np.abs(value))] = np.nan
    if source.count == 2:  # GDAL masks by an alpha band only where it is of whole numbers
        heights[source.read(2, window=window) == 0] = np.nan
    return heights


def digests_of(paths: Sequence[Path], progress: Share) -> list[str]:
    """SHA-256 of each file; ``progress`` hears of the share that is read."""
    whole, done, told = sum(path.stat().st_size for path in paths), 0, 0
    found: list[str] = []
    for path in paths:
        digest = hashlib.sha256()
        with path.open("rb") as file:
            while part := file.read(_DIGEST_BYTES):
                digest.update(part)
                done += len(part)
                if done - told >= _TOLD_BYTES:
                    told = done
                    progress(min(1.0, done / max(1, whole)))
        found.append(digest.hexdigest())
    return found
