"""Where the model knows nothing: flat plates in the holes, so that what is drawn there is not taken for ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from affine import Affine
from scipy import ndimage
from skimage import measure

from planning.dsm import Dsm
from server.scene.payload import HeightGrid


def plates(grid: HeightGrid) -> HeightGrid:
    """The height at which each unknown cell is drawn and clicked, NaN where the ground is known.

    Each connected hole is one level plate at its lowest rim: inside the terrain, below the ground that may be there.
    """
    known = np.isfinite(grid.alt_dsm_m)
    alt = np.full(known.shape, np.nan, dtype=np.float32)
    if known.all() or not known.any():
        return replace(grid, alt_dsm_m=alt)
    hole = np.asarray(measure.label(~known, connectivity=2))
    rim_m = ndimage.minimum_filter(np.where(known, grid.alt_dsm_m, np.inf), size=3)
    level_m = np.full(int(hole.max()) + 1, np.inf, dtype=np.float32)
    np.minimum.at(level_m, hole[~known], rim_m[~known])
    alt[~known] = level_m[hole[~known]]
    return replace(grid, alt_dsm_m=alt)


def as_model(grid: HeightGrid, like: Dsm) -> Dsm:
    """A grid as a surface model of its own, to cast rays at."""
    transform = Affine(grid.cell_m, 0.0, grid.west_m, 0.0, -grid.cell_m, grid.north_m)
    return replace(like.as_grid(), elevation_m=np.ascontiguousarray(grid.alt_dsm_m), transform=transform)
