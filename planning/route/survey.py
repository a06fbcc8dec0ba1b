"""A back-and-forth flight over a polygon, as points of interest; heights come from the terrain later."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polygons import area_m2, crossing_edges, extents
from planning.basics.plan_model import Camera, Poi
from planning.errors import ParameterError, PoiError
from planning.route.camera import footprint_m, height_from_gsd_m
from planning.route.camera import gsd_cm as gsd_at_height_cm
from planning.terrain.dsm import SurfaceModel

MIN_AREA_M2 = 1.0
MIN_LINE_M = 0.5
MAX_LINES = 2000


@dataclass(frozen=True, slots=True)
class SurveyPlan:
    """Where to fly and when to take photos."""

    pois: tuple[Poi, ...]
    """Start and end of each line, in flying order."""
    line_spacing_m: float
    trigger_distance_m: float
    height_m: float
    """Above the ground: the clearance at which the overlaps and ``gsd_cm`` hold."""
    gsd_cm: float
    angle_deg: float
    """Direction of the lines, clockwise from grid north, in [0, 180)."""
    lines: int
    polygon_lat_lon_deg: tuple[tuple[float, float], ...]
    """The area, as it was given."""
    side_overlap: float
    """Asked for, between neighbouring lines."""
    front_overlap: float
    """Asked for, between photos of a line."""
    row_of: tuple[int, ...] = ()
    """For each start and end in ``pois``: which line they belong to, from 0; one of a concave polygon has several."""


def survey_lines(
    polygon_lat_lon: F64 | Sequence[tuple[float, float]],
    dsm: SurfaceModel,
    *,
    camera: Camera | None,
    side_overlap: float,
    front_overlap: float,
    gsd_cm: float | None = None,
    height_m: float | None = None,
    angle_deg: float | None = None,
) -> SurveyPlan:
    """Parallel lines that cover the polygon (N, 2) of degrees.

    Melita 2020, eq. 1 gives the height from the ground sampling distance (give one of the two);
    spacing and trigger distance are the footprint less the overlap (shares in [0, 1)). The lines
    lie evenly, at most that spacing apart, and are as long as the polygon is anywhere in the strip that
    they cover: every place of it lies within half a spacing beside a line. ``angle_deg`` None takes the
    edge direction with the fewest turns. In a concave polygon a line may have several parts.
    Raises ``PoiError`` for an unusable polygon or unknown terrain.
    """
    if camera is None:
        raise ParameterError("A survey needs a camera.", advice="Give the vehicle profile a [camera] table.")
    height = _height(camera, gsd_cm, height_m)
    across_m, along_m = footprint_m(camera, height)
    widest_m = across_m * (1 - _overlap("side", side_overlap))
    trigger_m = along_m * (1 - _overlap("front", front_overlap))
    corners = _corners(polygon_lat_lon, dsm)
    angle = _fewest_turns(corners, widest_m) if angle_deg is None else _finite_angle(angle_deg)
    turned = corners @ turn(angle).T
    count = _line_count(turned, widest_m)
    borders_m = strip_borders_m(turned, count)
    spacing_m = float(borders_m[-1] - borders_m[0]) / count
    turned_ends, row_of = _back_and_forth(turned, borders_m)
    ends = turned_ends @ turn(angle)
    _refuse_unknown(ends, dsm)
    return SurveyPlan(
        pois=_pois(ends, dsm),
        line_spacing_m=spacing_m,
        trigger_distance_m=trigger_m,
        height_m=height,
        gsd_cm=gsd_at_height_cm(camera, height),
        angle_deg=angle,
        lines=count,
        polygon_lat_lon_deg=tuple((float(lat), float(lon)) for lat, lon in np.reshape(polygon_lat_lon, (-1, 2))),
        side_overlap=side_overlap,
        front_overlap=front_overlap,
        row_of=row_of,
    )


def turn(angle_deg: float) -> F64:
    """Rotation (2, 2) that lays a line with this angle clockwise from north along x."""
    c, s = math.cos(math.radians(90 - angle_deg)), math.sin(math.radians(90 - angle_deg))
    return np.array([[c, s], [-s, c]])


def strip_borders_m(turned_m: F64, lines: int) -> F64:
    """(L + 1,) y of the borders of the strips that lines along x cover, of corners (N, 2) laid along x."""
    return np.linspace(float(turned_m[:, 1].min()), float(turned_m[:, 1].max()), lines + 1)


def _height(camera: Camera, gsd_cm: float | None, height_m: float | None) -> float:
    if (gsd_cm is None) == (height_m is None):
        raise ParameterError(
            "A survey takes either a ground sampling distance or a height.", advice="Give exactly one of the two."
        )
    if gsd_cm is not None:
        return height_from_gsd_m(camera, gsd_cm)
    return float(height_m or 0.0)


def _overlap(name: str, share: float) -> float:
    if not 0 <= share < 0.99:
        raise ParameterError(f"The {name} overlap is {share}.", advice="Give a share from 0 to 0.98, e.g. 0.7.")
    return share


def _finite_angle(angle_deg: float) -> float:
    if not math.isfinite(angle_deg):
        raise ParameterError(f"The angle is {angle_deg} degrees.", advice="Give degrees clockwise from north.")
    return angle_deg % 180.0


def _corners(polygon_lat_lon: F64 | Sequence[tuple[float, float]], dsm: SurfaceModel) -> F64:
    degrees = np.asarray(polygon_lat_lon, dtype=np.float64).reshape(-1, 2)
    if len(degrees) > 1 and np.array_equal(degrees[0], degrees[-1]):
        degrees = degrees[:-1]
    if len(degrees) < 3:
        raise PoiError(f"A polygon has at least three corners, this one has {len(degrees)}.", advice="Add corners.")
    corners = dsm.xy_from_lat_lon(degrees)
    if not np.isfinite(corners).all():
        bad = int(np.flatnonzero(~np.isfinite(corners).all(axis=1))[0])
        raise PoiError(
            f"Corner {bad + 1} of the polygon is at {degrees[bad, 0]}, {degrees[bad, 1]}.",
            advice="Give latitude, then longitude, in degrees.",
        )
    if (crossing := crossing_edges(corners)) is not None:
        raise PoiError(
            f"The polygon crosses itself: the edges after corners {crossing[0] + 1} and {crossing[1] + 1} meet.",
            advice="Move a corner so that the outline does not cross itself.",
        )
    if (area := area_m2(corners)) < MIN_AREA_M2:
        raise PoiError(f"The polygon covers {area:.2f} m².", advice=f"Draw at least {MIN_AREA_M2:g} m².")
    return corners


def _fewest_turns(corners: F64, widest_m: float) -> float:
    """Direction of the edge along which the fewest lines are needed; of equals the longest edge."""
    edges = np.roll(corners, -1, axis=0) - corners
    angles = np.degrees(np.arctan2(edges[:, 0], edges[:, 1])) % 180.0
    lengths = np.hypot(*edges.T)
    counts = [_line_count(corners @ turn(a).T, widest_m, limit=False) for a in angles]
    best = min(range(len(angles)), key=lambda i: (counts[i], -lengths[i]))
    return float(angles[best])


def _line_count(turned: F64, widest_m: float, *, limit: bool = True) -> int:
    count = max(1, math.ceil(float(np.ptp(turned[:, 1])) / widest_m - 1e-9))
    if limit and count > MAX_LINES:
        raise ParameterError(
            f"The survey would need {count} lines {widest_m:.2f} m apart.",
            advice="Draw a smaller polygon, fly higher, or ask for less overlap.",
        )
    return count


def _back_and_forth(turned: F64, borders_m: F64) -> tuple[F64, tuple[int, ...]]:
    """Ends (N, 2) of the lines through the middle of the strips between neighbouring borders, each pair's strip."""
    ends: list[tuple[float, float]] = []
    rows: list[int] = []
    for row, (low, high) in enumerate(pairwise(borders_m.tolist())):
        parts = [_flyable(*part) for part in extents(turned, low, high)]
        xs = [x for part in parts for x in part]
        ends.extend((x, (low + high) / 2) for x in (reversed(xs) if row % 2 else xs))
        rows += [row] * len(parts)
    return np.array(ends, dtype=np.float64).reshape(-1, 2), tuple(rows)


