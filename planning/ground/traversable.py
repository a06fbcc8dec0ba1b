"""A surface model's traversability, and what a UWB radar log clears of it: grids and coordinates put together."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from affine import Affine
from numpy.typing import NDArray

from mapping.geometry.arrays import F64
from mapping.traversability import MOST_CELLS, Traversability, TraversabilityParams, patch_reach, traversability_map
from mapping.uwb.clearing import Cleared, UwbPose, clear
from mapping.uwb.uwb_params import UwbGeometry, UwbParams
from planning.errors import ParameterError
from planning.ground.landing_sites import LandingSites, landing_sites
from planning.safe_surface.surface import block_max
from planning.safe_surface.window import Box
from planning.terrain.dsm import Dsm, SurfaceModel

FINEST_M = UwbGeometry().bin_m
"""Resolution where nobody asks for another, or the model's own where that is coarser: the radar's range bins."""
APART_M = 0.5
"""Where models meet that are farther apart, errors included, nothing is known of the steps between them."""


@dataclass(frozen=True, slots=True)
class TraversableGround:
    """The model at the resolution of the map, and the map."""

    dsm: Dsm
    map: Traversability


@dataclass(frozen=True, slots=True)
class UwbScans:
    """A radar log: intensities over range and where the radar was, WGS84."""

    t_s: F64
    """(scans,) ascending"""
    lat_lon_deg: F64
    """(scans, 2)"""
    heading_rad: F64
    """(scans,) of the beam's axis, clockwise from true north"""
    intensity: NDArray[Any]
    """(scans, bins)"""
    geometry: UwbGeometry
    left_out: str = ""
    """Which of the log are not among them, and why; empty: all are."""


@dataclass(frozen=True, slots=True)
class MapCells:
    """The grid of a map: so many rows and columns of the model's cells are taken together as one of its own."""

    together: int
    transform: Affine
    shape: tuple[int, int]
    """Rows, columns."""

    @property
    def resolution_m(self) -> float:
        return float(self.transform.a)


def map_cells(model: SurfaceModel, resolution_m: float | None = None) -> MapCells:
    """Cells of at most ``resolution_m``: whole cells of the model taken together.

    A model that is coarser stays as it is; without a resolution, a model too large for the finest is taken coarser.
    Raises ParameterError for a resolution that makes no sense.
    """
    if resolution_m is not None and not (math.isfinite(resolution_m) and resolution_m > 0.0):
        raise ParameterError(f"A resolution of {resolution_m:g} m makes no sense.", advice="Give metres above 0.")
    rows, columns = model.height_px, model.width_px
    wanted_m = resolution_m or max(FINEST_M, model.resolution_m * math.sqrt(rows * columns / MOST_CELLS))
    together = max(1, math.floor(wanted_m / model.resolution_m * (1.0 + 1e-6)))
    if resolution_m is None:
        while math.ceil(rows / together) * math.ceil(columns / together) > MOST_CELLS:
            together += 1
    transform = model.transform if together == 1 else model.transform @ Affine.scale(together)
    return MapCells(together, transform, (math.ceil(rows / together), math.ceil(columns / together)))


def traversable_ground(
    dsm: Dsm, resolution_m: float | None = None, params: TraversabilityParams | None = None
) -> TraversableGround:
    """Works out the map on ``map_cells``, the highest cell of each kept.

    Unknown where less than ``known_share`` of those is known: a few heights say nothing of the gaps between them.
    Raises ParameterError for a resolution that makes no sense and CapacityError for too many cells.
    """
    cells = map_cells(dsm, resolution_m)
    grid = _together(dsm.settled(APART_M), cells.together, (params or TraversabilityParams()).known_share)
    return TraversableGround(grid, traversability_map(grid.elevation_m, grid.resolution_m, params))


def traversable_part(
    model: SurfaceModel, cells: MapCells, box: Box, params: TraversabilityParams | None = None
) -> Traversability:
    """A box of the map of the whole model, bit for bit: the box and half a patch around it are looked at."""
    outer, factor = box.grown(patch_reach(cells.resolution_m, params), cells.shape), cells.together
    rows, columns = outer.shape
    part = model.window(outer.row0 * factor, outer.col0 * factor, rows * factor, columns * factor)
    found = traversable_ground(part, cells.resolution_m, params).map
    inner = box.relative_to(outer, 1).slices
    return replace(
        found,
        slope_rad=found.slope_rad[inner],
        roughness_m=found.roughness_m[inner],
        index=found.index[inner],
        elevation_m=found.elevation_m[inner],
    )


