"""A cloud that came with a surface model: its points in the model's system and heights, or why they are not shown."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import ProjError

from mapping.geometry.arrays import F64, Bools
from planning.errors import RasterFormatError
from planning.terrain.clouds.compare import ABOVE_M, Compared, compared, tops_of
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.vertical_datum import datums_differ

_LEAST_SHARE = 0.6
"""Of the points over known cells: photogrammetry's clouds reach beyond their models, but not so far."""
_SAME_M = 0.01
_MOST_ABOVE_SHARE = 0.01
"""Of cells; a few wires and noise stand above every model that is made of a cloud."""
_MARGIN_M = 50.0
_HEIGHT_MARGIN_M = 500.0
"""Around the model, where points are kept; what lies farther off is an accident with a number."""
_MOST_OFFSET_BYTES = 1000


def offset_of(path: Path) -> F64:
    """(3,) what Pix4D's ``_offset.xyz`` says is to be added. Raises RasterFormatError."""
    words = path.read_bytes()[:_MOST_OFFSET_BYTES].decode("ascii", "replace").replace(",", " ").split()
    try:
        offset_m = np.array([float(word) for word in words])
    except ValueError:
        offset_m = np.empty(0)
    if offset_m.shape != (3,) or not all(map(math.isfinite, offset_m)):
        what = "The offset is no three numbers."
        raise RasterFormatError(what, where=path.name, advice="Export the project again.")
    return offset_m


@dataclass(frozen=True, slots=True)
class Placed:
    """What came of a cloud beside its model."""

    points: ThinnedCloud | None
    """In the model's system and heights; None: they do not fit, and the notes say why."""
    notes: tuple[str, ...]
    is_above: bool = False
    """Whether parts of the cloud stand above the model, which may then lack what stands there."""


def placed_on(
    dsm: Dsm, cloud: ThinnedCloud, tops: Dsm, *, has_crs: bool, name: str, offset_m: F64 | None = None
) -> Placed:
    """``tops``: the cloud's own model, in its system where it names one (``has_crs``), else in the surface model's."""
    notes: list[str] = []
    if datums_differ(tops.vertical_datum, dsm.vertical_datum):
        datums = f"{name} has heights in {tops.vertical_datum}, the surface model in {dsm.vertical_datum}"
        return Placed(None, (f"{datums}: its points are not shown. Export both in one vertical datum.",))
    xyz_m, tops_m = cloud.xyz_m, tops_of(tops)
    if not has_crs:
        notes.append(f"{name} names no reference system: its points were taken to be in the model's ({dsm.crs.name}).")
    elif not _is_same(tops.crs, dsm, tops_m):
        notes.append(f"{name} is in {tops.crs.name}: its points were brought into the model's system ({dsm.crs.name}).")
        xyz_m, tops_m = (_brought(places_m, tops.crs, dsm.crs) for places_m in (xyz_m, tops_m))
    if offset_m is not None and _share_over(dsm, xyz_m) < _LEAST_SHARE <= _share_over(dsm, xyz_m + offset_m):
        xyz_m, tops_m = xyz_m + offset_m, tops_m + offset_m
        notes.append(f"{name} lies near zero: the offset of its project was added.")
    share, heights = _share_over(dsm, xyz_m), compared(tops_m, tops.resolution_m, dsm)
    is_above = heights is not None and heights.above_share > _MOST_ABOVE_SHARE
    misfit = _misfit(name, share, heights)
    if heights is not None and is_above and heights.low_m <= ABOVE_M and heights.low_m >= -ABOVE_M:
        notes.append(
            f"{heights.above_share:.0%} of {name}'s cells stand more than {ABOVE_M:g} m above this model, up to "
            f"{heights.above_m:.1f} m: it may be a terrain model (DTM), without trees and buildings. Open the cloud "
            "itself as the model."
        )
    if misfit is not None:
        return Placed(None, (*notes, misfit), is_above)
    kept = _near(dsm, xyz_m)
    if left := int((~kept).sum()):
        notes.append(
            f"{left:,} of the {len(kept):,} points of {name} that would be shown lie more than {_MARGIN_M:g} m beside "
            f"the model, {_HEIGHT_MARGIN_M:g} m above or below it, or nowhere: they were left out."
        )
    shown = replace(cloud, xyz_m=xyz_m[kept], rgb=None if cloud.rgb is None else cloud.rgb[kept])
    return Placed(shown, tuple(notes), is_above)


def _misfit(name: str, share: float, heights: Compared | None) -> str | None:
    """Why the points are not shown over the model, with what to do; None where they fit."""
    if share < _LEAST_SHARE or heights is None:
        where = f"{name} lies elsewhere than the surface model ({share:.0%} of its points lie over it)"
        return f"{where}, so its points are not shown: export both in one reference system, of one area."
    if heights.low_m > ABOVE_M:
        where = f"{name} lies {heights.median_m:.1f} m above the surface model"
        return (
            f"{where}, so its points are not shown: export both in one vertical datum, and see which of them is right. "
            "A terrain model (DTM) of a forest lies so too: open the cloud itself as the model."
        )
    if heights.high_m < -ABOVE_M:
        where = f"{name} lies {-heights.median_m:.1f} m below the surface model"
        return (
            f"{where}, so its points are not shown: export both in one vertical datum, and see which of them is right."
        )
    if heights.off_m > ABOVE_M and heights.low_m < -ABOVE_M:
        where = f"{name} does not lie on the surface model: half of it is {heights.off_m:.1f} m or more off, up or down"
        return f"{where}, so its points are not shown: export both in one reference system and one vertical datum."
    return None


def _is_same(crs: CRS, dsm: Dsm, xyz_m: F64) -> bool:
    """By where it puts the points' ends: programs write one system in many ways."""
    ends = np.array([xyz_m.min(axis=0), xyz_m.max(axis=0)])
    with np.errstate(invalid="ignore"):
        return bool((np.abs(_brought(ends, crs, dsm.crs) - ends)[:, :2] < _SAME_M).all())


def _brought(xyz_m: F64, source: CRS, target: CRS) -> F64:
    """Places from one projection to another, infinite where that cannot be told; heights stay as they are."""
    try:
        way = Transformer.from_crs(source, target, always_xy=True)
    except ProjError:
        return np.full_like(xyz_m, np.inf)
    return np.column_stack([*way.transform(xyz_m[:, 0], xyz_m[:, 1]), xyz_m[:, 2]])


def _share_over(dsm: Dsm, xyz_m: F64) -> float:
    with np.errstate(invalid="ignore"):
        return float(np.isfinite(dsm.elevation_at(xyz_m[:, :2])).mean())


def _near(dsm: Dsm, xyz_m: F64) -> Bools:
    """Of (N, 3) points those with a place that is near the model."""
    west, south, east, north = dsm.bounds_m
    least = (west - _MARGIN_M, south - _MARGIN_M, float(np.nanmin(dsm.elevation_m)) - _HEIGHT_MARGIN_M)
    most = (east + _MARGIN_M, north + _MARGIN_M, float(np.nanmax(dsm.elevation_m)) + _HEIGHT_MARGIN_M)
    return np.asarray(((xyz_m >= least) & (xyz_m <= most)).all(axis=1), dtype=np.bool_)
