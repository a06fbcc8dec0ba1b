"""Whether points of interest can be flown over, and in which order it is shortest."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mapping.geometry.arrays import F64
from planning.basics.limits import LONGEST_LOITER_S
from planning.basics.plan_model import Poi
from planning.errors import PoiError
from planning.terrain.dsm import Dsm, SurfaceModel

MIN_APART_M = 0.1
Bounds = tuple[float, float, float, float]
"""West, south, east, north; projected metres."""


def check_pois(
    pois: Sequence[Poi],
    dsm: SurfaceModel,
    surface: Dsm | None = None,
    *,
    at_least: int = 2,
    bounds_m: Bounds | None = None,
) -> F64:
    """Projected metres (N, 2) of the points, or ``PoiError`` listing every problem at once.

    With ``surface`` a point must also lie where the safe surface is known. ``bounds_m`` are those of the whole model
    where ``dsm`` is a part of it.
    """
    bounds = bounds_m or dsm.bounds_m
    problems = [] if len(pois) >= at_least else [_too_few(len(pois), at_least)]
    degrees = np.array([(poi.lat_deg, poi.lon_deg) for poi in pois], dtype=np.float64).reshape(-1, 2)
    sound = np.array([_range_problem(poi) is None for poi in pois], dtype=bool)
    xy_m = np.full((len(pois), 2), np.nan)
    xy_m[sound] = dsm.xy_from_lat_lon(degrees[sound])
    for i, poi in enumerate(pois):
        if problem := _range_problem(poi) or _place_problem(poi, xy_m[i], dsm, surface, bounds):
            problems.append(f"{poi_label(i, poi)}: {problem}")
    problems += _too_close(pois, xy_m)
    if problems:
        raise PoiError(" ".join(problems), where="points of interest" if len(problems) > 1 else "")
    return xy_m


def poi_label(index: int, poi: Poi) -> str:
    """As errors call it."""
    return f'Point {index + 1} "{poi.name}"' if poi.name else f"Point {index + 1}"


def _too_few(count: int, at_least: int) -> str:
    return f"A path needs at least {at_least} points, there {'is' if count == 1 else 'are'} {count}: add some."


def _range_problem(poi: Poi) -> str | None:
    if not (math.isfinite(poi.lat_deg) and math.isfinite(poi.lon_deg)):
        return f"latitude {poi.lat_deg} and longitude {poi.lon_deg} are no numbers: give degrees."
    if not (abs(poi.lat_deg) <= 90 and abs(poi.lon_deg) <= 180):
        hint = "they look swapped" if abs(poi.lat_deg) <= 180 and abs(poi.lon_deg) <= 90 else "give degrees"
        return f"latitude {poi.lat_deg} or longitude {poi.lon_deg} is out of range: {hint}."
    if not 0 <= poi.loiter_s <= LONGEST_LOITER_S:
        return f"the loiter time is {poi.loiter_s:g} s: give zero or more seconds, at most {LONGEST_LOITER_S:,.0f}."
    return None


def _place_problem(poi: Poi, xy_m: F64, dsm: SurfaceModel, surface: Dsm | None, bounds: Bounds) -> str | None:
    if not _inside(bounds, xy_m):
        place = f"{poi.lat_deg:.7f}, {poi.lon_deg:.7f} lies outside the surface model"
        if _lands_when_swapped(poi, dsm, bounds):
            return f"{place}, but swapped it lies on it: give the latitude first."
        return f"{place}: move it onto the model or take the model of this place."
    if not math.isfinite(dsm.elevation_at(xy_m)[0]):
        return f"{poi.lat_deg:.7f}, {poi.lon_deg:.7f} lies on unknown terrain: move it to a known place."
    if surface is not None and not math.isfinite(surface.elevation_at(xy_m)[0]):
        return f"the safe surface is unknown at {poi.lat_deg:.7f}, {poi.lon_deg:.7f}: move it further inside."
    return None


def _inside(bounds: Bounds, xy_m: F64) -> bool:
    west, south, east, north = bounds
    return bool(west <= xy_m[0] <= east and south <= xy_m[1] <= north)


def _lands_when_swapped(poi: Poi, dsm: SurfaceModel, bounds: Bounds) -> bool:
    if not (abs(poi.lon_deg) <= 90 and abs(poi.lat_deg) <= 180):
        return False
    return _inside(bounds, dsm.xy_from_lat_lon(np.array([[poi.lon_deg, poi.lat_deg]]))[0])


def _too_close(pois: Sequence[Poi], xy_m: F64) -> list[str]:
    apart_m = np.hypot(*np.diff(xy_m, axis=0).T) if len(xy_m) > 1 else np.empty(0)
    return [
        f"{poi_label(i, pois[i])} and {poi_label(i + 1, pois[i + 1])} are {apart_m[i]:.2f} m apart: delete one of them."
        for i in np.flatnonzero(apart_m < MIN_APART_M).tolist()
    ]
