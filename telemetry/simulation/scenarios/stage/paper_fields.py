"""Surface models of the papers' fields: level ground with a hill or two, and what is known of a ground."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.terrain.dsm import Dsm
from telemetry.simulation.scenarios.stage.scenes import Hill
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.topics.messages import GroundNotice

UTM_32N = 32632
HALF_M, CELL_M = 160.0, 0.5
KNOWN_SIGMA_M = 0.05
"""How well a surface model is known, cell by cell: drone photogrammetry reaches 0.023 m (Melita 2020)."""


def field(frame: NeuFrame, hills: tuple[Hill, ...]) -> Dsm:
    """Level ground around the frame's origin, at its height, with hills on it."""
    crs = CRS.from_epsg(UTM_32N)
    cells = round(2 * HALF_M / CELL_M)
    blank = _model(np.zeros((cells, cells)), 0.0, 0.0, crs)
    x, y = np.round(blank.xy_from_lat_lon(np.array([[frame.lat_deg, frame.lon_deg]]))[0])
    away = (np.arange(cells) + 0.5) * CELL_M - HALF_M
    up = np.full((cells, cells), frame.alt_amsl_m)
    for hill in hills:
        east, north = hill.at_m
        far_sq = (away[None, :] - east) ** 2 + (-away[:, None] - north) ** 2
        up += hill.height_m * np.exp(-far_sq / (2 * hill.width_m**2))
    return _model(up, float(x) - HALF_M, float(y) + HALF_M, crs)


def known(dsm: Dsm, random: np.random.Generator) -> Dsm:
    """What somebody has surveyed of it."""
    error = KNOWN_SIGMA_M * random.standard_normal(dsm.elevation_m.shape)
    return dsm.with_elevation((dsm.elevation_m + error).astype(np.float32))


def notice(dsm: Dsm, folder: Path) -> GroundNotice:
    """As the server tells perception of the surface model; its file lies in ``folder``."""
    path = folder / "known_ground.npy"
    np.save(path, dsm.elevation_m)
    west, _, _, north = dsm.bounds_m
    return GroundNotice(
        terrain_id="scenario",
        name="known ground",
        elevation_npy=str(path),
        crs_wkt=dsm.crs.to_wkt(),
        west_m=west,
        north_m=north,
        resolution_m=dsm.resolution_m,
        sha256=dsm.sha256,
    )


def _model(up_m: np.ndarray, west_m: float, north_m: float, crs: CRS) -> Dsm:
    heights = up_m.astype(np.float32)
    transform = Affine(CELL_M, 0.0, west_m, 0.0, -CELL_M, north_m)
    return Dsm(heights, transform, crs, "EGM2008 height", hashlib.sha256(heights.tobytes()).hexdigest())
