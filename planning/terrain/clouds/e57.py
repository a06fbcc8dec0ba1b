"""Point clouds in E57 files (ASTM E2807): all scans of a file, each placed by its pose."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pye57
from pye57 import libe57  # pyright: ignore[reportAttributeAccessIssue]
from pyproj import CRS
from pyproj.exceptions import CRSError

from mapping.geometry import quaternions
from mapping.geometry.arrays import F32, F64, U16
from planning.errors import RasterFormatError
from planning.terrain.clouds.cloud import CHUNK, Box, Chunk

_CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
_SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLORS = ("colorRed", "colorGreen", "colorBlue")
_INVALID = {_CARTESIAN: "cartesianInvalidState", _SPHERICAL: "sphericalInvalidState"}


@dataclass(frozen=True, slots=True)
class E57File:
    """Scans of one file; points are in metres."""

    path: Path
    rows: int
    crs_wkt: str | None
    notes: tuple[str, ...]
    bounds: Box | None = None
    """Those that scans may give are of the scanner's own frame."""
    unit: str | None = None
    classified: bool = False
    coarse: bool = False

    def chunks(self, *, colors: bool) -> Iterator[Chunk]:
        """Points that the scanner calls invalid come as NaN: they are counted, as all that are no places."""
        file = pye57.E57(str(self.path))
        try:
            for number in range(file.scan_count):
                for xyz_m, rgb in _points(file, number, colors=colors):
                    yield xyz_m, None, rgb
        finally:
            file.close()


def open_e57(path: Path) -> E57File:
    file = pye57.E57(str(path))
    try:
        rows = sum(file.get_header(number).point_count for number in range(file.scan_count))
        wkt, note = _reference(file)
        return E57File(path, rows, wkt, (note,) if note else ())
    finally:
        file.close()


def _reference(file: Any) -> tuple[str | None, str]:
    """The reference system that the file names, or why it is not taken."""
    name = "coordinateMetadata"
    words = str(file.root[name].value()).strip() if file.root.isDefined(name) else ""
    if not words:
        return None, ""
    try:
        return CRS.from_user_input(words).to_wkt(), ""
    except CRSError:
        return None, f'Its reference system is in words that are not understood: "{words[:80]}".'


def _points(file: Any, number: int, *, colors: bool) -> Iterator[tuple[F64, U16 | None]]:
    header = file.get_header(number)
    present = set(header.point_fields)
    axes = next((kind for kind in (_CARTESIAN, _SPHERICAL) if present.issuperset(kind)), None)
    if axes is None:
        names = ", ".join(sorted(present))[:80]
        raise RasterFormatError(f"The points of its scan {number + 1} have no place, but: {names}.")
    R, t_m = _pose(header, number)
    count = min(CHUNK, max(1, header.point_count))
    fields = [name for name in (*axes, _INVALID[axes]) if name in present]
    data, buffers = file.make_buffers(fields, count)
    shades = _with_shades(file, buffers, count) if colors and present.issuperset(_COLORS) else None
    reader = header.points.reader(buffers)
    read = 0
    try:
        while got := reader.read():
            read += got
            columns = [np.asarray(data[name][:got], np.float64) for name in axes]
            xyz_m = np.column_stack(columns) if axes is _CARTESIAN else _from_spherical(*columns)
            if len(fields) > len(axes):
                # 1: only its direction is meant; 2: nothing of it.
                xyz_m[np.asarray(data[fields[-1]][:got]) != 0] = np.nan
            yield xyz_m @ R.T + t_m, None if shades is None else _rgb(header, shades[:, :got])
    finally:
        reader.close()
    if read < header.point_count:
        what = f"Its scan {number + 1} ends after {read:,} of {header.point_count:,} points."
        raise RasterFormatError(what, advice="Copy it again.")


def _with_shades(file: Any, buffers: Any, count: int) -> F32:
    """(3, count) that the reader fills beside ``buffers``: as reals, for a file has bytes, 16 bits or shares of 1."""
    shades = np.zeros((3, count), np.float32)
    for row, name in zip(shades, _COLORS, strict=True):
        buffers.append(libe57.SourceDestBuffer(file.image_file, name, row, count, True, True))
    return shades


def _rgb(header: Any, shades: F32) -> U16:
    """(3, N) between the limits that the scan gives, or bytes -> (N, 3) of 8 bits."""
    node: Any = header.node
    limits = node["colorLimits"] if node.isDefined("colorLimits") else None
    out = np.zeros((shades.shape[1], 3), np.uint16)
    for at, (name, shade) in enumerate(zip(_COLORS, shades, strict=True)):
        ends = (f"{name}Minimum", f"{name}Maximum")
        low, high = 0.0, 255.0
        if limits is not None and all(limits.isDefined(end) for end in ends):
            low, high = (float(limits[end].value()) for end in ends)
        share = (shade - low) / (high - low) if high > low else np.zeros_like(shade)
        out[:, at] = np.round(np.clip(np.nan_to_num(share), 0.0, 1.0) * 255)
    return out


def _pose(header: Any, number: int) -> tuple[F64, F64]:
    """p_file = R p_scan + t"""
    R, t_m = np.eye(3), np.zeros(3)
    if header.has_pose():
        pose = header.node["pose"]
        if pose.isDefined("translation"):
            t_m = np.array([pose["translation"][axis].value() for axis in "xyz"])
        if pose.isDefined("rotation"):
            q_wxyz = np.array([pose["rotation"][part].value() for part in "wxyz"])
            try:
                R = quaternions.rotation(q_wxyz)
            except ValueError:
                t_m = np.full(3, np.nan)
    if not np.isfinite(t_m).all():
        raise RasterFormatError(f"The pose of its scan {number + 1} is none.", advice="Export it again, or as LAZ.")
    return R, t_m


def _from_spherical(range_m: F64, azimuth_rad: F64, elevation_rad: F64) -> F64:
    """E2807, 8.4.4: azimuth from x towards y, elevation from the xy plane."""
    flat_m = range_m * np.cos(elevation_rad)
    return np.column_stack(
        [flat_m * np.cos(azimuth_rad), flat_m * np.sin(azimuth_rad), range_m * np.sin(elevation_rad)]
    )
