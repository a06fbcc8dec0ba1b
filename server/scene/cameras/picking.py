"""What a click in the 3D view hits: a point of interest, a mark of the fence, known or unknown terrain, or nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from mapping.geometry.arrays import F64
from planning.terrain.raycast import TerrainHit, raycast
from server.scene.cameras.projection import SCREEN_HEIGHT_PX
from server.scene.geometry.stage import Drawing, as_model
from server.scene.layers.fence_layer import mark_places
from server.scene.layers.mark_layers import poi_places

_POI_REACH_PX = 18.0


@dataclass(frozen=True, slots=True)
class MarkHit:
    mark: str


@dataclass(frozen=True, slots=True)
class PlaceHit:
    lat_deg: float
    lon_deg: float
    known: bool


def pick(drawing: Drawing, origin: F64, direction: F64, *, fov_rad: float) -> MarkHit | PlaceHit | None:
    """``origin`` and ``direction`` are the ray of sight, scene coordinates.

    Marks are hit only with the select tool: other tools place things, also beside a point.
    """
    ray = direction / np.linalg.norm(direction)
    frame = drawing.frame
    hit = _touched(drawing, frame.model_from_scene(origin), frame.model_direction(ray))
    if drawing.state.selection.tool == "select":
        mark = _mark_under(drawing, origin, ray, math.inf if hit is None else hit.distance, fov_rad)
        if mark is not None:
            return MarkHit(mark)
    if hit is None:
        return None
    lat_deg, lon_deg = drawing.dsm.lat_lon_from_xy(np.array([[hit.x_m, hit.y_m]]))[0]
    if not (math.isfinite(lat_deg) and math.isfinite(lon_deg)):
        return None
    return PlaceHit(float(lat_deg), float(lon_deg), hit.known)


def _touched(drawing: Drawing, origin_m: F64, direction: F64) -> TerrainHit | None:
    """The model at full resolution, or the plate that is drawn over a hole in it, whichever comes first."""
    floor_m = drawing.frame.floor_alt_dsm_m
    hit = raycast(drawing.dsm, origin_m, direction, floor_alt_dsm_m=floor_m)
    plate = raycast(as_model(drawing.plates, drawing.dsm), origin_m, direction, floor_alt_dsm_m=floor_m)
    if plate is not None and plate.known and (hit is None or plate.distance < hit.distance):
        return replace(plate, known=False)
    return hit


def _mark_under(drawing: Drawing, origin: F64, ray: F64, terrain_at: float, fov_rad: float) -> str | None:
    """The mark nearest to the ray on the screen, unless terrain stands well before it."""
    pois, fence = poi_places(drawing), mark_places(drawing)
    ids, places = pois[0] + fence[0], np.vstack([pois[1], fence[1]])
    if not ids:
        return None
    depth = (places - origin) @ ray
    aside = np.linalg.norm(places - origin - depth[:, None] * ray, axis=1)
    reach = depth * math.tan(fov_rad / 2) / (SCREEN_HEIGHT_PX / 2) * _POI_REACH_PX
    seen = (depth > 0) & (depth <= terrain_at + 6 * drawing.mark_m)
    misses = np.where(seen, aside / np.maximum(reach, 1.3 * drawing.mark_m), np.inf)
    best = int(np.argmin(misses))
    return ids[best] if misses[best] <= 1.0 else None
