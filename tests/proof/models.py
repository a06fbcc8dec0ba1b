"""Surface models to prove missions over: recorded ones, and seeded ones of every kind of grid."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rasterio
from affine import Affine

from mapping.geometry.arrays import F32

FOOT_M = 0.3048


@dataclass(frozen=True)
class Model:
    """A raster file and what its reader must be told."""

    name: str
    path: Path
    radius_m: float
    """Of the ball that missions are planned with."""
    leg_m: float
    """Between points of interest."""
    crs: str | None = None
    """Declared; None: the file's."""
    declared_scale: float | None = None
    """Metres per stored unit that the user declares."""
    height_scale: float = 1.0
    """What it is in truth."""


GRIDS: dict[str, tuple[str, Affine]] = {
    "squares": ("EPSG:32633", Affine(1, 0, 5e5, 0, -1, 4.17e6)),
    "degrees": ("EPSG:4326", Affine(1.1e-5, 0, 14.99, 0, -0.9e-5, 37.73)),
    "degrees, 60 N": ("EPSG:4326", Affine(2e-5, 0, 10.4, 0, -1e-5, 60.2)),
    "degrees, date line": ("EPSG:4326", Affine(1e-5, 0, 179.9995, 0, -1e-5, -17.2)),
    "turned": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(27) @ Affine.scale(1, -1)),
    "turned, oblong": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(-64) @ Affine.scale(0.8, -1.3)),
    "oblong": ("EPSG:32633", Affine(0.7, 0, 5e5, 0, -1.3, 4.17e6)),
    "feet": ("EPSG:2994", Affine(3, 0, 640000, 0, -3, 850000)),
    "feet, oblong": ("EPSG:2994", Affine(3, 0, 640000, 0, -4, 850000)),
    "mirrored, sheared": ("EPSG:32633", Affine(-1, 0.2, 5e5, 0.1, -1.1, 4.17e6)),
    "long metres": ("EPSG:3857", Affine(1, 0, 1.67e6, 0, -1, 6.0e5)),
    "untrue metres": ("EPSG:3857", Affine(1, 0, 1.67e6, 0, -1, 4.54e6)),
}


def recorded(folder: Path) -> list[Model]:
    """Every surface model in the folder of recorded ones."""
    depth = {"crs": "EPSG:32610", "radius_m": 30.0, "leg_m": 150.0}
    models = [
        Model("brighton 0.1 m", folder / "brighton/brighton_dsm_010.tif", 3.0, 10.0),
        Model("brighton 0.2 m", folder / "brighton/brighton_dsm_020.tif", 3.0, 12.0),
        Model("coromandel", folder / "coromandel/coromandel_dsm_050.tif", 6.0, 30.0),
        Model("campus", folder / "campus/dsm.tif", 8.0, 40.0),
        Model("crop rows", folder / "crop_rows/dsm.tif", 0.5, 1.5),
        Model("rolling terrain", folder / "rolling_terrain/dem.tif", 8.0, 60.0),
        Model(
            "uint16 centimetres", folder / "uint16_centimetres/small_dem_3m_merged.tif", 15.0, 120.0,
            declared_scale=0.01, height_scale=0.01,
        ),
        Model("autzen, feet", folder / "autzen_feet/autzen_dsm_5ft.tif", 10.0, 50.0, height_scale=FOOT_M),
        Model("landslide", folder / "landslide/pre_runout_DEM.asc", **depth),
        Model("landslide, difference", folder / "landslide/DEM_of_Difference.asc", **depth),
        Model("landslide, depth", folder / "landslide/landslide_depth.asc", **depth),
    ]  # fmt: skip
    listed = {model.path for model in models}
    missing = [path for path in folder.glob("*/*") if path.suffix in (".tif", ".asc") and path not in listed]
    if missing:
        raise FileNotFoundError(f"Models that no proof is made over: {missing}")
    return models


def seeded(folder: Path, kind: str, seed: int) -> Model:
    """Rough hills with masts, and holes of all sizes, on one kind of grid."""
    crs, affine = GRIDS[kind]
    heights = rough_hills(seed)
    path = folder / f"{kind}-{seed}.tif"
    shape = {"height": heights.shape[0], "width": heights.shape[1], "count": 1, "dtype": "float32"}
    with rasterio.open(path, "w", driver="GTiff", crs=crs, transform=affine, nodata=np.nan, **shape) as file:
        file.write(heights, 1)
        file.units = ("m",)
    return Model(kind, path, 6.0, 30.0)


def rough_hills(seed: int) -> F32:
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:130, :150]
    phase = random.uniform(0, 6, 2)
    z = 100 + 6 * np.sin(x / 23 + phase[0]) + 5 * np.cos(y / 17 + phase[1]) + random.normal(0, 0.3, x.shape)
    for row, column in random.integers(2, 128, (10, 2)):
        z[row, column] += random.uniform(3, 15)
    for row, column, side in random.integers(2, (122, 140, 6), (8, 3)):
        z[row : row + side, column : column + side] = np.nan
    return z.astype(np.float32)
