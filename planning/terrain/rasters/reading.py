"""Asks a child process for a raster's header, a sample of it, or some of its numbers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np

from mapping.geometry.arrays import F32
from planning.errors import RasterError, RasterFormatError, RasterTooLargeError
from planning.terrain.rasters import sandbox
from planning.terrain.rasters.byte_pipe import served
from planning.terrain.rasters.header import RasterHeader, RasterLimits, check_pixels
from planning.terrain.rasters.heights import HeightStats
from planning.terrain.rasters.http_ranges import REQUEST_S, Look, RemoteFile, check_is_tiff
from planning.terrain.rasters.magic import driver_of
from planning.terrain.rasters.memory_at_hand import (
    BYTES_PER_PX,
    BYTES_PER_SQUARE,
    check_memory,
    watched,
)
from planning.terrain.rasters.surface_plan import SurfacePlan, plan_surface
from planning.terrain.rasters.tiles import tiles_of
from planning.terrain.rasters.virtual import check_crs

_TILE_HEADER_S = 0.02
"""2 ms were measured."""
_REMOTE_HEADER_S = 3 * REQUEST_S
_DIGEST_BYTES_S = 20e6
"""Of a slow disk."""
_SLOW_NETWORK = "Check server and network, or download the file and give that."
Progress = Callable[[str, float], None]
"""Called with a stage ("digest", "decode", "resample", "spikes") and the share of it that is done."""


@dataclass(frozen=True, slots=True)
class Pixels:
    """A block of a raster's pixels."""

    row0: int
    column0: int
    rows: int
    columns: int

    def holds(self, other: Pixels) -> bool:
        """Whether all of the other block is in it."""
        return (
            self.row0 <= other.row0
            and self.column0 <= other.column0
            and other.row0 + other.rows <= self.row0 + self.rows
            and other.column0 + other.columns <= self.column0 + self.columns
        )


@dataclass(frozen=True, slots=True)
class Declared:
    """What is known of a surface model's file beside what it says itself, and what it may ask for."""

    crs: str | None
    z_scale: float | None
    vertical_datum: str | None
    limits: RasterLimits
    virtual: bool = False
    """Whether it may be a virtual raster, whose tiles are read then: not where somebody else sent it."""


@dataclass(frozen=True, slots=True)
class Read:
    """What came of one look into a file."""

    plan: SurfacePlan
    sha256: str
    """Empty when it was not asked for."""
    stored: F32 | None
    """(rows, columns) of the pixels that were asked for, NaN where the file says unknown."""
    stats: HeightStats
    """Of these pixels."""
    sample: HeightStats
    """Of blocks all over the file, where asked for."""
    identity: tuple[int | str, ...]
    """Of the file, or of its tiles, before and after this look (``files_identity``)."""
    layout: dict[str, Any] | None
    """Of a mosaic, after the first look: spares the next one that of every tile."""


def read_surface(
    source: Path | RemoteFile,
    declared: Declared,
    wanted: Callable[[RasterHeader], Pixels | None],
    *,
    first: Read | None,
    progress: Progress | None = None,
) -> Read:
    """The pixels that ``wanted`` asks for when it knows the header; the digest too where this is the ``first`` look.

    A first look that asks for no pixels takes a sample. Raises the RasterError that refuses the file, also one that
    is changed while it is read, or is another than at the first look.
    """
    identity = files_identity(source, virtual=declared.virtual)
    if first is not None and identity != first.identity:
        raise _changed(source)
    try:
        read = _read(source, declared, wanted, first=first, progress=progress)
    except RasterError as error:
        if _is_changed(source, identity, virtual=declared.virtual):
            raise _changed(source) from error
        raise
    if _is_changed(source, identity, virtual=declared.virtual):
        raise _changed(source)
    return replace(read, identity=identity)


def _read(
    source: Path | RemoteFile,
    declared: Declared,
    wanted: Callable[[RasterHeader], Pixels | None],
    *,
    first: Read | None,
    progress: Progress | None,
) -> Read:
    plans: list[SurfacePlan] = []
    asked: list[Pixels | None] = []

    def order(fields: dict[str, Any]) -> dict[str, Any]:
        header = RasterHeader.from_json(fields)
        check_crs(job.get("crs", ""), header.crs_wkt, where=source.name)
        plans.append(
            plan_surface(
                header,
                crs=declared.crs,
                z_scale=declared.z_scale,
                vertical_datum=declared.vertical_datum,
                limits=declared.limits,
                where=source.name,
            )
        )
        asked.append(wanted(header))
        box = asked[0]
        if box is not None:
            _check_read(plans[0], box, declared.limits, where=source.name)
        pixels = None if box is None else [box.row0, box.column0, box.rows, box.columns]
        return {"pixels": pixels, "digest": first is None, "sample": first is None and pixels is None}

    with (
        sandbox.private_directory() as directory,
        _grid_job(source, directory, virtual=declared.virtual, first=first) as (job, pipe),
    ):
        answer = sandbox.run_job(
            job,
            directory=directory,
            limits=_with_time_for(job, declared.limits, first_look=first is None),
            where=source.name,
            on_header=order,
            progress=watched(progress, where=source.name),
            pipe=pipe,
            **({"smaller": _SLOW_NETWORK} if isinstance(source, RemoteFile) else {}),
        )
        stored, box = None, asked[0]
        if box is not None:
            # The file's name is gone with the directory; its pages live on while they are mapped.
            stored = np.asarray(np.memmap(job["target"], dtype=np.float32, mode="r+", shape=(box.rows, box.columns)))
    stats, sample = (HeightStats.from_json(answer[name]) for name in ("stats", "sample"))
    sha256 = source.sha256 if isinstance(source, RemoteFile) else answer["sha256"]
    return Read(plans[0], sha256, stored, stats, sample, (), answer["layout"])


