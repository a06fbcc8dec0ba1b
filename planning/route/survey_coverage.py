"""What a survey's photos really see: over the surface model, from the line that is flown, not over flat ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba
import numpy as np
from skimage.draw import polygon2mask

from mapping.geometry.arrays import F32, F64, I64
from planning.basics.plan_model import Camera, FlownLine, MissionParams
from planning.route.camera import LOOKS_DOWN_DEG, footprint_m
from planning.route.survey import SurveyPlan
from planning.terrain.dsm import Dsm

MOST_CELLS = 200_000
"""Places of the area that are looked at; on a finer model each stands for a block of cells, at its highest one."""
AREA_SHARE = 0.95
"""Overlaps are those that at least this share of the area has."""
LEAST_SEEN_SHARE = 0.98
"""Of the area must be photographed: the edge of a roof hides a little behind it from every side."""
OVERLAP_TOLERANCE = 0.05
"""Overlap that slopes beside a line may cost."""
STEREO_OVERLAP = 0.5
"""From this front overlap on every place is meant to be on two photos."""


@dataclass(frozen=True, slots=True)
class SurveyCoverage:
    """Shares are of the polygon's area; what the surface model does not know counts as not photographed."""

    height_m: float
    """Above the surface: what lines and photos are spaced for."""
    area_m2: float
    photos: int
    photographed_share: float
    """On at least one photo, nothing in between."""
    twice_share: float
    """On at least two."""
    front_overlap: float
    """Between photos of a line, of 95 % of the area at least; negative: a gap, as a share of the footprint."""
    side_overlap: float
    """Between photos of neighbouring lines, likewise."""
    asked_front_overlap: float
    asked_side_overlap: float
    gsd_cm: float
    """Ground sampling distance (cm per pixel) that 95 % of the area has, or finer."""
    asked_gsd_cm: float
    gimbal_pitch_deg: float | None
    """The figures hold for -90, straight down."""

    def faults(self) -> tuple[str, ...]:
        """What was asked and is not so, in words; none where the survey gives what it promises."""
        texts = []
        if self.gimbal_pitch_deg != LOOKS_DOWN_DEG:
            texts.append("The camera does not look straight down: what it sees is not computed.")
        twice = self.asked_front_overlap >= STEREO_OVERLAP
        share, how = (self.twice_share, "twice") if twice else (self.photographed_share, "at all")
        if share < LEAST_SEEN_SHARE:
            texts.append(f"Only {share:.0%} of the area is photographed {how}.")
        for name, real, asked in (
            ("front", self.front_overlap, self.asked_front_overlap),
            ("side", self.side_overlap, self.asked_side_overlap),
        ):
            if real < asked - OVERLAP_TOLERANCE:
                texts.append(f"The {name} overlap is {max(real, 0.0):.0%} over the surface, {asked:.0%} were asked.")
        return tuple(texts)


def survey_coverage(
    dsm: Dsm, line: FlownLine, survey: SurveyPlan, camera: Camera, mission: MissionParams
) -> SurveyCoverage | None:
    """The photos taken along ``line`` against the surface model; None where the mission takes none.

    A photo is taken every ``camera_trigger_m`` metres over ground from the line's first point on, with the
    image's width across the nose. A place is on a photo when it lies within the image and nothing of the
    model stands in between. The real overlaps follow from the height of the nearest photo above the place.
    """
    if mission.camera_trigger_m is None:
        return None
    corners_m = dsm.xy_from_lat_lon(np.array(survey.polygon_lat_lon_deg))
    photos, directions = photo_places(line.points_m, mission.camera_trigger_m)
    headings = _headings(photos, directions, mission, dsm)
    across, along = footprint_m(camera, 1.0)
    reach_m = math.hypot(across, along) / 2 * max(0.0, float(photos[:, 2].max() - np.nanmin(dsm.elevation_m)))
    places = _places(dsm, corners_m, reach_m)
    seen, nearest = _look(places, np.column_stack([photos, headings]), across / 2, along / 2, reach_m)
    inside = places.inside
    above_m = photos[nearest[inside], 2] - places.top_m[inside].astype(np.float64)
    turned = headings[nearest[inside]] - directions[nearest[inside]]
    side_m, front_m = _chords(across, along, turned)
    known = np.isfinite(above_m)
    return SurveyCoverage(
        height_m=survey.height_m,
        area_m2=float(np.count_nonzero(inside)) * places.cell_m**2,
        photos=len(photos),
        photographed_share=float(np.mean(seen[inside] >= 1)),
        twice_share=float(np.mean(seen[inside] >= 2)),
        front_overlap=_least(1 - mission.camera_trigger_m / _positive(front_m * above_m), known),
        side_overlap=_least(1 - survey.line_spacing_m / _positive(side_m * above_m), known),
        asked_front_overlap=survey.front_overlap,
        asked_side_overlap=survey.side_overlap,
        gsd_cm=-_least(-across * above_m * 100 / camera.image_width_px, known),
        asked_gsd_cm=survey.gsd_cm,
        gimbal_pitch_deg=mission.gimbal_pitch_deg,
    )


