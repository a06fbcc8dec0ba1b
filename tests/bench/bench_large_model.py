"""A country's model in one sparse file and in tiles: opening it, and a flight right across, by parts.

Wall-clock seconds and the largest memory of this process; decoders beside it are held to 1.5 GiB by their limits. Both
must give the same plan.
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import rasterio
from affine import Affine
from rasterio.windows import Window

from planning.basics.plan_model import Poi, SurfaceParams, VehicleProfile
from planning.ground.demo_hillside import small_hill
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.terrain.dsm import SurfaceModel
from planning.terrain.geotiff import open_dsm

SIDE_PX, CELL_M, TILE_PX = 20_000, 0.5, 2000
"""10 x 10 km of a model of 50 x 50 km."""
ROW0, ROWS = 8000, 2000
"""What is written of it: one row of tiles."""
PLACES_M = ((500.0, 5500.0), (3500.0, 5600.0), (6500.0, 5400.0), (9500.0, 5500.0))
_PROFILE: dict[str, Any] = {
    "driver": "GTiff", "count": 1, "dtype": "float32", "nodata": -9999.0, "crs": "EPSG:32633", "tiled": True,
    "blockxsize": 512, "blockysize": 512, "compress": "deflate", "predictor": 3, "SPARSE_OK": True,
}  # fmt: skip


def main() -> None:
    plan_mission(small_hill(), _request(small_hill(), ((30.0, 30.0), (90.0, 80.0))))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        found = [_measured(_one_file(folder / "model.tif"), "one file"), _measured(_tiles(folder / "tiles"), "tiles")]
    print(f"the same plan over both: {'yes' if found[0] == found[1] else 'NO'}")


def _measured(path: Path, what: str) -> tuple[float, float]:
    start_s = time.perf_counter()
    model = open_dsm(path)
    opened_s = time.perf_counter()
    plan = plan_mission(model, _request(model, PLACES_M))
    end_s = time.perf_counter()
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{SIDE_PX * SIDE_PX / 1e6:.0f} Mpx in {what}: opened in {opened_s - start_s:.2f} s, a flight of "
        f"{plan.path.s_m[-1] / 1000:.1f} km planned and certified in {end_s - opened_s:.2f} s, {peak_gb:.2f} GB at most"
    )
    return plan.certificate.min_distance_m, float(plan.line.points_m.sum())


def _request(model: SurfaceModel, places_m: tuple[tuple[float, float], ...]) -> PlanRequest:
    west, south, _, _ = model.bounds_m
    places = model.lat_lon_from_xy(np.array(places_m) + np.array([west, south]))
    profile = VehicleProfile("bench", position_error_m=0.1, rtl_height_m=60.0, max_items=2000)
    pois = tuple(Poi(lat, lon) for lat, lon in places.tolist())
    return PlanRequest(pois=pois, profile=profile, surface=SurfaceParams(radius_m=5.0))


def _one_file(path: Path) -> Path:
    transform = Affine(CELL_M, 0, 5e5, 0, -CELL_M, 4.17e6)
    with rasterio.open(path, "w", width=SIDE_PX, height=SIDE_PX, transform=transform, **_PROFILE) as file:
        window = Window(0, ROW0, SIDE_PX, ROWS)  # pyright: ignore[reportCallIssue]
        file.write(_heights(0, SIDE_PX), 1, window=window)
    return path


def _tiles(folder: Path) -> Path:
    folder.mkdir()
    for row in range(0, SIDE_PX, TILE_PX):
        for column in range(0, SIDE_PX, TILE_PX):
            transform = Affine(CELL_M, 0, 5e5 + column * CELL_M, 0, -CELL_M, 4.17e6 - row * CELL_M)
            path = folder / f"{row}_{column}.tif"
            with rasterio.open(path, "w", width=TILE_PX, height=TILE_PX, transform=transform, **_PROFILE) as file:
                if row == ROW0:
                    file.write(_heights(column, TILE_PX), 1)
    return folder


def _heights(column: int, columns: int) -> np.ndarray:
    east_m = np.arange(column, column + columns, dtype=np.float32) * np.float32(CELL_M)
    north_m = np.arange(ROWS, dtype=np.float32)[:, None] * np.float32(CELL_M)
    return (100 + 8 * np.sin(east_m / 40) + 6 * np.cos(north_m / 31)).astype(np.float32)


if __name__ == "__main__":
    main()
