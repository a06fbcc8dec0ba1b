"""A GeoTIFF of heights that is written from north to south as its rows come, and is there only when it is whole."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from secrets import token_hex
from typing import Any, BinaryIO

import numpy as np
from affine import Affine
from pyproj import CRS
from pyproj.crs import CompoundCRS
from pyproj.exceptions import CRSError

from mapping.geometry.arrays import F32
from planning.errors import RasterError
from planning.terrain.rasters import sandbox
from planning.terrain.rasters.header import STRIP_ROWS, RasterLimits

Put = Callable[[F32], None]
"""Takes the next rows, (any number of them, columns) float32, NaN unknown."""

_COPIES = 4
"""Of a strip of rows in the writing process."""


@dataclass(frozen=True, slots=True)
class GridPlace:
    """Where a grid of square cells lies, north up."""

    transform: Affine
    """Cell corner (column, row) -> projected (x east, y north) in metres."""
    crs: CRS
    vertical_datum: str | None
    shape: tuple[int, int]
    """Rows, columns."""


@contextmanager
def rows_written(
    path: str | os.PathLike[str], place: GridPlace, *, within_s: float | None = None, is_new: bool = False
) -> Iterator[Put]:
    """A tiled, compressed GeoTIFF whose rows are handed over one after another; no more of them is held than a strip.

    The same bytes however many rows are handed over at once. It lies under its name only when all rows were taken and
    nothing was raised. ``within_s``: after so long it is given up; None: after the time for reading one. ``is_new``:
    no other file that came to have its name meanwhile is replaced. Raises RasterError where it cannot be written,
    before the first row is asked for if that is so from the beginning.
    """
    target = Path(path)
    written = target.parent / f".{token_hex(8)}.tif"
    taken, handed = (os.fdopen(end, mode, buffering=0) for end, mode in zip(os.pipe(), ("rb", "wb"), strict=True))
    begun = threading.Event()

    def begin(header: dict[str, Any]) -> dict[str, Any]:
        """The child has its own handle now: with ours closed its end is noticed here."""
        del header
        taken.close()
        begun.set()
        return {}

    with taken, handed, sandbox.private_directory() as directory, ThreadPoolExecutor(1) as pool:
        job = _job(place, directory, written, taken.fileno())
        limits = _limits(place, within_s)
        writing = pool.submit(
            sandbox.run_job, job, directory=directory, limits=limits, where=target.name, on_header=begin,
            pipe=(taken.fileno(),),
        )  # fmt: skip
        writing.add_done_callback(lambda done: begin({}))
        try:
            begun.wait()
            if writing.done():
                writing.result()
            yield lambda rows: _hand_over(rows, place.shape[1], handed, writing)
            handed.close()
            writing.result()
            _put_in_place(written, target, is_new=is_new)
        finally:
            handed.close()  # of rows that end too early nothing is made
            wait([writing])
            written.unlink(missing_ok=True)


def _hand_over(rows: F32, columns: int, handed: BinaryIO, writing: Future[Any]) -> None:
    if rows.ndim != 2 or rows.shape[1] != columns:
        raise RasterError(f"Its rows have {columns} cells, not {rows.shape[-1]}.")
    left = memoryview(np.ascontiguousarray(rows, np.float32).reshape(-1).view(np.uint8).data)
    try:
        while left:
            left = left[handed.write(left) :]
    except BrokenPipeError as error:
        writing.result()  # raises why it takes no more
        raise RasterError("There are more rows than it has.") from error


def _put_in_place(written: Path, target: Path, *, is_new: bool) -> None:
    try:
        if not is_new:
            written.replace(target)
            return
        try:
            os.link(written, target)
        except FileExistsError:
            raise
        except OSError:  # not every file system has links
            if target.exists():
                raise FileExistsError from None
            written.replace(target)
    except FileExistsError as error:
        what = "A file of that name was made meanwhile, and is not replaced."
        raise RasterError(what, where=str(target), advice="Give another name.") from error
    except OSError as error:
        raise RasterError(f"It cannot be written: {error.strerror}.", where=str(target)) from error


def _job(place: GridPlace, directory: Path, written: Path, rows: int) -> dict[str, Any]:
    return {
        "job": "write_grid",
        "rows": rows,
        "target": str(written.absolute()),
        "writable": [str(directory), str(written.parent.absolute())],
        "shape": place.shape,
        "transform": tuple(place.transform)[:6],
        "crs_wkt": _compound(place.crs, place.vertical_datum).to_wkt(),
        "vertical_datum": place.vertical_datum,
    }


def _compound(crs: CRS, vertical_datum: str | None) -> CRS:
    """The horizontal system with the datum's own system on top, where PROJ knows one of that name."""
    if vertical_datum is None:
        return crs
    try:
        vertical = CRS.from_user_input(vertical_datum)
    except CRSError:
        return crs
    return CompoundCRS(f"{crs.name} + {vertical.name}", [crs, vertical]) if vertical.is_vertical else crs


def _limits(place: GridPlace, within_s: float | None) -> RasterLimits:
    default = RasterLimits()
    memory_bytes = default.max_memory_bytes + _COPIES * 4 * STRIP_ROWS * place.shape[1]
    # It is our own file: a busy machine may take its time to begin one.
    return replace(
        default, max_memory_bytes=memory_bytes, header_s=default.decode_s, decode_s=within_s or default.decode_s
    )
