"""A finished plan as the arrays that the 3D view draws."""

from __future__ import annotations

import numpy as np

from planning.plan import Plan
from server.scene.payload import PlanScene
from server.scene.relief import relief
from server.scene.simplified import kept_within

PATH_TOLERANCE_M = 0.02
"""Between the path and the line that is drawn."""


def plan_scene(plan: Plan) -> PlanScene:
    path, line, worst = plan.path, plan.line, plan.certificate.worst
    keep = kept_within(path.s_m, path.alt_dsm_m, PATH_TOLERANCE_M, must_keep=path.vertex)
    pois = [int(sample) for sample, poi in zip(path.vertex, path.vertex_poi, strict=True) if poi is not None]
    return PlanScene(
        safe_surface=relief(plan.surfaces, path),
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
