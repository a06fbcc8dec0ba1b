"""Flights with random errors over a surface model: how near the vehicle's middle comes to it on each.

The line is cut into pieces of at most ``STEP_M``; errors are drawn for their ends and change evenly in between. What
is off in the surface model moves the vehicle the other way. A piece that was moved by at most e comes at most e nearer
than it was, so that most pieces need not be looked at: what is found is exact for the moved line all the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from mapping.geometry.arrays import F64, I64
from planning.basics.plan_model import FlownLine
from planning.certificate.nearest import nearest_distances, segment_nearest, threads_for
from planning.certificate.pyramid import MaxPyramid, cells_pyramid
from planning.certificate.ways_home import places_along
from planning.risk.uncertain import UP, Uncertain
from planning.terrain.cells.cells import Layout
from planning.terrain.dsm import Dsm, true_cells

STEP_M = 0.5
"""Along the line, less than any error changes in."""


@dataclass(frozen=True, slots=True)
class RiskGround:
    """A flown line and the surface model that it is flown over, ready to be flown many times."""

    pyramid: MaxPyramid
    layout: Layout
    places_m: F64
    """(M, 3) along the line in the model's CRS, z up."""
    s_m: F64
    """(M,) horizontal distance flown up to each."""
    lengths_m: F64
    """(M - 1,) of the pieces between them, in space."""
    planned_m: F64
    """(M - 1,) distance of each piece to the surface model, without errors."""


@dataclass(frozen=True, slots=True)
class Closest:
    """How near each of some flights came."""

    distance_m: F64
    """(F,) of the vehicle's middle to the surface, 0 within it."""
    piece: I64
    """(F,) where: index into ``RiskGround.planned_m``."""


def risk_ground(dsm: Dsm, line: FlownLine, *, step_m: float = STEP_M) -> RiskGround:
    """``dsm``: with its small holes filled. Unknown cells and all outside are infinitely high."""
    cells = true_cells(dsm, line.points_m[:, :2])
    pyramid = cells_pyramid(cells)
    places_m, s_m = places_along(line.points_m, step_m)
    framed_m = cells.layout.in_frame(places_m)
    with threads_for(cells.elevation_m.size):
        planned_m, _ = nearest_distances(pyramid, framed_m[:-1], framed_m[1:])
    lengths_m = np.linalg.norm(np.diff(places_m, axis=0), axis=1)
    return RiskGround(pyramid, cells.layout, places_m, s_m, lengths_m, planned_m)


def fly(ground: RiskGround, uncertain: Uncertain, flights: range, seed: int) -> Closest:
    """Each flight's errors come from the seed and its own number alone."""
    distance_m, piece = np.empty(len(flights)), np.empty(len(flights), dtype=np.int64)
    for k, flight in enumerate(flights):
        moved_m = ground.places_m + errors_m(ground, uncertain, np.random.default_rng([seed, flight]))
        distance_m[k], piece[k] = _closest(ground, moved_m)
    return Closest(distance_m, piece)


def errors_m(ground: RiskGround, uncertain: Uncertain, random: np.random.Generator) -> F64:
    """(M, 3) east, north and up: by how much the vehicle is elsewhere over the model at each place of one flight."""
    out_m = np.zeros_like(ground.places_m)
    if uncertain.home_m is not None:
        out_m[:, UP] += random.uniform(*uncertain.home_m)
    for error in uncertain.errors:
        kept = np.exp(-ground.lengths_m / error.correlation_m)
        for axis in error.axes:
            _add_process(out_m, axis, error.sigma_m, kept, random)
    return out_m


def _add_process(out_m: F64, axis: int, sigma_m: float, kept: F64, random: np.random.Generator) -> None:
    if (kept == 1.0).all():
        out_m[:, axis] += sigma_m * random.standard_normal()
    else:
        _gauss_markov(out_m, axis, sigma_m, kept, random.standard_normal(len(kept) + 1))


@njit(cache=True, nogil=True)
def _gauss_markov(out_m, axis, sigma_m, kept, normal):
    """Adds x_k = r x_(k-1) + sqrt(1 - r^2) n_k, r the share that is kept, times sigma."""
    value = normal[0]
    out_m[0, axis] += sigma_m * value
    for k in range(kept.shape[0]):
        value = kept[k] * value + np.sqrt(1.0 - kept[k] * kept[k]) * normal[k + 1]
        out_m[k + 1, axis] += sigma_m * value


def _closest(ground: RiskGround, moved_m: F64) -> tuple[float, int]:
    pyramid = ground.pyramid
    return _closest_of(
        pyramid.elevation_m,
        pyramid.maxima_m,
        pyramid.layout,
        pyramid.lattice,
        pyramid.boxes_m,
        ground.layout.in_frame(moved_m),
        np.linalg.norm(moved_m - ground.places_m, axis=1),
        ground.planned_m,
    )


@njit(cache=True, nogil=True)
def _closest_of(elevation_m, maxima_m, layout, lattice, boxes_m, moved_m, away_m, planned_m):
    """(distance, piece): the piece that should come nearest is looked at first, others only if they may be nearer."""
    least = planned_m[0] - max(away_m[0], away_m[1])
    first = 0
    for k in range(planned_m.shape[0]):
        bound = planned_m[k] - max(away_m[k], away_m[k + 1])
        if bound < least:
            least, first = bound, k
    best, place = np.inf, first
    for at in range(-1, planned_m.shape[0]):
        k = first if at < 0 else at
        if planned_m[k] - max(away_m[k], away_m[k + 1]) >= best:
            continue
        a, d = moved_m[k], moved_m[k + 1] - moved_m[k]
        sq, _ = segment_nearest(elevation_m, maxima_m, layout, lattice, boxes_m, a[0], a[1], a[2], d[0], d[1], d[2])
        if np.sqrt(sq) < best:
            best, place = np.sqrt(sq), k
    return best, place
