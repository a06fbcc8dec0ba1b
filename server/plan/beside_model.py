"""A cloud that came with a surface model: its points in the model's system and heights, or why they are not shown."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import ProjError

from mapping.geometry.arrays import F64
from planning.errors import RasterFormatError
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm

_LEAST_SHARE = 0.1
"""Of the points over known cells: photogrammetry's clouds reach beyond their models, but not so far."""
_SAME_M = 0.01
_TOPS = 95.0
_HEIGHTS_APART_M = 5.0
"""Between the tops of the cloud and the model: undulations of the geoid are larger nearly everywhere."""
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


def placed_on(
    dsm: Dsm, cloud: ThinnedCloud, crs: CRS | None, *, name: str, offset_m: F64 | None = None
) -> tuple[ThinnedCloud | None, list[str]]:
    """``crs``: what the cloud says of itself, None where it says nothing. Returns None with the reason why not."""
    notes: list[str] = []
    if crs is None:
        notes.append(f"{name} names no reference system: its points were taken to be in the model's ({dsm.crs.name}).")
    elif not _is_same(crs, dsm, cloud.xyz_m):
        notes.append(f"{name} is in {crs.name}: its points were brought into the model's system ({dsm.crs.name}).")
        cloud = replace(cloud, xyz_m=_brought(cloud.xyz_m, crs, dsm.crs))
    if offset_m is not None and _share_over(dsm, cloud.xyz_m) < _LEAST_SHARE:
        moved = replace(cloud, xyz_m=cloud.xyz_m + offset_m)
        if _share_over(dsm, moved.xyz_m) >= _LEAST_SHARE:
            cloud = moved
            notes.append(f"{name} lies near zero: the offset of its project was added.")
    if _share_over(dsm, cloud.xyz_m) < _LEAST_SHARE:
        return None, [*notes, f"{name} lies elsewhere than the surface model, so its points are not shown: export both "
                              "in one reference system."]  # fmt: skip
    apart_m = _tops_apart_m(dsm, cloud.xyz_m)
    if abs(apart_m) > _HEIGHTS_APART_M:
        side = "above" if apart_m > 0 else "below"
        apart = f"{name} lies {abs(apart_m):.1f} m {side} the surface model"
        return None, [*notes, f"{apart}, so its points are not shown: export both in one vertical datum, and see which "
                              "of them is right."]  # fmt: skip
    return cloud, notes


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


def _tops_apart_m(dsm: Dsm, xyz_m: F64) -> float:
    """How much higher than the model the cloud's tops are: near 0 where both are of the same survey."""
    above_m = xyz_m[:, 2] - dsm.elevation_at(xyz_m[:, :2])
    return float(np.percentile(above_m[np.isfinite(above_m)], _TOPS))
