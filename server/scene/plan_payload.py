"""A finished plan as the arrays that the 3D view draws."""

from __future__ import annotations

import numpy as np

from planning.plan import Plan
from planning.surface import fit_within, safe_surface
from server.charts import thinned
from server.scene.payload import HeightGrid, PlanScene

_SURFACE_CELLS = 220
"""Per side at most: the safe surface is smooth, and the mesh must travel within half a second."""


def plan_scene(plan: Plan) -> PlanScene:
    path, line, worst = plan.path, plan.line, plan.certificate.worst
    keep = thinned(path.s_m, path.alt_dsm_m, must_keep=path.vertex)
    pois = [int(sample) for sample, poi in zip(path.vertex, path.vertex_poi, strict=True) if poi is not None]
    return PlanScene(
        safe_surface=_surface_grid(plan),
        path_m=np.column_stack([path.xy_m[keep], path.alt_dsm_m[keep]]),
        path_s_m=path.s_m[keep],
        path_ground_alt_dsm_m=path.ground_alt_dsm_m[keep],
        flown_m=line.points_m,
        flown_distance_m=np.array([leg.min_distance_m for leg in plan.certificate.legs]),
        worst_m=np.array([worst.x_m, worst.y_m, worst.alt_dsm_m]),
        required_clearance_m=plan.certificate.required_clearance_m,
        home_m=np.array([*line.home_xy_m, line.home_alt_dsm_m]),
        takeoff_alt_dsm_m=line.takeoff_alt_dsm_m,
        poi_m=np.column_stack([path.xy_m[pois], path.alt_dsm_m[pois]]),
    )


def _surface_grid(plan: Plan) -> HeightGrid:
    """The safe surface of the whole model, coarsened by maximum before it is dilated."""
    safe = safe_surface(fit_within(plan.dsm, _SURFACE_CELLS), plan.request.surface).safe
    west, _, _, north = safe.bounds_m
    return HeightGrid(alt_dsm_m=safe.elevation_m, west_m=west, north_m=north, cell_m=safe.resolution_m)
