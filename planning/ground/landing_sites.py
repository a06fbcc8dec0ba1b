"""Where to land: the best places near a point, from the traversability map before any foliage was cleared from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mapping.geometry.arrays import F32, F64, Bools
from mapping.traversability import Traversability
from planning.errors import ParameterError
from planning.ground.islands import Islands

FARTHEST_OBSTACLE_M = 30.0
"""Beyond this it makes no difference how far the nearest obstacle is, and nobody looks."""
CAUTION = "Water, low crops and large roofs look level too: look before landing."
"""What heights alone cannot tell; to be said wherever sites are."""


@dataclass(frozen=True, slots=True)
class LandingParams:
    """What a place needs; the two rotor spans are the safe distance."""

    rotor_spans: float = 2.0
    """From the middle of the place to the nearest obstacle, at least."""
    steepest_rad: float = math.radians(10.0)
    roughest_m: float = 0.05
    sites: int = 5
    apart_m: float = 5.0
    """Between the middles of two proposals, at least; or twice the distance kept from obstacles where that is more."""


@dataclass(frozen=True, slots=True)
class LandingSite:
    """A place to land; slope and roughness are the largest within one rotor span of its middle."""

    rank: int
    row: int
    col: int
    distance_m: float
    """From the point that was asked about."""
    slope_rad: float
    roughness_m: float
    obstacle_distance_m: float
    """To the rim of the nearest untraversable or unknown cell, at most ``FARTHEST_OBSTACLE_M``."""
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LandingSites:
    """Best first; ``no_site`` says why there is none, and is empty otherwise."""

    sites: tuple[LandingSite, ...]
    no_site: str = ""


@dataclass(frozen=True, slots=True)
class _Area:
    """The part of the map around the point; all (rows, cols)."""

    row0: int
    col0: int
    distance_m: F64
    obstacle_m: F64
    slope_rad: F64
    roughness_m: F64
    known: Bools


def landing_sites(
    traversability: Traversability,
    near_cell: tuple[float, float],
    rotor_span_m: float,
    radius_m: float,
    params: LandingParams | None = None,
) -> LandingSites:
    """The best places within ``radius_m`` of a point, as fractional (row, col); k + 0.5 is the middle of cell k.

    ``traversability`` is the map BEFORE clearing: foliage that a rover may drive through is an obstacle to a rotor, and
    so are unknown cells and everything outside the map. Roofs, hedges and crowns are left out where they are islands
    above what surrounds them; ``CAUTION`` says what is not. Raises ParameterError for lengths that make no sense.
    """
    params = params or LandingParams()
    _check(near_cell, rotor_span_m, radius_m)
    safe_m = params.rotor_spans * rotor_span_m
    area = _area_around(traversability, near_cell, radius_m, rotor_span_m)
    if area is None or not (area.known & (area.distance_m <= radius_m)).any():
        return LandingSites(
            (), f"The ground within {radius_m:g} m of this point is unknown: no model, no landing site."
        )
    fits = _fitting(area, radius_m, safe_m, params)
    if not fits.any():
        return LandingSites((), _why_none(area, radius_m, safe_m, params))
    cost = np.where(fits, _cost(area, radius_m, safe_m, params), np.inf)
    cells = _best_apart(cost, area, Islands(traversability), traversability.resolution_m, safe_m, params)
    if not cells:
        return LandingSites(
            (),
            f"All level ground within {radius_m:g} m stands above what is around it, "
            "as roofs, hedges and tree tops do.",
        )
    return LandingSites(tuple(_site(rank, area, cell, safe_m) for rank, cell in enumerate(cells, 1)))


def _check(near_cell: tuple[float, float], rotor_span_m: float, radius_m: float) -> None:
    for name, value in (("rotor_span_m", rotor_span_m), ("radius_m", radius_m)):
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"{value:g} m is no length.", where=name, advice="Give metres above 0.")
    if not all(math.isfinite(number) for number in near_cell):
        raise ParameterError(f"The place {near_cell} is not on any map.", where="near")


def _area_around(
    traversability: Traversability, near_cell: tuple[float, float], radius_m: float, touchdown_m: float
) -> _Area | None:
    """None where the circle misses the map."""
    cell_m = traversability.resolution_m
    reach = (radius_m + max(touchdown_m, FARTHEST_OBSTACLE_M)) / cell_m + 1
    rows, cols = traversability.index.shape
    r0, r1 = max(0, math.floor(near_cell[0] - reach)), min(rows, math.ceil(near_cell[0] + reach))
    c0, c1 = max(0, math.floor(near_cell[1] - reach)), min(cols, math.ceil(near_cell[1] + reach))
    if r0 >= r1 or c0 >= c1:
        return None
    cut = np.s_[r0:r1, c0:c1]
    index = traversability.index[cut]
    blocked = ~(index < traversability.untraversable_index)
    down, right = np.arange(r0, r1) + 0.5 - near_cell[0], np.arange(c0, c1) + 0.5 - near_cell[1]
    touchdown = _disc(touchdown_m / cell_m)
    return _Area(
        r0,
        c0,
        np.hypot(down[:, None], right[None, :]) * cell_m,
        _obstacle_distance(blocked, (r0 == 0, r1 == rows, c0 == 0, c1 == cols), cell_m),
        _largest(traversability.slope_rad[cut], touchdown),
        _largest(traversability.roughness_m[cut], touchdown),
        np.isfinite(index),
    )


def _obstacle_distance(blocked: Bools, at_rim: tuple[bool, bool, bool, bool], cell_m: float) -> F64:
    """Metres from each cell's middle to the nearest blocked cell's rim, rather too short; the map's end is blocked."""
    top, bottom, left, right = at_rim
    padded = np.pad(blocked, ((int(top), int(bottom)), (int(left), int(right))), constant_values=True)
    if not padded.any():
        return np.full(blocked.shape, FARTHEST_OBSTACLE_M)
    whole = np.asarray(ndimage.distance_transform_edt(~padded))
    away = whole[int(top) :, int(left) :][: blocked.shape[0], : blocked.shape[1]]
    # The farthest corner of the blocked cell is half a diagonal nearer than its middle.
    return np.clip((away - math.sqrt(0.5)) * cell_m, 0.0, FARTHEST_OBSTACLE_M)


