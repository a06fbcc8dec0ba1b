"""Known ground for perception: the part of a surface model around home, laid under the map frame."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import ProjError

from mapping.geometry.arrays import F32, F64
from mapping.geometry.frames import LocalFrame
from mapping.perceiving.ground import GroundGrid, ground_grid
from planning.errors import DescribedError
from telemetry.errors import TelemetryError
from telemetry.topics.obstacles import GroundNotice, MapOrigin

REACH_M = 1000.0
"""From home, to all four sides."""
_SAMPLES = 9
_MOST_AWAY_M = 0.5
"""By which the model's grid may differ from a straight-lined one over that reach."""


class GroundError(TelemetryError):
    """The surface model cannot be laid under the map."""

    code = "known_ground"


def ground_around(notice: GroundNotice, origin: MapOrigin, elevation_m: F32 | None = None) -> GroundGrid:
    """The model within a kilometre of home, placed so that it has the height 0 at home: home stands on it.

    Fine cells are taken together by their highest and lowest part. Reads only that window of the file, or of
    ``elevation_m`` where the heights are at hand.
    Raises GroundError when the file is not what the notice says, or home lies off the model or on unknown ground.
    """
    elevation = _opened(notice) if elevation_m is None else elevation_m
    enu_to_cell = _enu_to_cell(notice, origin)
    home_alt_dsm_m = _height_at(elevation, enu_to_cell[:, 2], notice)
    window, shifted = _window(elevation, enu_to_cell)
    grid = ground_grid(window, shifted)
    return replace(grid, up_m=grid.up_m - home_alt_dsm_m, foot_m=grid.foot_m - home_alt_dsm_m)


def _opened(notice: GroundNotice) -> F32:
    try:
        elevation = np.load(notice.elevation_npy, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError) as error:
        advice = "Add the surface model again."
        raise GroundError(f"The surface model cannot be read ({error}).", where=notice.name, advice=advice) from error
    if elevation.ndim != 2 or elevation.dtype != np.float32 or elevation.size == 0:
        what = f"The surface model's file holds {elevation.dtype} {elevation.shape}, not a grid of heights."
        raise GroundError(what, where=notice.name, advice="Add the surface model again.")
    return elevation


def _enu_to_cell(notice: GroundNotice, origin: MapOrigin) -> F64:
    """(2, 3) [row, column] = A @ [east, north, 1], fitted to places all over the reach."""
    if not (np.isfinite([notice.west_m, notice.north_m]).all() and notice.resolution_m > 0):
        raise GroundError(f"The surface model's cells of {notice.resolution_m} m are none.", where=notice.name)
    side = np.linspace(-REACH_M, REACH_M, _SAMPLES)
    enu = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    frame = LocalFrame(origin.lat_deg, origin.lon_deg, origin.alt_amsl_m)
    geodetic = frame.to_geodetic(np.column_stack([enu, np.zeros(len(enu))]))
    try:
        x, y = Transformer.from_crs(4326, CRS.from_wkt(notice.crs_wkt), always_xy=True).transform(
            geodetic[:, 1], geodetic[:, 0]
        )
    except ProjError as error:
        what = f"The surface model's reference system is not understood ({error})."
        raise GroundError(what, where=notice.name, advice="Add the surface model again.") from error
    cells = np.column_stack([notice.north_m - np.asarray(y), np.asarray(x) - notice.west_m]) / notice.resolution_m
    if not np.isfinite(cells).all():
        what = "The surface model's reference system does not reach to home."
        raise GroundError(what, where=notice.name, advice="Fly where the surface model lies.")
    inputs = np.column_stack([enu, np.ones(len(enu))])
    fitted = np.linalg.lstsq(inputs, cells, rcond=None)[0]
    away_m = float(np.abs(inputs @ fitted - cells).max()) * notice.resolution_m
    if away_m > _MOST_AWAY_M:
        what = f"The surface model's grid is bent by {away_m:.1f} m around home."
        raise GroundError(what, where=notice.name, advice="Reproject it, to UTM for one.")
    return np.ascontiguousarray(fitted.T, np.float64)


def _height_at(elevation: F32, cell: F64, notice: GroundNotice) -> float:
    row, col = (int(v) for v in np.floor(cell))
    rows, cols = elevation.shape
    height_m = float(elevation[row, col]) if 0 <= row < rows and 0 <= col < cols else np.nan
    if not np.isfinite(height_m):
        what = "Home does not lie on a known part of the surface model."
        advice = "Known ground is not told from obstacles until it does."
        raise GroundError(what, where=notice.name, advice=advice)
    return height_m


def _window(elevation: F32, enu_to_cell: F64) -> tuple[F32, F64]:
    """The cells within reach, and the map to them."""
    corners = np.array([[e, n, 1.0] for e in (-REACH_M, REACH_M) for n in (-REACH_M, REACH_M)])
    cells = corners @ enu_to_cell.T
    low = np.clip(np.floor(cells.min(axis=0)), 0, elevation.shape).astype(int)
    high = np.clip(np.ceil(cells.max(axis=0)) + 1, 0, elevation.shape).astype(int)
    shifted = enu_to_cell.copy()
    shifted[:, 2] -= low
    return elevation[low[0] : high[0], low[1] : high[1]], shifted


def why_none(error: DescribedError) -> str:
    """For the sensor's status line."""
    return f"{error.what} {error.advice}".strip()
