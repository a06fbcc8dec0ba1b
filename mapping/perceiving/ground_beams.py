"""What a radar must expect of known ground: at which elevations it is in sight in each cell, and how much of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F32, F64


@dataclass(frozen=True, slots=True)
class BeamShape:
    """Of the AWR1843, as Miccinesi 2022 uses it."""

    azimuth_rad: float = math.radians(48.0)
    """Targets are looked for to both sides so far: the gate and its noise."""
    elevation_low_rad: float = 0.0
    elevation_high_rad: float = math.radians(20.0)
    """The gate, in the radar's frame."""
    range_cell_m: float = 0.5
    slack_cells: int = 2
    """The surface meets a target's cell when it is within so many cells of its range: one for the neighbour, one for
    noise and rounding."""
    beam_half_sine: float = 0.125
    """Eight antennas half a wavelength apart."""
    azimuth_error_rad: float = math.radians(1.5)
    down_6db_rad: float = math.radians(20.0)
    """Off the axis in elevation where one antenna's gain is down by 6 dB."""
    ray_rad: float = math.radians(1.5)
    step_m: float = 0.4
    """Of the walk along a ray, at most."""


@dataclass(frozen=True, slots=True)
class Fan:
    """The surface in sight, by ray (body azimuth) and range cell."""

    gap_rad: F64
    """(rays, cells) how far outside the elevation gate the nearest of it is; 0: it reaches into the gate; inf: none"""
    area_m2: F64
    """(rays, cells) what is shown of it, across the line of sight, weighted by the antenna's gain"""
    shape: BeamShape

    def look(self, azimuth_rad: F64, range_m: F64) -> tuple[F64, F64]:
        """Targets (N,) in the radar's frame -> (N,) gap of their cells, (N,) area that shares their beam and cell."""
        gaps, areas = np.full(len(range_m), np.inf), np.zeros(len(range_m))
        _look(
            self.gap_rad,
            self.area_m2,
            np.ascontiguousarray(azimuth_rad, np.float64),
            np.ascontiguousarray(range_m, np.float64),
            self.shape.azimuth_rad,
            self.shape.range_cell_m,
            self.shape.slack_cells,
            self.shape.beam_half_sine,
            self.shape.azimuth_error_rad,
            gaps,
            areas,
        )
        return gaps, areas


def fan_of_ground(
    up_m: F32,
    enu_to_cell: F64,
    cell_m: float,
    origin_enu: F64,
    R_enu_body: F64,
    farthest_m: float,
    shape: BeamShape,
) -> Fan:
    """The surface as a radar at ``origin_enu`` (3,) sees it out to ``farthest_m``.

    Along rays of equal azimuth the surface is walked outwards; what rises above all before it is in sight, by as many
    radians as it rises. The elevation gate is tilted by the attitude.
    """
    rays = 2 * math.ceil(shape.azimuth_rad / shape.ray_rad) + 1
    cells = math.ceil(farthest_m / shape.range_cell_m) + shape.slack_cells + 1
    gap, area = np.full((rays, cells), np.inf), np.zeros((rays, cells))
    azimuth = np.linspace(-shape.azimuth_rad, shape.azimuth_rad, rays)
    low, high = (_raised(azimuth, e, R_enu_body) for e in (shape.elevation_low_rad, shape.elevation_high_rad))
    axis = _raised(azimuth, 0.0, R_enu_body)
    _walk_all(
        np.ascontiguousarray(up_m),
        enu_to_cell,
        np.ascontiguousarray(origin_enu, np.float64),
        np.column_stack([low[0], np.minimum(low[1], high[1]), np.maximum(low[1], high[1]), axis[1]]),
        min(shape.step_m, cell_m),
        shape.range_cell_m,
        shape.down_6db_rad,
        gap,
        area,
    )
    return Fan(gap, area * (2 * shape.azimuth_rad / (rays - 1)), shape)


