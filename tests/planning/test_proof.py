"""Certificates against the slow proof of the exported file over the raster file, whatever its grid."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from affine import Affine
from numpy.typing import NDArray
from pyproj import Transformer

from planning.formats import wpl
from planning.geotiff import read_dsm
from planning.model import Poi, SurfaceParams, VehicleProfile
from planning.plan import plan_mission
from planning.request import PlanRequest
from tests.planning.geotiff_samples import write_raster
from tests.reference import proof

GRIDS = {
    "square": ("EPSG:32633", Affine(1, 0, 5e5, 0, -1, 4.17e6)),
    "degrees": ("EPSG:4326", Affine(1.1e-5, 0, 14.99, 0, -0.9e-5, 37.73)),
    "turned": ("EPSG:32633", Affine.translation(5e5, 4.17e6) @ Affine.rotation(27) @ Affine.scale(1, -1)),
    "oblong": ("EPSG:32633", Affine(0.7, 0, 5e5, 0, -1.3, 4.17e6)),
    "feet": ("EPSG:2994", Affine(3, 0, 640000, 0, -3, 850000)),
    "oblong in feet": ("EPSG:2994", Affine(3, 0, 640000, 0, -4, 850000)),
    "mirrored and sheared": ("EPSG:32633", Affine(-1, 0.2, 5e5, 0.1, -1.1, 4.17e6)),
    "untrue metres": ("EPSG:3857", Affine(1, 0, 1.67e6, 0, -1, 4.54e6)),
}
MOST_OVER_M, MOST_UNDER_M = 0.001, 0.01


def terrain(seed: int) -> NDArray[np.float32]:
    """Rough hills with a few masts, and holes of all sizes."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:110, :120]
    z = 100 + 6 * np.sin(x / 23) + 5 * np.cos(y / 17) + random.normal(0, 0.3, x.shape)
    for row, column in random.integers(2, 108, (8, 2)):
        z[row, column] += random.uniform(3, 15)
    for row, column, side in random.integers(2, (104, 104, 6), (7, 3)):
        z[row : row + side, column : column + side] = np.nan
    return z.astype(np.float32)


@pytest.mark.parametrize("kind", GRIDS)
def test_the_certificate_is_what_the_slow_proof_finds(tmp_path: Path, kind: str) -> None:
    crs, affine = GRIDS[kind]
    judged = 0
    for seed in (1, 2):
        heights = terrain(seed)
        path = write_raster(tmp_path / f"{seed}.tif", heights, crs=crs, transform=affine, nodata=np.nan, unit="m")
        random = np.random.default_rng(seed)
        places = random.integers(15, 95, (40, 2))
        known = [place for place in places if np.isfinite(heights[tuple(place)])][:3]
        to_degrees = Transformer.from_crs(crs, 4326, always_xy=True)
        lon_lat = [to_degrees.transform(*(affine @ (column + 0.4, row + 0.3))) for row, column in known]
        request = PlanRequest(
            pois=tuple(Poi(lat, lon) for lon, lat in lon_lat),
            profile=VehicleProfile("proof", position_error_m=0.1, rtl_height_m=60.0),
            surface=SurfaceParams(radius_m=6.0, height_m=2.5),
        )
        plan = plan_mission(read_dsm(path), request)
        ground = proof.read_ground(path)
        true_m = proof.clearance(ground, proof.mission_line(wpl.write_wpl(plan.mission), ground))
        over_m = plan.certificate.min_distance_m - true_m
        assert -MOST_UNDER_M <= over_m <= MOST_OVER_M
        judged += true_m > 0.0
    assert judged
