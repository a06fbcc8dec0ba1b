"""The surface models of a catalogue: opened, judged and put in order, the best first."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

from pyproj import CRS

from planning.errors import MissingCrsError, ParameterError, RasterError
from planning.terrain import BOUND_RMS
from planning.terrain.catalogue.listed_models import LeftOut, Listed, Listing
from planning.terrain.projects import is_terrain
from planning.terrain.rasters.dsm_file import DsmFile
from planning.terrain.rasters.georef import metres_in
from planning.terrain.rasters.reading import Declared, Progress
from planning.terrain.vertical_datum import datums_differ, is_amsl, is_same_ellipsoid

GOOD_RMS_M = 0.5
"""Of models at least so exact the newest is the best; of others the most exact."""
_CLOCKS_OFF = timedelta(days=1)


@dataclass(frozen=True, slots=True)
class CatalogueModel:
    """One surface model of a catalogue."""

    file: DsmFile
    name: str
    taken_utc: datetime | None
    resolution_m: float
    """Of its cells, or of what was measured where that is coarser."""
    rms_m: float
    """Vertical. Where nobody told it: one cell, or the largest that is told of another model."""
    rms_told: bool
    horizontal_m: float
    """Bound of the horizontal error; where nobody told it one cell."""
    place_m: float = 0.0
    """How far things may stand beside the cells that show them: the bound that was told, else what was measured at
    once where that is coarser than its cells."""
    vertical_datum: str | None = None
    """The file's, else its item's, else the one that was declared for those that say none."""

    @property
    def bound_m(self) -> float:
        """Of the vertical error."""
        return BOUND_RMS * self.rms_m

    @property
    def words(self) -> str:
        """E.g. "flight-7: 2026-05-01, 0.1 m, ±0.2 m"."""
        date = "date unknown" if self.taken_utc is None else f"{self.taken_utc:%Y-%m-%d}"
        error = f"±{self.bound_m:.2g} m" if self.rms_told else f"error unknown, taken as ±{self.bound_m:.2g} m"
        place = f", ±{self.place_m:.2g} m in place" if self.place_m > 0.0 else ""
        return f"{self.name}: {date}, {self.resolution_m:.3g} m, {error}{place}"

    @property
    def order(self) -> tuple[float, ...]:
        """Smaller is better."""
        age = 0.0 if self.taken_utc is None else -self.taken_utc.timestamp()
        dated = (float(self.taken_utc is None), age)
        if self.rms_m <= GOOD_RMS_M:
            return (0.0, *dated, self.rms_m, self.resolution_m)
        return (1.0, self.rms_m, *dated, self.resolution_m)


@dataclass(frozen=True, slots=True)
class Opened:
    """What of a listing can be used together, the best first."""

    models: tuple[CatalogueModel, ...]
    left_out: tuple[LeftOut, ...]
    notes: tuple[str, ...]


def open_models(listing: Listing, declared: Declared, progress: Progress | None) -> Opened:
    """Opens each for its header and its SHA-256. RasterError where none can be used.

    A reference system and a datum that are declared are those of models that say none: others keep their own.
    ParameterError for a height scale, which would change all of them.
    """
    if declared.z_scale is not None:
        raise ParameterError(
            "A height scale is not given for several models at once.",
            where="--z-scale",
            advice="Write it into the file it is meant for: gdal_edit.py -scale 0.01 FILE",
        )
    left_out, notes = list(listing.left_out), list[str]()
    found: list[CatalogueModel] = []
    for listed in listing.models:
        try:
            found.append(_opened(listed, declared, progress, notes))
        except RasterError as error:
            left_out.append(LeftOut(listed.path.name, " ".join(part for part in (error.what, error.advice) if part)))
    ranked = sorted(_with_errors(found), key=lambda model: (model.order, model.name, model.file.sha256))
    fitting = _fitting(ranked, declared.vertical_datum, left_out)
    if not fitting:
        first = next(iter(left_out), None)
        why = "" if first is None else f" {first.name}: {first.why}"
        raise RasterError(f"The catalogue has no surface model that can be used.{why}", advice="Look at each of them.")
    return Opened(tuple(fitting), tuple(left_out), tuple(notes))


def _opened(listed: Listed, declared: Declared, progress: Progress | None, notes: list[str]) -> CatalogueModel:
    told, path = listed.told, listed.path
    if is_terrain(listed.within) or is_terrain(told.name):
        raise RasterError(
            "It is a terrain model (DTM) by its name: trees and buildings are missing in it.",
            where=path.name,
            advice="Use the surface model (DSM).",
        )
    file = _file(path, replace(declared, vertical_datum=None, virtual=False), progress)
    if datums_differ(told.vertical_datum, file.vertical_datum):
        raise RasterError(
            f"Its item says the vertical datum {told.vertical_datum}, the file {file.vertical_datum}.",
            where=path.name,
            advice="Correct the one that is wrong.",
        )
    unit_m = _unit_m(told.vertical_datum)
    if unit_m is not None and abs(unit_m - file.height_unit_m) > 1e-9:
        raise RasterError(
            f"Its item says heights in {told.vertical_datum}, the file's own unit is {file.height_unit_m:g} m.",
            where=path.name,
            advice="Write the unit into the file (gdal_edit.py -units), or correct the item.",
        )
    datum = file.vertical_datum or told.vertical_datum or declared.vertical_datum
    name = told.name or path.stem
    notes += [f"{name}: {note}" for note in file.warnings]
    file.forget()
    taken_utc = told.taken_utc
    if taken_utc is not None and taken_utc > datetime.now(UTC) + _CLOCKS_OFF:
        notes.append(f"{name}: its date, {taken_utc:%Y-%m-%d}, lies in the future and counts as unknown.")
        taken_utc = None
    resolution_m = max(file.resolution_m, told.gsd_m or 0.0)
    horizontal_m = BOUND_RMS * told.horizontal_rms_m if told.horizontal_rms_m else resolution_m
    place_m = horizontal_m if told.horizontal_rms_m or resolution_m > file.resolution_m else 0.0
    rms_m = told.vertical_rms_m or resolution_m
    is_told = bool(told.vertical_rms_m)
    return CatalogueModel(file, name, taken_utc, resolution_m, rms_m, is_told, horizontal_m, place_m, datum)


def _unit_m(datum: str | None) -> float | None:
    """Metres in the unit that a datum's name ends with, e.g. "NAVD88 height (ftUS)"; None: it names none."""
    found = re.search(r"\(([^()]*)\)\s*$", datum or "")
    return None if found is None else metres_in(found[1])