def _raised(azimuth: F64, elevation_rad: float, R_enu_body: F64) -> tuple[F64, F64]:
    """Directions of the radar's frame -> (azimuth from north, elevation above the horizontal plane), (N,) each."""
    flat = math.cos(elevation_rad)
    body = np.column_stack(
        [flat * np.sin(azimuth), flat * np.cos(azimuth), np.full(len(azimuth), math.sin(elevation_rad))]
    )
    e, n, u = R_enu_body @ body.T
    return np.arctan2(e, n), np.arcsin(np.clip(u, -1.0, 1.0))


NEAREST_M = 1.5
"""What is nearer hides nothing: a vehicle that stands on rough ground would be blind otherwise."""
PIECE_RAD = math.radians(2.0)
"""A tall wall is looked at in pieces of so much elevation: its upper parts are farther away than its foot."""


@njit(cache=True, nogil=True)
def _walk_all(up_m, to_cell, origin, rays, step, range_cell, down_6db, gap, area):
    for k in range(rays.shape[0]):
        _walk(up_m, to_cell, origin, rays[k], step, range_cell, down_6db, gap[k], area[k])


@njit(cache=True, nogil=True)
def _walk(up_m, to_cell, origin, ray, step, range_cell, down_6db, gap, area):
    """One ray: (azimuth from north, gate's lower and upper edge, elevation of the axis)."""
    rows, cols = up_m.shape
    east, north = math.sin(ray[0]), math.cos(ray[0])
    horizon = -math.inf  # as a slope: most of the surface lies behind something, and needs no angle
    cells = gap.shape[0]
    for i in range(math.ceil(cells * range_cell / step)):
        along = (i + 0.5) * step
        if along < NEAREST_M:
            continue
        x, y = origin[0] + along * east, origin[1] + along * north
        r = math.floor(to_cell[0, 0] * x + to_cell[0, 1] * y + to_cell[0, 2])
        c = math.floor(to_cell[1, 0] * x + to_cell[1, 1] * y + to_cell[1, 2])
        if not (0 <= r < rows and 0 <= c < cols) or math.isnan(up_m[r, c]):
            continue
        above = up_m[r, c] - origin[2]
        slope = above / max(i * step, 1e-3) if above > 0.0 else above / ((i + 1) * step)
        if slope <= horizon:
            continue
        if horizon == -math.inf:  # straight below, or where the model begins
            horizon = slope
            continue
        _show(math.atan(horizon), math.atan(slope), along, ray, range_cell, down_6db, gap, area)
        horizon = slope


@njit(cache=True, nogil=True)
def _show(low, high, along, ray, range_cell, down_6db, gap, area):
    """Put what lies between two elevations, so far ``along`` the ground, into its range cells."""
    pieces = max(1, math.ceil((high - low) / PIECE_RAD))  # slopes may differ where their angles do not
    thick = (high - low) / pieces
    for i in range(pieces):
        elevation = low + (i + 0.5) * thick
        away = along / max(math.cos(elevation), 1e-3)
        cell = math.floor(away / range_cell)
        if cell >= gap.shape[0]:
            continue
        outside = max(0.0, ray[1] - elevation, elevation - ray[2])
        gap[cell] = min(gap[cell], outside)
        loss = (elevation - ray[3]) / down_6db
        area[cell] += thick * away * away * 10.0 ** (-1.2 * loss * loss)


@njit(cache=True, nogil=True)
def _look(gap, area, azimuth, range_m, widest, range_cell, slack, half_sine, error, gaps, areas):
    rays, cells = gap.shape
    ray_rad = 2 * widest / (rays - 1)
    for k in range(range_m.shape[0]):
        half = half_sine / max(math.cos(azimuth[k]), 0.3) + error
        middle = math.floor(range_m[k] / range_cell)
        first = max(0, math.floor((azimuth[k] - half + widest) / ray_rad))
        last = min(rays - 1, math.ceil((azimuth[k] + half + widest) / ray_rad))
        for cell in range(max(0, middle - slack), min(cells, middle + slack + 1)):
            for ray in range(first, last + 1):
                gaps[k] = min(gaps[k], gap[ray, cell])
        most = 0.0
        for cell in range(
            max(0, middle - 1), min(cells, middle + 2)
        ):  # the strongest of the target's and its neighbours
            here = 0.0
            for ray in range(first, last + 1):
                here += area[ray, cell]
            most = max(most, here)
        areas[k] = most
