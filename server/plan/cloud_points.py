"""The thinned points of a cloud, beside the surface model that was made of it: to be looked at, never planned over."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from planning.terrain.clouds.thin import ThinnedCloud
from server.errors import NotFoundError, StorageError
from server.library.shelf import read_manifest
from server.library.stored_arrays import read_array, write_array
from server.library.terrains import TerrainManifest

_PLACES, _COLORS = "points.npy", "point_colors.npy"


def write_points(folder: Path, cloud: ThinnedCloud) -> None:
    """Raises ``StorageFullError``."""
    write_array(folder / _PLACES, cloud.xyz_m)
    if cloud.rgb is not None:
        write_array(folder / _COLORS, cloud.rgb)


def points_to_keep(directory: Path) -> tuple[ThinnedCloud | None, tuple[str, ...]]:
    """Those of a model of which a copy is made, where there are any; damaged ones are left behind, and that is said."""
    told = read_manifest(directory, TerrainManifest).doc.cloud
    if told is None or not told.shown:
        return None, ()
    try:
        return read_points(directory), ()
    except StorageError as error:
        return None, (f"The points of its cloud were left out. {error}",)


def read_points(directory: Path) -> ThinnedCloud:
    """Of the surface model in this folder. Raises ``NotFoundError`` when it has none, ``StorageError`` for damage."""
    told = read_manifest(directory, TerrainManifest).doc.cloud
    if told is None or told.shown == 0:
        what = "No points were kept with this surface model."
        raise NotFoundError(what, advice="Open the point cloud again.")
    xyz_m = read_array(directory / _PLACES, shape=(told.shown, 3), dtype=np.float64)
    rgb = read_array(directory / _COLORS, shape=(told.shown, 3), dtype=np.uint8) if told.colored else None
    return ThinnedCloud(xyz_m, rgb, told.voxel_m)
