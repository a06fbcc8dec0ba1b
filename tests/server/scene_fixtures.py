"""A small hill with a hole, and states of the 3D view over it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from affine import Affine
from pyproj import CRS

from planning.terrain.dsm import Dsm
from server.scene.geometry.payload import PlanScene, Relief, SceneState
from server.scene.geometry.terrain_payload import build_terrain_scene
from server.schemas import PlanDoc, PoiDoc, SelectionDoc, ViewDoc


def hill(hole: bool = True) -> Dsm:
    row, col = np.mgrid[0:60, 0:80]
    z = 100 + 20 * np.exp(-((row - 30) ** 2 + (col - 40) ** 2) / 300)
    if hole:
        z[10:20, 10:20] = np.nan
    return Dsm(
        elevation_m=z.astype(np.float32),
        transform=Affine(1.0, 0, 500_000, 0, -1.0, 4_000_000),
        crs=CRS.from_epsg(32633),
        vertical_datum=None,
        sha256="0" * 64,
    )


def pois(dsm: Dsm, *east_north_m: tuple[float, float]) -> list[PoiDoc]:
    xy = np.array([[500_000 + east, 4_000_000 - 60 + north] for east, north in east_north_m])
    places = dsm.lat_lon_from_xy(xy)
    return [PoiDoc(id=f"p{n}", lat_deg=lat, lon_deg=lon, name=f"P{n}") for n, (lat, lon) in enumerate(places, 1)]


def plan_over(dsm: Dsm, *, height_m: float = 5.0) -> PlanScene:
    """A straight flight from west to east over the hill's top."""
    x = np.linspace(500_005, 500_075, 71)
    xy = np.column_stack([x, np.full(71, 3_999_970.5)])
    ground = dsm.elevation_at(xy)
    path = np.column_stack([xy, ground + height_m])
    return PlanScene(
        safe_surface=Relief(path[[0, 35, 70]] + [[0, 0, 0], [0, 9.0, 0], [0, 0, 0]], np.array([[0, 2, 1]], np.uint32)),
        path_m=path,
        path_s_m=x - x[0],
        path_ground_alt_dsm_m=ground,
        flown_m=path[::10],
        flown_distance_m=np.full(7, height_m),
        worst_m=path[35],
        required_clearance_m=3.0,
        home_m=np.array([*xy[0], ground[0]]),
        takeoff_alt_dsm_m=float(path[0, 2]),
        around_m=np.empty((0, 3)),
        around=(),
    )


def state_over(dsm: Dsm, *, planned: bool = True) -> SceneState:
    document = PlanDoc(terrain_id="hill", pois=pois(dsm, (5, 30), (40, 30), (75, 30)))
    return SceneState(
        terrain=build_terrain_scene("hill", dsm, shading="height", orthophoto=None),
        plan=plan_over(dsm) if planned else None,
        plan_is_stale=False,
        document=document,
        selection=SelectionDoc(poi_id="p2"),
        view=ViewDoc(),
    )


def exaggerated(state: SceneState, times: float) -> SceneState:
    return replace(state, view=state.view.model_copy(update={"vertical_exaggeration": times}))
