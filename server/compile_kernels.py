"""``python -m server.compile_kernels``: compiles the numba kernels into their cache, so that no operator waits."""

from __future__ import annotations

import numpy as np

from planning.demo import small_hill
from planning.dsm import Dsm
from planning.following.nearest import follow_track
from planning.following.reference import reference_line
from planning.following.surface import SurfaceDistance
from planning.model import Poi, VehicleProfile
from planning.plan import plan_mission
from planning.raycast import raycast
from planning.request import PlanRequest
from server import file_tasks, tasks


def main() -> None:
    tasks.warm_up(report=lambda step, share: None)
    file_tasks.warm_up(report=lambda step, share: None)
    dsm = small_hill()
    _follow_a_flight(dsm)
    west, south, east, north = dsm.bounds_m
    above_m = np.array([(west + east) / 2, (south + north) / 2, 1e4])
    raycast(dsm, above_m, np.array([0.0, 0.0, -1.0]), floor_alt_dsm_m=0.0)


def _follow_a_flight(dsm: Dsm) -> None:
    west, south, _, _ = dsm.bounds_m
    places = dsm.lat_lon_from_xy(np.array([(west + 30, south + 30), (west + 90, south + 80)]))
    profile = VehicleProfile("any")
    plan = plan_mission(dsm, PlanRequest(pois=tuple(Poi(lat, lon) for lat, lon in places.tolist()), profile=profile))
    reference = reference_line(plan.mission, dsm, profile)
    follow_track(reference, reference.points_m)
    SurfaceDistance(dsm).distances_m(reference.points_m)


if __name__ == "__main__":
    main()