def _disc(radius_px: float) -> Bools:
    half = max(0, math.ceil(radius_px))
    at = np.arange(-half, half + 1)
    return np.hypot(at[:, None], at[None, :]) <= max(radius_px, 0.5)


def _largest(layer: F32, disc: Bools) -> F64:
    known = np.where(np.isfinite(layer), layer, -np.inf)
    return ndimage.maximum_filter(known, footprint=disc, mode="nearest").astype(np.float64)


def _fitting(area: _Area, radius_m: float, safe_m: float, params: LandingParams) -> Bools:
    return (
        area.known
        & (area.distance_m <= radius_m)
        & (area.obstacle_m >= safe_m)
        & (area.slope_rad <= params.steepest_rad)
        & (area.roughness_m <= params.roughest_m)
    )


def _cost(area: _Area, radius_m: float, safe_m: float, params: LandingParams) -> F64:
    """Smaller is better: level, smooth, near, and with room to spare up to three times what is needed."""
    room = np.clip((area.obstacle_m / safe_m - 1.0) / 2.0, 0.0, 1.0)
    steep, rough = area.slope_rad / params.steepest_rad, area.roughness_m / params.roughest_m
    return steep + rough + (1.0 - room) + area.distance_m / radius_m


def _best_apart(
    cost: F64, area: _Area, islands: Islands, cell_m: float, safe_m: float, params: LandingParams
) -> list[tuple[int, int]]:
    """The cheapest cells on the ground, each far enough from all before it; ``cost`` is used up."""
    left = cost
    regions = islands.regions[area.row0 :, area.col0 :][: left.shape[0], : left.shape[1]]
    apart = max(params.apart_m, 2.0 * safe_m) / cell_m
    cells: list[tuple[int, int]] = []
    while len(cells) < params.sites:
        row, col = divmod(int(np.argmin(left)), left.shape[1])
        if not math.isfinite(left[row, col]):
            break
        if islands.stands_high(area.row0 + row, area.col0 + col):
            left[row, col] = np.inf
            left[regions == (regions[row, col] or -1)] = np.inf
            continue
        cells.append((row, col))
        down, right = np.arange(left.shape[0]) - row, np.arange(left.shape[1]) - col
        left[np.hypot(down[:, None], right[None, :]) < apart] = np.inf
    return cells


def _site(rank: int, area: _Area, cell: tuple[int, int], safe_m: float) -> LandingSite:
    slope_rad, roughness_m = float(area.slope_rad[cell]), float(area.roughness_m[cell])
    obstacle_m, distance_m = float(area.obstacle_m[cell]), float(area.distance_m[cell])
    return LandingSite(
        rank,
        area.row0 + cell[0],
        area.col0 + cell[1],
        distance_m,
        slope_rad,
        roughness_m,
        obstacle_m,
        _reasons(slope_rad, roughness_m, obstacle_m, distance_m, safe_m),
    )


def _reasons(
    slope_rad: float, roughness_m: float, obstacle_m: float, distance_m: float, safe_m: float
) -> tuple[str, ...]:
    if obstacle_m >= FARTHEST_OBSTACLE_M:
        room = f"No obstacle within {FARTHEST_OBSTACLE_M:g} m"
    else:
        room = f"{obstacle_m:.1f} m from the nearest obstacle ({safe_m:.1f} m needed)"
    return (
        f"Slope {math.degrees(slope_rad):.1f} deg",
        f"Uneven by {100 * roughness_m:.1f} cm",
        room,
        f"{distance_m:.0f} m from the point",
    )


def _why_none(area: _Area, radius_m: float, safe_m: float, params: LandingParams) -> str:
    """The first demand that nothing meets, in words."""
    near = area.known & (area.distance_m <= radius_m)
    away_m = float(area.obstacle_m[near].max())
    if away_m < safe_m:
        return (
            f"Nowhere within {radius_m:g} m is {safe_m:.1f} m (two rotor spans) from the nearest obstacle: "
            f"{away_m:.1f} m is the most. Vegetation that a rover may drive through counts as an obstacle."
        )
    level = near & (area.obstacle_m >= safe_m)
    slope_deg = math.degrees(float(area.slope_rad[level].min()))
    if slope_deg > math.degrees(params.steepest_rad):
        return (
            f"All ground within {radius_m:g} m that is clear of obstacles is too steep: {slope_deg:.1f} deg at least, "
            f"{math.degrees(params.steepest_rad):.0f} deg may be landed on."
        )
    return (
        f"All ground within {radius_m:g} m that is clear of obstacles is steeper than "
        f"{math.degrees(params.steepest_rad):.0f} deg or rougher than {100 * params.roughest_m:.0f} cm."
    )
