"""Colours laid over the surface model."""

from __future__ import annotations

import numpy as np

from server.scene.payload import U8, OverlayScene, TerrainScene


def laid_over(terrain: TerrainScene, overlay: OverlayScene | None) -> U8:
    """(th, tw, 3) the terrain's texture, under the overlay's colours where it has any.

    In the texture instead of above it: nothing floats, and nothing flickers between two surfaces.
    """
    texture = terrain.texture_rgb
    if overlay is None:
        return texture
    rows, cols = texture.shape[:2]
    grid = terrain.grid
    x_m = grid.west_m + (np.arange(cols) + 0.5) / cols * grid.alt_dsm_m.shape[1] * grid.cell_m
    y_m = grid.north_m - (np.arange(rows) + 0.5) / rows * grid.alt_dsm_m.shape[0] * grid.cell_m
    col = np.floor((x_m - overlay.west_m) / overlay.cell_m).astype(np.intp)
    row = np.floor((overlay.north_m - y_m) / overlay.cell_m).astype(np.intp)
    in_row = np.flatnonzero((row >= 0) & (row < overlay.rgba.shape[0]))
    in_col = np.flatnonzero((col >= 0) & (col < overlay.rgba.shape[1]))
    out, target = texture.copy(), np.ix_(in_row, in_col)
    colors = overlay.rgba[np.ix_(row[in_row], col[in_col])].astype(np.float32)
    share = colors[..., 3:] / np.float32(255)
    out[target] = np.round(share * colors[..., :3] + (1 - share) * out[target]).astype(np.uint8)
    return out
