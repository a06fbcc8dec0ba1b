"""A surface model that stays in its file: only the parts that are asked for are decoded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from mapping.geometry.arrays import F32, F64
from planning.errors import ParameterError, RasterFormatError
from planning.terrain.dsm import LARGE_PX, Dsm, SurfaceModel
from planning.terrain.projects import doubts_of_name
from planning.terrain.rasters.assemble import ReadReport, assemble
from planning.terrain.rasters.header import RasterHeader
from planning.terrain.rasters.heights import doubts, mask_and_scale
from planning.terrain.rasters.http_ranges import WEAK_WORDS, RemoteFile
from planning.terrain.rasters.part_of import model_grid, needed_pixels, part_of
from planning.terrain.rasters.reading import Declared, Pixels, Progress, Read, all_of, read_surface
from planning.terrain.rasters.tiles import doubts_of_names

AHEAD_PX = 256
"""Decoded around what is asked for: the next question is mostly about a little more."""


class DsmFile(SurfaceModel):
    """A surface model in its file; a small one is read at once, of a large one a part at a time, the last is kept.

    Its parts are the very ones of the model as a whole (``Dsm.window``). Never taken from overviews: their cells may
    be averages, which lie below an obstacle.
    """

    def __init__(self, source: Path | RemoteFile, declared: Declared, progress: Progress | None = None) -> None:
        self._source, self._declared, self._progress = source, declared, progress
        self.name, self.rms_m, self.place_m = source.name, None, 0.0
        self._kept: tuple[Pixels, np.ndarray] | None = None
        self._whole: Dsm | None = None
        self._first = read_surface(source, declared, _all_if_small, first=None, progress=progress)
        self._of_source = _said_of(source, virtual=declared.virtual)
        plan = self._first.plan
        self.transform, self._shape = model_grid(plan)
        self.crs, self.vertical_datum, self.sha256 = plan.crs, plan.reference.vertical_datum, self._first.sha256
        self.height_unit_m = plan.reference.metres_per_height_unit
        """Metres in the unit of the file's own numbers: those of the model are metres."""
        self.report: ReadReport | None = None
        """Of the whole; None while only parts were read."""
        if self._first.stored is not None:
            self._assemble(self._first)
        elif self._first.sample.known == 0 and self._can_be_whole:
            self.whole()

    @property
    def height_px(self) -> int:
        return self._shape[0]

    @property
    def width_px(self) -> int:
        return self._shape[1]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was assumed or looks wrong, in plain words; of a large file judged by a sample of it."""
        if self.report is not None:
            return (*self.report.warnings, *self._of_source)
        plan, sample = self._first.plan, self._first.sample
        notes = (*plan.notes, *self._of_source)
        if sample.known == 0:
            return (*notes, "Nothing but unknown cells was found in a sample of it.")
        return (*notes, *doubts(sample, dtype=plan.header.dtypes[0], scaled=plan.scaled))

    def whole(self) -> Dsm:
        if self._whole is None:
            self._assemble(self._look(all_of(self._first.plan.header)))
        assert self._whole is not None
        return self._whole

    def window(self, row0: int, col0: int, height_px: int, width_px: int) -> Dsm:
        rows = slice(max(0, row0), min(self.height_px, row0 + height_px))
        columns = slice(max(0, col0), min(self.width_px, col0 + width_px))
        if rows.start >= rows.stop or columns.start >= columns.stop:
            raise ParameterError("The window lies outside the surface model.")
        pixels = needed_pixels(self._first.plan, (rows, columns))
        part = self._kept  # another thread may keep another one meanwhile
        if self._whole is None and not (part is not None and part[0].holds(pixels)):
            part = self._read_around(pixels)
        if self._whole is not None:
            return self._whole.window(row0, col0, height_px, width_px)
        assert part is not None
        kept, stored = part
        return part_of(self._first.plan, stored, kept, (rows, columns), sha256=self.sha256, name=self.name)

    def forget(self) -> None:
        """Keeps no heights: what is asked for next is read from the file again."""
        self._kept = self._whole = None
        self._first = replace(self._first, stored=None)

    def elevation_at(self, xy_m: F64) -> F64:
        xy = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
        west, south, east, north = self.bounds_m
        inside = ((xy >= (west, south)) & (xy <= (east, north))).all(axis=1)
        out = np.full(len(xy), np.nan)
        if inside.any():
            out[inside] = self.around(xy[inside], self.resolution_m).elevation_at(xy[inside])
        return out

    def _read_around(self, pixels: Pixels) -> tuple[Pixels, F32] | None:
        """None: all was read, for the part does not tell what its numbers mean."""
        header, plan = self._first.plan.header, self._first.plan
        row0, column0 = max(0, pixels.row0 - AHEAD_PX), max(0, pixels.column0 - AHEAD_PX)
        rows = min(header.height_px, pixels.row0 + pixels.rows + AHEAD_PX) - row0
        columns = min(header.width_px, pixels.column0 + pixels.columns + AHEAD_PX) - column0
        wanted = Pixels(row0, column0, rows, columns)
        read = self._look(wanted)
        if read.stats.sentinels:
            self._check_sentinels(read)
            self.whole()
            return None
        assert read.stored is not None
        mask_and_scale(read.stored, sentinels=(), scale=plan.height_scale, offset=plan.height_offset)
        self._kept = part = wanted, read.stored
        return part

    @property
    def _can_be_whole(self) -> bool:
        return self.height_px * self.width_px <= self._declared.limits.max_px

    def _check_sentinels(self, read: Read) -> None:
        """Whether such a number is a height only the whole model tells."""
        if not self._can_be_whole:
            value = next(iter(read.stats.sentinels))
            raise RasterFormatError(
                f"{read.stats.sentinels[value]} cells of it are {value}, which may be a height or mean unknown; "
                f"the model is too large to be looked through.",
                where=self._source.name,
                advice=f"Declare what it means: gdal_edit.py -a_nodata {value} FILE",
            )

    def _look(self, wanted: Pixels) -> Read:
        return read_surface(
            self._source, self._declared, lambda header: wanted, first=self._first, progress=self._progress
        )

    def _assemble(self, read: Read) -> None:
        assert read.stored is not None
        self._whole, self.report = assemble(
            read.stored, read.plan, read.stats, sha256=self.sha256, where=self._source.name, progress=self._progress
        )
        self._kept = None


def _all_if_small(header: RasterHeader) -> Pixels | None:
    return all_of(header) if header.height_px * header.width_px < LARGE_PX else None


def _said_of(source: Path | RemoteFile, *, virtual: bool) -> tuple[str, ...]:
    if isinstance(source, Path):
        return doubts_of_names(source, virtual=virtual)
    notes = ("The model's SHA-256 is that of its address, size and version: it was not read as a whole.",)
    return (*notes, *([] if source.is_strong else [WEAK_WORDS]), *doubts_of_name(source.name))
