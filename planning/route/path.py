"""From points of interest to a path that is sampled densely along straight segments."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from mapping.geometry.arrays import F64, I64
from planning.basics.plan_model import PathParams, SampledPath
from planning.errors import ParameterError, PoiError
from planning.route.slopes import limited_heights
from planning.terrain.dsm import Dsm

SurfaceAt = Callable[[F64], F64]
MIN_SEGMENT_M = 0.01
MAX_SAMPLES = 2_000_000


def sampled_path(
    dsm: Dsm, surface_at: SurfaceAt | F64, vertices_xy_m: F64, vertex_poi: Sequence[int | None], params: PathParams
) -> SampledPath:
    """The path over the vertices: sampled, set on the safe surface, raised where that is too steep.

    Melita 2020, section 6. ``surface_at`` gives ``alt_dsm_m`` for (N, 2) projected metres, or is
    the (N,) array of heights for the samples of ``sample_segments``. With ``on_steep`` "slow"
    the path is the surface itself and the timing slows down. Raises ``PoiError`` where the
    surface is unknown.
    """
    xy_m, s_m, vertex = sample_segments(vertices_xy_m, params.step_m)  # Melita 2020, section 6
    if len(vertex_poi) != len(vertex):
        raise ParameterError(f"{len(vertex)} vertices came with {len(vertex_poi)} indices of points.")
    surface_m = np.asarray(surface_at(xy_m) if callable(surface_at) else surface_at, dtype=np.float64)
    if surface_m.shape != s_m.shape:
        raise ParameterError(f"The surface gave {surface_m.shape} heights for {len(s_m)} samples.")
    _refuse_unknown(dsm, xy_m, s_m, surface_m, vertex, vertex_poi)
    return SampledPath(
        xy_m=xy_m,
        s_m=s_m,
        surface_alt_dsm_m=surface_m,
        ground_alt_dsm_m=dsm.elevation_at(xy_m),
        alt_dsm_m=surface_m.copy() if params.on_steep == "slow" else limited_heights(s_m, surface_m, params),
        vertex=vertex,
        vertex_poi=tuple(vertex_poi),
    )


def sample_segments(vertices_xy_m: F64, step_m: float) -> tuple[F64, F64, I64]:
    """Samples every ``step_m`` along the segments and at their ends: xy (N, 2), s (N,), vertex (V,).

    A vertex shared by two segments is one sample. The last step of a segment is shorter.
    """
    if not (np.isfinite(step_m) and step_m > 0):
        raise ParameterError(f"The sampling step is {step_m} m.", advice="Give a positive step, 0.1 m as a rule.")
    corners = np.asarray(vertices_xy_m, dtype=np.float64).reshape(-1, 2)
    if len(corners) < 2:
        raise PoiError(f"A path needs at least two points, got {len(corners)}.", advice="Add a point.")
    lengths_m = np.hypot(*np.diff(corners, axis=0).T)
    _refuse_short(lengths_m)
    if lengths_m.sum() / step_m > MAX_SAMPLES:
        raise ParameterError(
            f"{lengths_m.sum():.0f} m sampled every {step_m} m are more than {MAX_SAMPLES} samples.",
            advice="Sample more coarsely or split the mission.",
        )
    along = [_steps(length, step_m) for length in lengths_m]
    starts_m = np.concatenate([[0.0], np.cumsum(lengths_m)])
    directions = np.diff(corners, axis=0) / lengths_m[:, None]
    xy = [corner + a[:, None] * d for corner, a, d in zip(corners[:-1], along, directions, strict=True)]
    s = [start + a for start, a in zip(starts_m[:-1], along, strict=True)]
    vertex = np.concatenate([[0], np.cumsum([len(a) for a in along])]).astype(np.int64)
    return np.concatenate([*xy, corners[-1:]]), np.concatenate([*s, starts_m[-1:]]), vertex


def _steps(length_m: float, step_m: float) -> F64:
    """Distances from a segment's start, its end left out; no step much shorter than the rounding of metres."""
    count = max(1, int(np.ceil(length_m / step_m - 1e-6)))
    return np.arange(count, dtype=np.float64) * step_m


def _refuse_short(lengths_m: F64) -> None:
    bad = np.flatnonzero(~(lengths_m >= MIN_SEGMENT_M))
    if bad.size:
        raise PoiError(
            f"Points {bad[0] + 1} and {bad[0] + 2} of the path are {lengths_m[bad[0]]:.3f} m apart.",
            advice=f"Delete one of them or move it at least {MIN_SEGMENT_M} m away.",
        )


def _refuse_unknown(
    dsm: Dsm, xy_m: F64, s_m: F64, surface_m: F64, vertex: I64, vertex_poi: Sequence[int | None]
) -> None:
    unknown = np.flatnonzero(~np.isfinite(surface_m))
    if not unknown.size:
        return
    first = int(unknown[0])
    segment = int(np.clip(np.searchsorted(vertex, first, side="right") - 1, 0, len(vertex) - 2))
    lat_deg, lon_deg = dsm.lat_lon_from_xy(xy_m[first])[0]
    names = " and ".join(_vertex_name(vertex_poi[i]) for i in (segment, segment + 1))
    raise PoiError(
        f"The terrain is unknown {s_m[first] - s_m[vertex[segment]]:.1f} m along"
        f" ({unknown.size} of {len(s_m)} samples of the path).",
        where=f"between {names}, at {lat_deg:.7f}, {lon_deg:.7f}",
        advice="Move the points so that the line between them stays on known terrain, or fill the holes.",
    )


def _vertex_name(poi: int | None) -> str:
    return "home" if poi is None else f"point {poi + 1}"