def photo_places(points_m: F64, trigger_m: float) -> tuple[F64, F64]:
    """Places (P, 3) along the line every ``trigger_m`` over ground, and the flight's direction (P,) there.

    Directions are radians clockwise from grid north.
    """
    steps_m = np.hypot(*np.diff(points_m[:, :2], axis=0).T)
    legs = np.flatnonzero(steps_m > 0)
    if not legs.size:
        return points_m[:1], np.zeros(1)
    along_m = np.concatenate([[0.0], np.cumsum(steps_m[legs])])
    at_m = np.arange(0.0, along_m[-1], trigger_m)
    on = np.searchsorted(along_m, at_m, side="right") - 1
    start, step = points_m[legs[on]], points_m[legs[on] + 1] - points_m[legs[on]]
    share = (at_m - along_m[on]) / steps_m[legs[on]]
    return start + share[:, None] * step, np.arctan2(step[:, 0], step[:, 1])


@dataclass(frozen=True, slots=True)
class _Places:
    """Squares of the area and of what may stand between it and a camera."""

    top_m: F32
    """(H, W) highest known cell of each square, alt_dsm; -inf where all of it is unknown."""
    inside: np.ndarray
    """(H, W) bool: whether its centre lies within the polygon."""
    west_m: float
    north_m: float
    cell_m: float


def _places(dsm: Dsm, corners_m: F64, reach_m: float) -> _Places:
    west, south = corners_m.min(axis=0)
    east, north = corners_m.max(axis=0)
    res = dsm.resolution_m
    block = max(1, math.ceil(math.sqrt((east - west) * (north - south) / MOST_CELLS) / res))
    row0 = max(0, math.floor((dsm.transform.f - north - reach_m) / res))
    col0 = max(0, math.floor((west - reach_m - dsm.transform.c) / res))
    row1 = math.ceil((dsm.transform.f - south + reach_m) / res)
    col1 = math.ceil((east + reach_m - dsm.transform.c) / res)
    part = dsm.window(row0, col0, row1 - row0, col1 - col0)
    left, _, _, top = part.bounds_m
    top_m = _highest(part.elevation_m, block)
    cell_m = block * res
    rows_columns = np.column_stack([(top - corners_m[:, 1]) / cell_m, (corners_m[:, 0] - left) / cell_m]) - 0.5
    return _Places(top_m, polygon2mask(top_m.shape, rows_columns), left, top, cell_m)


def _highest(elevation_m: F32, block: int) -> F32:
    """Highest cell of each block of ``block`` x ``block``, row by row: a copy of all may not fit into memory."""
    height, width = elevation_m.shape
    starts = np.arange(0, width, block)
    rows = [
        np.maximum.reduceat(np.nan_to_num(elevation_m[r : r + block], nan=-np.inf).max(axis=0), starts)
        for r in range(0, height, block)
    ]
    return np.array(rows, dtype=np.float32)


def _headings(photos: F64, directions: F64, mission: MissionParams, dsm: Dsm) -> F64:
    """Where the nose points at each photo, radians clockwise from grid north."""
    if mission.heading == "fixed":
        return np.full(len(photos), math.radians(mission.heading_deg))
    if mission.heading == "point" and mission.look_at is not None:
        to_m = dsm.xy_from_lat_lon(np.array([mission.look_at]))[0] - photos[:, :2]
        return np.arctan2(to_m[:, 0], to_m[:, 1])
    return directions


def _chords(across: float, along: float, turned_rad: F64) -> tuple[F64, F64]:
    """How far an image reaches across and along the flight, per metre of height, when the nose points beside it."""
    c, s = np.maximum(np.abs(np.cos(turned_rad)), 1e-12), np.maximum(np.abs(np.sin(turned_rad)), 1e-12)
    return np.minimum(across / c, along / s), np.minimum(along / c, across / s)