def _file(path: Path, declared: Declared, progress: Progress | None) -> DsmFile:
    try:
        return DsmFile(path, replace(declared, crs=None), progress)
    except MissingCrsError:
        if declared.crs is None:
            raise
        return DsmFile(path, declared, progress)


def _with_errors(models: Sequence[CatalogueModel]) -> list[CatalogueModel]:
    """What nobody told is no better than the worst that was told."""
    worst_m = max((model.rms_m for model in models if model.rms_told), default=0.0)
    return [model if model.rms_told else replace(model, rms_m=max(model.rms_m, worst_m)) for model in models]


def _fitting(ranked: Sequence[CatalogueModel], declared: str | None, left_out: list[LeftOut]) -> list[CatalogueModel]:
    """The best, and those in its reference system and vertical datum."""
    fitting = list(ranked[:1])
    for model in ranked[1:]:
        why = _misfit(ranked[0], model, declared)
        if why:
            left_out.append(LeftOut(model.name, why))
        else:
            fitting.append(model)
    return fitting


def _misfit(best: CatalogueModel, other: CatalogueModel, declared: str | None) -> str:
    """Why a model cannot be used beside the best one; empty: it can. Two datums that nobody tells may differ."""
    if not best.file.crs.equals(other.file.crs, ignore_axis_order=True):
        return (
            f"It is in {other.file.crs.name}, {best.name} in {best.file.crs.name}. "
            "Bring it there, heights never lowered: gdalwarp -r max -t_srs CRS."
        )
    one, two = best.vertical_datum, other.vertical_datum
    if not _is_one_datum(*(_named(datum, best.file.crs) for datum in (one, two, declared))):
        return (
            f"Its vertical datum is {two or 'not told'}, that of {best.name} {one or 'not told'}: heights may lie tens "
            "of metres apart. Bring both to one datum, or declare it for all."
        )
    return ""


def _named(datum: str | None, crs: CRS) -> str | None:
    """An ellipsoid that is not named is that of the reference system."""
    is_bare = datum is not None and re.fullmatch(r"(above )?(the )?ellipsoid(al)?( heights?)?", datum.strip().lower())
    return f"{crs.ellipsoid.name} ellipsoid".replace("GRS 1980", "GRS 80") if is_bare and crs.ellipsoid else datum


def _is_one_datum(one: str | None, other: str | None, declared: str | None) -> bool:
    """Whether two models mean the same: not so "local" or "unknown", unless who asks says that they do."""
    if one is None or other is None:
        return False
    if "ellipsoid" in f"{one} {other}".lower():
        return is_same_ellipsoid(one, other) or (declared is not None and one == other == declared)
    says_so = declared is not None and not datums_differ(one, declared) and not datums_differ(other, declared)
    return not datums_differ(one, other) and (says_so or (is_amsl(one) and is_amsl(other)))