def all_of(header: RasterHeader) -> Pixels:
    """Every pixel."""
    return Pixels(0, 0, header.height_px, header.width_px)


def _check_read(plan: SurfacePlan, box: Pixels, limits: RasterLimits, *, where: str) -> None:
    """RasterTooLargeError when these pixels, or the squares that they become, are too many to be read at once."""
    check_pixels(box.rows, box.columns, limits.max_px, where=where)
    cells = box.rows * box.columns
    squares = _squares_of(plan, cells)
    if squares > limits.max_px:
        raise RasterTooLargeError(
            f"Brought to north-up squares it has {squares:,} cells, more than {limits.max_px:,}.",
            where=where,
            advice="Crop it to the area of the flight, or export it north up with square pixels.",
        )
    need_bytes = BYTES_PER_PX * cells if plan.placing is None else BYTES_PER_SQUARE * (cells + squares)
    check_memory(need_bytes, shape=(box.rows, box.columns), where=where)


def _squares_of(plan: SurfacePlan, cells: int) -> int:
    """About how many squares of the grid so many of the file's cells become."""
    whole = plan.header.height_px * plan.header.width_px
    rows, columns = plan.grid[1] if plan.grid else (plan.header.height_px, plan.header.width_px)
    return rows * columns * cells // whole


def _with_time_for(job: dict[str, Any], limits: RasterLimits, *, first_look: bool) -> RasterLimits:
    """Of a mosaic each tile's header is read first, at a first look all bytes; a network has its own time."""
    if "pipe" in job:
        return replace(limits, header_s=max(limits.header_s, _REMOTE_HEADER_S))
    tiles: list[dict[str, Any]] = job.get("tiles", [])
    size_bytes = sum(os.stat(file["source"]).st_size for file in tiles or [job]) if first_look else 0
    return replace(
        limits,
        header_s=limits.header_s + _TILE_HEADER_S * len(tiles),
        decode_s=limits.decode_s + size_bytes / _DIGEST_BYTES_S,
    )


@contextmanager
def _grid_job(
    source: Path | RemoteFile, directory: Path, *, virtual: bool, first: Read | None
) -> Iterator[tuple[dict[str, Any], Sequence[int]]]:
    """The job, and the child's ends of the pipe through which it reads a file that is not here."""
    if isinstance(source, Path):
        job = raster_job("read_grid", source, directory, virtual=virtual)
        yield job if first is None or first.layout is None else {**job, "layout": first.layout}, ()
        return
    look = Look(source)
    try:
        check_is_tiff(source)
        with served(look.read, look.stop) as end:
            job = {"job": "read_grid", "driver": "GTiff", "pipe": end.child, "size_bytes": source.size_bytes}
            try:
                yield {**job, "target": str(directory / token_hex(8))}, end.child
            except RasterError as error:
                # What the child says of bytes that it did not get is no news.
                raise end.error or error from error
            if end.error is not None:
                raise end.error
    finally:
        source.close()


def raster_job(name: str, source: Path, directory: Path, *, virtual: bool = False) -> dict[str, Any]:
    """What the child process is told: the file, or the tiles, by names of our own, and where its answer goes."""
    job = {"job": name, "target": str(directory / token_hex(8))}
    tiles = tiles_of(source, virtual=virtual)
    if tiles is None:
        return {**job, **_linked(source, directory)}
    linked: list[dict[str, Any]] = [{"name": tile.name, **_linked(tile, directory)} for tile in tiles.paths]
    for tile, claim in zip(linked, tiles.claims or (), strict=bool(tiles.claims)):
        tile["claim"] = claim.as_json()
    return {**job, "tiles": linked, "crs": tiles.crs}


def _linked(source: Path, directory: Path) -> dict[str, str]:
    driver = driver_of(source)
    link = directory / token_hex(8)
    link.symlink_to(source.resolve())
    return {"driver": driver, "source": str(link)}


def files_identity(source: Path | RemoteFile, *, virtual: bool) -> tuple[int | str, ...]:
    """Changes when the file, any tile or the list of them is written, replaced, added or removed.

    A file on a server notices it itself.
    """
    if isinstance(source, RemoteFile):
        return (source.sha256,)
    tiles = tiles_of(source, virtual=virtual)
    if tiles is None:
        return _file_identity(source)
    listed = () if source.is_dir() else _file_identity(source)
    return (*listed, *(mark for tile in tiles.paths for mark in (str(tile), *_file_identity(tile))))


def _is_changed(source: Path | RemoteFile, identity: tuple[int | str, ...], *, virtual: bool) -> bool:
    try:
        return files_identity(source, virtual=virtual) != identity
    except RasterError:
        return True  # it is gone


def _changed(source: Path | RemoteFile) -> RasterError:
    return RasterError("It was changed while it was read.", where=source.name, advice="Start again.")


def _file_identity(source: Path) -> tuple[int, int, int]:
    try:
        found = os.stat(source)
    except FileNotFoundError as error:
        raise RasterFormatError("There is no such file.", where=str(source), advice="Check the path.") from error
    except OSError as error:
        raise RasterError(f"It cannot be read: {error.strerror}.", where=source.name) from error
    return found.st_ino, found.st_size, found.st_mtime_ns
