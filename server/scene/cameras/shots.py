"""The views that a page's camera can be sent to."""

from __future__ import annotations

from typing import Literal

import numpy as np

from mapping.geometry.arrays import F64
from server.scene.cameras.projection import OBLIQUE, TOP, Pose, fitted
from server.scene.geometry.stage import Drawing

Target = Literal["terrain", "plan", "top", "worst", "poi", "chase"]

_OUTLINE_CELLS = 40
_CLOSE_UP = 0.16
"""Half the side of a close-up, in half diagonals of the model."""


def shot(drawing: Drawing, target: Target, *, aspect: float) -> Pose:
    """What cannot be shown (no plan, nothing selected) gives way to the terrain; what is chased, to the plan."""
    points = _points(drawing, target)
    return fitted(points, TOP if target == "top" else OBLIQUE, aspect=aspect)


def _points(drawing: Drawing, target: Target) -> F64:
    plan, points = drawing.state.plan, None
    if target in ("plan", "chase"):
        points = _plan_points(drawing)
    elif target == "worst" and plan is not None and np.isfinite(plan.worst_m).all():
        points = _around(drawing, drawing.frame.scene_from_model(plan.worst_m))
    elif target == "poi":
        chosen = [poi for poi in drawing.state.document.pois if poi.id == drawing.state.selection.poi_id]
        place = drawing.ground_of(chosen[0]) if chosen else None
        points = None if place is None else _around(drawing, place)
    return terrain_points(drawing) if points is None else points


def terrain_points(drawing: Drawing) -> F64:
    """(N, 3) a thinned outline of the known terrain."""
    grid = drawing.terrain.grid
    every = max(1, max(grid.alt_dsm_m.shape) // _OUTLINE_CELLS)
    row, col = np.nonzero(np.isfinite(grid.alt_dsm_m[::every, ::every]))
    row, col = row * every, col * every
    x_m, y_m = grid.west_m + (col + 0.5) * grid.cell_m, grid.north_m - (row + 0.5) * grid.cell_m
    if not len(row):
        return _around(drawing, np.zeros(3))
    return drawing.frame.scene_from_model(np.column_stack([x_m, y_m, grid.alt_dsm_m[row, col]]).astype(np.float64))


def _plan_points(drawing: Drawing) -> F64 | None:
    """The flight, or the points placed so far; with air around it."""
    plan, review = drawing.state.plan, drawing.state.review
    if review is not None:
        points = drawing.frame.scene_from_model(np.vstack([review.planned_m, review.flown_m]))
    elif plan is not None and len(plan.path_m):
        points = drawing.frame.scene_from_model(np.vstack([plan.path_m, plan.home_m]))
    else:
        points = drawing.on_ground(drawing.places_xy_m(drawing.state.document.pois))
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return None
    return np.vstack([_around(drawing, points.min(axis=0), 0.05), _around(drawing, points.max(axis=0), 0.05)])


def _around(drawing: Drawing, centre: F64, share: float = _CLOSE_UP) -> F64:
    reach = share * drawing.frame.half_diagonal_m
    return centre + reach * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-0.5, 0.5)])
