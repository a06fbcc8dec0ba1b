"""A surface model, and the points it was made of, as the arrays that the 3D view draws."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64, U8
from planning.safe_surface.surface import block_max
from planning.terrain.clouds.thin import ThinnedCloud
from planning.terrain.dsm import Dsm
from planning.terrain.hillshade import height_colors, hillshade, scale_rgb
from planning.terrain.orthophoto import Orthophoto
from server.scene.geometry.payload import HeightGrid, PointsScene, TerrainScene

Shading = Literal["height", "hillshade", "orthophoto"]
Progress = Callable[[str, float | None], None]

GRID_CELLS = 300
"""Per side at most: some five megabytes for the browser."""
TEXTURE_PX = 2048
_DARKEST = 0.45
"""Share of a colour's brightness that the steepest shadow leaves: relief must not drown the legend's colours."""
_FLAT_LIGHT = 0.7071
"""What the sun of `planning.terrain.hillshade` gives flat ground."""
_NO_PHOTO_RGB = (176, 176, 180)
_SHADES = 256
_DARKEST_POINT, _DARKEST_BELOW_M = 0.45, 10.0
"""What is left of a colour so far below the top of its cell: trunks stand out from crowns, and ground from both."""


def build_terrain_scene(
    terrain_id: str,
    dsm: Dsm,
    *,
    shading: Shading,
    orthophoto: Orthophoto | None,
    report: Progress = lambda step, share: None,
) -> TerrainScene:
    """Heights by block MAXIMUM, so that masts survive, and a finer texture to drape over them.

    "orthophoto" without an orthomosaic falls back to height colours. Temporaries have the texture's size.
    """
    report("Coarsening the surface model", 0.0)
    grid = block_max(dsm, _factor(dsm, GRID_CELLS))
    fine = block_max(dsm, _factor(dsm, TEXTURE_PX))
    report("Shading the surface model", 0.5)
    low_m, high_m = float(np.nanmin(fine.elevation_m)), float(np.nanmax(fine.elevation_m))
    west, _, _, north = grid.bounds_m
    return TerrainScene(
        terrain_id=terrain_id,
        grid=HeightGrid(alt_dsm_m=grid.elevation_m, west_m=west, north_m=north, cell_m=grid.resolution_m),
        texture_rgb=_over_extent(_texture(fine, shading, orthophoto), fine, grid),
        legend_min_m=low_m,
        legend_max_m=high_m,
    )


def _factor(dsm: Dsm, most: int) -> int:
    return max(1, math.ceil(max(dsm.height_px, dsm.width_px) / most))


def _texture(fine: Dsm, shading: Shading, orthophoto: Orthophoto | None) -> U8:
    shade = hillshade(fine)
    if shading == "hillshade":
        return np.repeat(shade[:, :, None], 3, axis=2)
    if shading == "orthophoto" and orthophoto is not None:
        return _photo(fine, orthophoto, shade)
    return _shaded(height_colors(fine), shade)


def _shaded(colors: U8, shade: U8) -> U8:
    """Colours times a gentle relief; flat ground keeps the colour of the legend."""
    light = np.arange(256) / 255 / _FLAT_LIGHT
    gain = np.clip(_DARKEST + (1 - _DARKEST) * light, 0.0, 1.25).astype(np.float32)
    return np.clip(colors * gain[shade][:, :, None], 0, 255).astype(np.uint8)


def _photo(fine: Dsm, photo: Orthophoto, shade: U8) -> U8:
    """The orthomosaic as it is, and gently shaded grey where it does not reach."""
    out = _shaded(np.full((*shade.shape, 3), _NO_PHOTO_RGB, dtype=np.uint8), shade)
    west, south, east, north = photo.bounds_m
    rows, cols = photo.known.shape
    x_m = fine.transform.c + (np.arange(fine.width_px) + 0.5) * fine.resolution_m
    y_m = fine.transform.f - (np.arange(fine.height_px) + 0.5) * fine.resolution_m
    col, row = (x_m - west) / (east - west) * cols, (north - y_m) / (north - south) * rows
    in_col, in_row = np.nonzero((col >= 0) & (col < cols))[0], np.nonzero((row >= 0) & (row < rows))[0]
    source = np.ix_(row[in_row].astype(np.intp), col[in_col].astype(np.intp))
    target = np.ix_(in_row, in_col)
    out[target] = np.where(photo.known[source][:, :, None], photo.rgb[source], out[target])
    return out


def _over_extent(texture: U8, fine: Dsm, grid: Dsm) -> U8:
    """The texture continued to the grid's right and lower edge, whose last blocks hang over the model's."""
    rows = max(round(grid.height_px * grid.resolution_m / fine.resolution_m), texture.shape[0])
    cols = max(round(grid.width_px * grid.resolution_m / fine.resolution_m), texture.shape[1])
    return np.pad(texture, ((0, rows - texture.shape[0]), (0, cols - texture.shape[1]), (0, 0)), mode="edge")


def build_points_scene(terrain_id: str, dsm: Dsm, cloud: ThinnedCloud, *, low_m: float, high_m: float) -> PointsScene:
    """A thinned cloud in its own colours, else by height.

    ``low_m`` and ``high_m``: the heights that the ends of the colour scale mean, as on the model beside it.
    """
    rgb = cloud.rgb if cloud.rgb is not None else _by_height(dsm, cloud.xyz_m, low_m, high_m)
    return PointsScene(terrain_id, np.asarray(cloud.xyz_m), np.asarray(rgb), cloud.voxel_m)


def _by_height(dsm: Dsm, xyz_m: F64, low_m: float, high_m: float) -> U8:
    """(N, 3) the scale's colour of each height, the darker the farther it is below the model there."""
    share = np.clip((xyz_m[:, 2] - low_m) / max(high_m - low_m, 1e-6), 0.0, 1.0)
    colors = scale_rgb(_SHADES)[np.round(share * (_SHADES - 1)).astype(np.intp)]
    below_m = np.nan_to_num(dsm.elevation_at(xyz_m[:, :2]) - xyz_m[:, 2])
    light = 1.0 - (1.0 - _DARKEST_POINT) * np.clip(below_m / _DARKEST_BELOW_M, 0.0, 1.0)
    return np.round(colors * light[:, None]).astype(np.uint8)
