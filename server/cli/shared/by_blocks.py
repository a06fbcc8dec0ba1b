"""A grid worked out of a large surface model block by block, here or on Dask workers, and written as its rows come.

No process holds the model: each block is read from the file with as much around it as its work looks at, and no more
blocks are on their way than keep all workers busy. Not ``dask.array.map_overlap``: its arrays have blocks of one model
travel to the neighbours that look at their rims, and promise neither an order nor a bound on what waits to be written,
while here each worker has the file and reads the rims itself.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np

from mapping.geometry.arrays import F32
from planning.errors import NoElevationError, ParameterError, RasterFormatError
from planning.safe_surface.window import Box
from planning.terrain.dsm import SurfaceModel
from planning.terrain.grid_file import GridPlace, Put, rows_written
from planning.terrain.rasters.http_ranges import is_address
from server.cli.shared.files_in_out import check_directory
from server.cli.shared.options import ModelOptions
from server.cli.shared.terrain_given import OpenedModel, is_catalogue, open_model, same_model
from server.errors import StorageError
from server.work.clocks import StepTimer
from server.work.cluster import check_where, spread

MOST_ACROSS, MOST_DOWN, _LEAST_DOWN = 4096, 2048, 256
"""Cells of the model in a block."""
_WRITER_PX = 64_000_000
"""Of the rows that wait for their last block: a quarter of a gigabyte."""
_WITHIN_S = 30 * 24 * 3600.0


@dataclass(frozen=True, slots=True)
class Block:
    """What came of one."""

    values: F32
    """(rows, columns), NaN unknown"""
    known: int
    """Cells of the model's grid in it whose height is known; of a map's, where cells are taken together."""
    counts: tuple[int, ...] = ()
    """Whatever is counted, to be summed."""


class BlockWork(Protocol):
    """What is done to each block. It pickles, and gives the same bytes wherever the box is cut."""

    def block_of(self, model: SurfaceModel, box: Box) -> Block: ...


@dataclass(frozen=True, slots=True)
class BlockOrder:
    """What is worked out, of what, and where."""

    dsm: Path
    model: ModelOptions
    out: Path
    cluster: str | None
    most: tuple[int, int] = (MOST_DOWN, MOST_ACROSS)
    """Rows and columns of the model in a block."""

    def check(self) -> None:
        """Before anything is read. Raises ClusterError, ParameterError, RasterFormatError, StorageError."""
        if self.cluster is not None:
            check_where(self.cluster)
        _check_model(self.dsm, self.model)
        _check_new(self.out, self.dsm)

    def open(self, timer: StepTimer) -> OpenedModel:
        """What of a large model only its whole would tell is refused, not read."""
        opening = True

        def told(step: str, share: float | None) -> None:
            if opening:  # of each block that is read later nothing is told
                timer(step, share)

        opened = open_model(self.dsm, StepTimer(told), self.model, in_parts=True)
        opening = False
        return opened


@dataclass(frozen=True, slots=True)
class _Piece:
    """What a worker is told of one block."""

    dsm: Path
    model: ModelOptions
    sha256: str
    work: BlockWork
    box: Box


def write_by_blocks(
    order: BlockOrder,
    opened: OpenedModel,
    place: GridPlace,
    work: BlockWork,
    told: Callable[[float], None],
    *,
    together: int = 1,
) -> tuple[int, ...]:
    """Works out the grid at ``place``, of whose cells ``together`` ones of the model are one, and writes ``order.out``.

    The file is there when this returns, whole; before that, and when anything is raised, it is not. Returns the sums of
    the blocks' counts. Raises NoElevationError where nothing of the model is known, and what reading, working, writing
    and the cluster raise.
    """
    boxes = blocks_of(place.shape, order.most, together)
    order.out.parent.mkdir(parents=True, exist_ok=True)
    with (
        rows_written(order.out, place, within_s=_WITHIN_S, is_new=True) as put,
        closing(_worked(order, opened, work, boxes, told)) as blocks,
    ):
        totals = _put_in_rows(put, boxes, blocks, place.shape[1])
        if totals[0] == 0:
            raise NoElevationError(
                "Every cell is unknown.",
                where=order.dsm.name,
                advice="Check the export: it should hold the surface's heights.",
            )
    return totals[1:]


def blocks_of(shape: tuple[int, int], most: tuple[int, int], together: int = 1) -> list[Box]:
    """From north to south and in each row of blocks from west to east; fewer rows at once where they are long."""
    rows, columns = shape
    # A row of blocks waits until its last one has come.
    down = min(most[0], max(_LEAST_DOWN, _WRITER_PX // (columns * together)))
    down, across = max(1, down // together), max(1, most[1] // together)
    return [
        Box(row, column, min(rows, row + down), min(columns, column + across))
        for row in range(0, rows, down)
        for column in range(0, columns, across)
    ]


def _worked(
    order: BlockOrder, opened: OpenedModel, work: BlockWork, boxes: list[Box], told: Callable[[float], None]
) -> Generator[Block]:
    if order.cluster is None:
        yield from spread(partial(work.block_of, opened.model), boxes, None, told)
        return
    first = _Piece(order.dsm.absolute(), order.model, opened.model.sha256, work, boxes[0])
    yield from spread(_block, [replace(first, box=box) for box in boxes], order.cluster, told)


def _block(piece: _Piece) -> Block:
    """On a worker, which opens the model once."""
    opened = same_model(piece.dsm, piece.model, piece.sha256, in_parts=True)
    return piece.work.block_of(opened.model, piece.box)


def _put_in_rows(put: Put, boxes: list[Box], blocks: Iterator[Block], columns: int) -> tuple[int, ...]:
    """Hands rows of blocks over as soon as they are whole; returns what is known and the counts, summed."""
    totals: tuple[int, ...] = ()
    rows = np.empty((0, columns), np.float32)
    for box, block in zip(boxes, blocks, strict=True):
        if box.col0 == 0 and rows.shape[0] != box.shape[0]:
            rows = np.empty((box.shape[0], columns), np.float32)
        rows[:, box.col0 : box.col1] = block.values
        counted = (block.known, *block.counts)
        totals = tuple(map(sum, zip(totals, counted, strict=True))) if totals else counted
        if box.col1 == columns:
            put(rows)
    return totals


def _check_model(dsm: Path, options: ModelOptions) -> None:
    if is_address(dsm):
        raise ParameterError(
            "Every cell of the model is needed, which is not read from a server.",
            where=dsm.name,
            advice="Download the file and give that.",
        )
    if is_catalogue(dsm, options):
        raise ParameterError(
            "A catalogue of several models is not worked out in blocks.",
            where=str(dsm),
            advice="Give one model: a GeoTIFF, a folder of tiles or a VRT.",
        )
    if options.remove_spikes:
        raise ParameterError(
            "Spikes are looked for in a model as a whole, not in blocks.",
            where="--remove-spikes",
            advice="Leave it away, or take them out of the file before.",
        )


def _check_new(out: Path, dsm: Path) -> None:
    if out.suffix.lower() not in (".tif", ".tiff"):
        raise RasterFormatError("What is written is a GeoTIFF.", where=out.name, advice="Give --out a name with .tif.")
    check_directory(out.parent)
    if out.exists():
        raise StorageError("There is such a file already.", where=str(out), advice="Give another --out, or remove it.")
    if dsm.is_dir() and out.resolve().is_relative_to(dsm.resolve()):
        raise StorageError(
            "It would become a tile of the model that lies in this folder.",
            where=str(out),
            advice="Give another --out.",
        )