def cleared_ground(ground: TraversableGround, scans: UwbScans, params: UwbParams | None = None) -> Cleared:
    """What the log clears. Raises ParameterError when it lies elsewhere or never looks at open ground."""
    xy_m = ground.dsm.xy_from_lat_lon(scans.lat_lon_deg)
    inside = np.isfinite(ground.dsm.elevation_at(xy_m))
    if not inside.any():
        lat_deg, lon_deg = scans.lat_lon_deg[0]
        raise ParameterError(
            f"The radar log begins at {lat_deg:.6f}, {lon_deg:.6f} and never enters the surface model.",
            where="UWB log",
            advice="Open the model of the place where the log was taken.",
        )
    grid_heading_rad = scans.heading_rad + _turn(ground.dsm, scans.lat_lon_deg[inside][0])
    poses = [
        UwbPose(float(t), float(x), float(y), float(h))
        for t, (x, y), h in zip(scans.t_s, xy_m, grid_heading_rad, strict=True)
    ]
    west_m, _, _, north_m = ground.dsm.bounds_m
    result, _ = clear(
        ground.map,
        scans.intensity,
        poses,
        geometry=scans.geometry,
        params=params,
        west_m=west_m,
        north_m=north_m,
    )
    return result


def sites_near(
    ground: TraversableGround, lat_lon_deg: tuple[float, float], rotor_span_m: float, radius_m: float
) -> LandingSites:
    """``landing_sites`` around a place on earth. Raises ParameterError where the model's projection ends."""
    (row,), (col,) = ground.dsm.fractional_cell(ground.dsm.xy_from_lat_lon(np.array([lat_lon_deg])))
    return landing_sites(ground.map, (float(row), float(col)), rotor_span_m, radius_m)


def site_places(ground: TraversableGround, found: LandingSites) -> F64:
    """(N, 3) latitude, longitude and ``alt_dsm_m`` of each site's middle."""
    cells = np.array([[site.row, site.col] for site in found.sites], np.intp).reshape(-1, 2)
    west_m, _, _, north_m = ground.dsm.bounds_m
    cell_m = ground.dsm.resolution_m
    xy_m = np.column_stack([west_m + (cells[:, 1] + 0.5) * cell_m, north_m - (cells[:, 0] + 0.5) * cell_m])
    heights_m = ground.dsm.elevation_m[cells[:, 0], cells[:, 1]].astype(np.float64)
    return np.column_stack([ground.dsm.lat_lon_from_xy(xy_m.astype(np.float64)), heights_m])


def _together(dsm: Dsm, factor: int, least_share: float) -> Dsm:
    """Highest of each block of cells; NaN where less of it is known."""
    if factor == 1:
        return dsm
    grid = block_max(dsm, factor)
    enough = _known_share(dsm.elevation_m, factor) >= least_share
    return grid.with_elevation(np.where(enough, grid.elevation_m, np.float32(np.nan)))


def _known_share(elevation_m: NDArray[np.floating], factor: int) -> F64:
    """Of each block, as far as it lies in the model."""
    rows, cols = elevation_m.shape
    tops, lefts = np.arange(0, rows, factor), np.arange(0, cols, factor)
    known = [np.add.reduceat(np.isfinite(elevation_m[top : top + factor]).sum(axis=0), lefts) for top in tops]
    high, wide = np.minimum(factor, rows - tops), np.minimum(factor, cols - lefts)
    return np.array(known) / (high[:, None] * wide[None, :])


def _turn(dsm: Dsm, lat_lon_deg: F64) -> float:
    """What to add to a heading from true north to count it from the grid's."""
    lat_deg, lon_deg = lat_lon_deg
    north_deg = lat_deg + (1e-4 if lat_deg < 0 else -1e-4)
    here, there = dsm.xy_from_lat_lon(np.array([[lat_deg, lon_deg], [north_deg, lon_deg]]))
    east_m, north_m = (there - here) * (1.0 if lat_deg < 0 else -1.0)
    return math.atan2(east_m, north_m)