def _positive(length_m: F64) -> F64:
    """A camera below the place sees nothing of it: the overlap becomes minus infinity."""
    return np.where(length_m > 0, length_m, 1e-300)


def _least(values: F64, known: np.ndarray) -> float:
    """What ``AREA_SHARE`` of the known places have at least."""
    return float(np.quantile(values[known], 1 - AREA_SHARE, method="lower")) if known.any() else -math.inf


def _look(places: _Places, photos: F64, half_across: float, half_along: float, reach_m: float) -> tuple[I64, I64]:
    """(number of photos that see each place, index of the photo nearest to it over ground)."""
    bin_m = max(reach_m, places.cell_m)
    columns, rows = (np.floor((photos[:, k] - low) / bin_m).astype(np.int64) for k, low in _corner(photos))
    wide = int(columns.max()) + 1
    key = rows * wide + columns
    order = np.argsort(key, kind="stable")
    first = np.searchsorted(key[order], np.arange((int(rows.max()) + 1) * wide + 1))
    west_m, south_m = (low for _, low in _corner(photos))
    return _count(
        places.top_m,
        places.inside,
        (places.west_m, places.north_m, places.cell_m),
        photos[order],
        order,
        first,
        (west_m, south_m, bin_m, wide),
        (half_across, half_along),
    )


def _corner(photos: F64) -> list[tuple[int, float]]:
    return [(k, float(photos[:, k].min())) for k in (0, 1)]


@numba.njit(parallel=True, cache=True)
def _count(top_m, inside, grid, photos, order, first, bins, half):
    """For each place inside: photos of the bins around it whose image holds it, with nothing in between."""
    west_m, north_m, cell_m = grid
    height, width = top_m.shape
    seen = np.zeros((height, width), dtype=np.int64)
    nearest = np.zeros((height, width), dtype=np.int64)
    bin_west_m, bin_south_m, bin_m, wide = bins
    high = (len(first) - 1) // wide
    for row in numba.prange(height):
        y = north_m - (row + 0.5) * cell_m
        bin_row = math.floor((y - bin_south_m) / bin_m)
        for col in range(width):
            if not inside[row, col]:
                continue
            x = west_m + (col + 0.5) * cell_m
            bin_col = math.floor((x - bin_west_m) / bin_m)
            best_m2, found = np.inf, False
            for b_row in range(max(0, bin_row - 1), min(high, bin_row + 2)):
                for b_col in range(max(0, bin_col - 1), min(wide, bin_col + 2)):
                    for k in range(first[b_row * wide + b_col], first[b_row * wide + b_col + 1]):
                        away_m2 = (x - photos[k, 0]) ** 2 + (y - photos[k, 1]) ** 2
                        if away_m2 < best_m2:
                            best_m2, found = away_m2, True
                            nearest[row, col] = order[k]
                        if _sees(top_m, grid, row, col, x, y, photos[k], half):
                            seen[row, col] += 1
            if not found:  # farther from every photo than any image reaches
                for k in range(len(photos)):
                    away_m2 = (x - photos[k, 0]) ** 2 + (y - photos[k, 1]) ** 2
                    if away_m2 < best_m2:
                        best_m2 = away_m2
                        nearest[row, col] = order[k]
    return seen, nearest


@numba.njit(cache=True)
def _sees(top_m, grid, row, col, x, y, photo, half):
    """Whether the place lies within the image, and the ray from it to the camera passes above all squares."""
    west_m, north_m, cell_m = grid
    z = top_m[row, col]
    above_m = photo[2] - z
    if not (above_m > 0 and above_m < np.inf):
        return False
    dx, dy = x - photo[0], y - photo[1]
    c, s = math.cos(photo[3]), math.sin(photo[3])
    if abs(dx * c - dy * s) > above_m * half[0] or abs(dx * s + dy * c) > above_m * half[1]:
        return False
    steps = math.ceil(math.hypot(dx, dy) / cell_m)
    for step in range(1, steps):
        share = step / steps
        r = math.floor((north_m - (y - dy * share)) / cell_m)
        q = math.floor((x - dx * share - west_m) / cell_m)
        if r < 0 or q < 0 or r >= top_m.shape[0] or q >= top_m.shape[1]:
            return True
        if top_m[r, q] > z + above_m * share:
            return False
    return True
