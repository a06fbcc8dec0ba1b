"""A point cloud -> the surface model of its highest points, and of its ground where its points are classified."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from secrets import token_hex
from typing import Any

import numpy as np
from affine import Affine
from pyproj import CRS

from mapping.geometry.arrays import F32
from planning.errors import ParameterError, RasterFormatError
from planning.terrain.clouds.cloud_header import CloudHeader, cloud_format
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.rasters import georef, sandbox
from planning.terrain.rasters.header import RasterLimits
from planning.terrain.rasters.memory_at_hand import watched
from planning.terrain.rasters.reading import Progress

LIMITS = RasterLimits(max_px=100_000_000, max_memory_bytes=3 * 2**30, header_s=60.0)
_DECODER = __name__.rpartition(".")[0]
_COARSE = 0.1
"""Steps of coordinates that are told, of a cell."""
_SMALLER = "Crop it to the area of the flight, or thin it out."


@dataclass(frozen=True, slots=True)
class CloudParams:
    """How a point cloud is understood and what is made of it."""

    cell_m: float | None = None
    """None: of its density."""
    crs: str | None = None
    vertical_datum: str | None = None
    z_scale: float | None = None
    """Metres per unit of height, where the file's own is not to be believed."""
    keep_noise: bool = False
    """Points that the file calls noise (classes 7 and 18) count as well."""
    most_points: int = 0
    """Of the cloud itself, thinned, to be looked at; 0: none."""
    limits: RasterLimits = LIMITS

    def __post_init__(self) -> None:
        for name, option, value in (
            ("cell size", "--cell-m", self.cell_m),
            ("height scale", "--z-scale", self.z_scale),
        ):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                advice = f"Leave {option} out, or give metres."
                raise ParameterError(f"The {name} must be greater than 0, got {value:g}.", where=option, advice=advice)


@dataclass(frozen=True, slots=True)
class CloudModel:
    """What came of a cloud."""

    dsm: Dsm
    """The highest point of each cell, whatever it is; NaN where there was none: nothing is filled in."""
    ground: Dsm | None
    """The highest ground point (class 2) of each cell; None where none is called ground."""
    points: int
    """Of the file."""
    taken: int
    ground_points: int
    noise: int
    not_numbers: int
    classes: tuple[int, ...]
    """(256,) points that were taken, by their class; all 0 where none has one."""
    notes: tuple[str, ...]
    """What was assumed or left out, in plain words."""
    thinned: ThinnedCloud | None = None
    """Of the points that were taken, where it was asked for."""


def read_cloud(path: Path, params: CloudParams | None = None, *, progress: Progress | None = None) -> CloudModel:
    """LAS, LAZ, COPC, PLY, PCD or E57, decoded in a confined process. Raises a RasterError that says what to do."""
    params = params or CloudParams()
    headers: list[CloudHeader] = []
    places: list[georef.Georeference] = []

    def order(fields: dict[str, Any]) -> dict[str, Any]:
        header = CloudHeader.from_json(fields)
        headers.append(header)
        places.append(georef.interpret(header, crs=params.crs, vertical_datum=params.vertical_datum, where=path.name))
        return _order(places[0], params, where=path.name)

    with sandbox.private_directory() as directory:
        link, target, ground, points, colors = (directory / token_hex(8) for _ in range(5))
        kind = cloud_format(path)
        link.symlink_to(path.resolve())
        job = {
            "job": "read_cloud", "decoder": _DECODER, "format": kind, "source": str(link), "target": str(target),
            "ground": str(ground), "points": str(points), "colors": str(colors),
        }  # fmt: skip
        found = sandbox.run_job(
            job, directory=directory, limits=params.limits, where=path.name, on_header=order,
            progress=watched(progress, where=path.name), smaller=_SMALLER,
        )  # fmt: skip
        shape = (found["shape"][0], found["shape"][1])
        # The files' names are gone with the directory; their pages live on while they are mapped.
        heights, grounds = _mapped(target, shape), _mapped(ground, shape) if found["ground"] else None
        thinned = _thinned(points, colors, found) if found["shown"] else None
    return _model(path, headers[0], places[0], found, heights, grounds, thinned)


def _order(place: georef.Georeference, params: CloudParams, *, where: str) -> dict[str, Any]:
    if place.horizontal.is_geographic:
        raise RasterFormatError(
            f"Its points are in degrees ({place.horizontal.name}), in which cells are no squares.",
            where=where,
            advice="Project it to a grid in metres first, for example with pdal translate and filters.reprojection.",
        )
    return {
        "cell_m": params.cell_m,
        "xy_m": georef.unit_m(place.horizontal),
        "z_m": params.z_scale or place.metres_per_height_unit,
        "max_px": params.limits.max_px,
        "keep_noise": params.keep_noise,
        "most_points": params.most_points,
    }


def _mapped(path: Path, shape: tuple[int, int]) -> F32:
    return np.asarray(np.memmap(path, dtype=np.float32, mode="r+", shape=shape))


def _thinned(points: Path, colors: Path, found: dict[str, Any]) -> ThinnedCloud:
    rgb = np.fromfile(colors, np.uint8).reshape(-1, 3) if found["colored"] else None
    return ThinnedCloud(np.fromfile(points, np.float64).reshape(-1, 3), rgb, found["voxel_m"])


def _model(
    path: Path, header: CloudHeader, place: georef.Georeference, found: dict[str, Any], heights: F32,
    ground: F32 | None, thinned: ThinnedCloud | None,
) -> CloudModel:  # fmt: skip
    cell_m = found["cell_m"]
    transform = Affine(cell_m, 0.0, found["west_m"], 0.0, -cell_m, found["north_m"])
    crs = place.horizontal if georef.unit_m(place.horizontal) == 1.0 else georef.in_metres(place.horizontal)

    def dsm(cells: F32, crs: CRS = crs) -> Dsm:
        return Dsm(cells, transform, crs, place.vertical_datum, "", name=path.name)

    return CloudModel(
        dsm(heights), None if ground is None else dsm(ground), header.points, found["taken"], found["ground"],
        found["noise"], found["not_numbers"], tuple(found["classes"]), (*header.notes, *place.notes, *_left_out(found)),
        thinned,
    )  # fmt: skip


def _left_out(found: dict[str, Any]) -> list[str]:
    notes = []
    if found["noise"]:
        notes.append(f"{found['noise']:,} points that the file calls noise were left out (classes 7 and 18).")
    if found["not_numbers"]:
        notes.append(f"{found['not_numbers']:,} points without a place or height were left out.")
    if found["shown"] and found["every"] > 1:
        notes.append(
            f"The points that are shown were chosen among one of each {found['every']}: there are so many. The surface "
            "model is of all of them."
        )
    if found["step_m"] > _COARSE * found["cell_m"]:
        notes.append(
            f"It keeps places in 32 bits, which at these coordinates are {found['step_m']:g} m apart: "
            "export it with double precision."
        )
    return notes