def _flyable(left_m: float, right_m: float) -> tuple[float, float]:
    """The interval, lengthened about its middle where it is too short to be a line."""
    spare_m = max(0.0, MIN_LINE_M - (right_m - left_m)) / 2
    return left_m - spare_m, right_m + spare_m


def _refuse_unknown(ends: F64, dsm: SurfaceModel) -> None:
    """The legs between lines count too: they are flown as well."""
    for i, (a, b) in enumerate(pairwise(ends)):
        length_m = float(np.hypot(*(b - a)))
        along = np.linspace(0.0, 1.0, max(2, math.ceil(length_m / max(dsm.resolution_m, 0.25)) + 1))
        points = a + along[:, None] * (b - a)
        unknown = np.flatnonzero(np.isnan(dsm.elevation_at(points)))
        if unknown.size:
            lat_deg, lon_deg = dsm.lat_lon_from_xy(points[unknown[0]])[0]
            part = f"line {i // 2 + 1}" if i % 2 == 0 else f"the way from line {i // 2 + 1} to the next"
            raise PoiError(
                f"The terrain is unknown {along[unknown[0]] * length_m:.1f} m along {part}.",
                where=f"survey at {lat_deg:.7f}, {lon_deg:.7f}",
                advice="Draw the polygon on known terrain, or turn the lines with another angle.",
            )


def _pois(ends: F64, dsm: SurfaceModel) -> tuple[Poi, ...]:
    degrees = dsm.lat_lon_from_xy(ends)
    names = (f"line {i // 2 + 1} {'end' if i % 2 else 'start'}" for i in range(len(ends)))
    return tuple(Poi(float(lat), float(lon), name) for (lat, lon), name in zip(degrees, names, strict=True))
