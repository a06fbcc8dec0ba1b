"""``python -m server.compile_kernels``: compiles the numba kernels into their cache, so that no operator waits."""

from __future__ import annotations

from typing import get_args

import numpy as np

from mapping.geometry.arrays import F64
from mapping.geometry.polyline import Polyline
from mapping.perceiving.ground import ground_grid
from mapping.voxels.map import VoxelMap
from planning.basics.plan_model import Poi, VehicleProfile
from planning.evading.manoeuvres import Seen, around, over
from planning.evading.seen import Columns, burn, conflicts
from planning.fence.fence_model import Fence, circle
from planning.following.nearest import follow_track
from planning.following.reference import reference_line
from planning.following.surface_distance import SurfaceDistance
from planning.ground.demo_hillside import small_hill
from planning.missions.flown import flown_line
from planning.planner.plan import plan_mission
from planning.planner.request import PlanRequest
from planning.risk.flights import fly, risk_ground
from planning.risk.uncertain import uncertain_of
from planning.route.around_fence import Kept, laid_legs
from planning.route.survey_fenced import fenced_lines
from planning.safe_surface.surface import block_max
from planning.terrain.dsm import Dsm
from planning.terrain.holes import fill_holes
from planning.terrain.raycast import raycast
from server.plan import file_tasks, tasks
from telemetry.nodes import tracks
from telemetry.perception.sensor_kinds import KINDS
from telemetry.perception.warm_up import warm_up
from telemetry.simulation.simulator.demo_world import demo_world
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.sensors import StereoSensor, radar_sensor
from telemetry.topics.vehicle import RadarKind, SimTruth


def main() -> None:
    tasks.warm_up(report=lambda step, share: None)
    file_tasks.warm_up(report=lambda step, share: None)
    for kind in KINDS.values():
        warm_up(kind)
    tracks.warm_up()
    _see_and_avoid()
    dsm = small_hill()
    _raise_and_fill(dsm)
    _lay_around(dsm)
    _follow_a_flight(dsm)
    west, south, east, north = dsm.bounds_m
    above_m = np.array([(west + east) / 2, (south + north) / 2, 1e4])
    raycast(dsm, above_m, np.array([0.0, 0.0, -1.0]), floor_alt_dsm_m=0.0)


def _see_and_avoid() -> None:
    """The simulated sensors in a world, and the ways past what they saw."""
    world = World.parse(demo_world())
    here = (0.0, 0.0, 5.0)
    place = world.frame.lat_deg, world.frame.lon_deg, world.frame.alt_amsl_m
    truth = SimTruth(0.0, 0.0, 0.0, *place, here, (0.0, 3.0, 0.0), 0.0, 0.0, 0.0, armed=True)
    for kind in get_args(RadarKind):
        radar_sensor(kind, world, seed=0).frame(truth)
    StereoSensor(world, seed=0).frame(truth)
    world.touching(here, 1.0)
    world.top_under_m(here)
    wall_m = np.array([(x, 20.0, z) for x in np.arange(-3.0, 4.0) for z in np.arange(0.0, 8.0)])
    line_m = np.array([here, (0.0, 60.0, 5.0)])
    ground = ground_grid(np.zeros((40, 40), np.float32), [[-1.0, 0.0, 20.0], [0.0, 1.0, 20.0]])
    for way in (over, around):
        way(line_m[0], line_m, [Seen(wall_m, 1.0)])
        way(line_m[0], line_m, [Seen(wall_m, 1.0)], ground)
    conflicts(line_m, wall_m, resolution_m=1.0, radius_m=0.5)
    Polyline(line_m).nearest(line_m[0])
    _change_a_map(wall_m)


def _lay_around(dsm: Dsm) -> None:
    """A leg and a survey's line around a circle."""
    west, south, east, north = dsm.bounds_m
    ends_xy_m = np.array([(west + share * (east - west), (south + north) / 2) for share in (0.2, 0.8)])
    first, last = ((float(lat), float(lon)) for lat, lon in dsm.lat_lon_from_xy(ends_xy_m))
    middle = (first[0] + last[0]) / 2, (first[1] + last[1]) / 2
    fence = Fence(circles=(circle(*middle, 1.0, inclusion=False, where="warm-up"),))
    kept = Kept(fence, first, (), margin_m=1.0, from_edge_m=0.0)
    laid_legs(dsm, ends_xy_m, kept)
    fenced_lines(dsm, (Poi(*first), Poi(*last)), kept, ways_back=False)


def _change_a_map(points_m: F64) -> None:
    voxels = VoxelMap(resolution_m=1.0)
    voxels.insert_hits(points_m)
    before, keys = voxels.revision, voxels.occupied_keys()
    voxels.mark_explained(keys, True)
    voxels.assign(keys, False)
    voxels.changed_since(before, ever_hit_only=True)


def _raise_and_fill(dsm: Dsm) -> None:
    """What surface models of files have and the hill has not: a hole; and what was seen, to be planned against."""
    holed_m = dsm.elevation_m.copy()
    holed_m[60, 60] = np.nan
    filled, _ = fill_holes(dsm.with_cells(holed_m))
    west, south, _, _ = dsm.bounds_m
    burn(filled, Columns(np.array([(west + 60.0, south + 60.0)]), np.array([20.0]), 1.0))
    block_max(filled, 2)


def _follow_a_flight(dsm: Dsm) -> None:
    west, south, _, _ = dsm.bounds_m
    places = dsm.lat_lon_from_xy(np.array([(west + 30, south + 30), (west + 90, south + 80)]))
    profile = VehicleProfile("any")
    plan = plan_mission(dsm, PlanRequest(pois=tuple(Poi(lat, lon) for lat, lon in places.tolist()), profile=profile))
    reference = reference_line(plan.mission, dsm, profile)
    follow_track(reference, reference.points_m)
    SurfaceDistance(dsm).distances_m(reference.points_m)
    budget = plan.certificate.budget
    assert budget is not None
    ground = risk_ground(dsm, flown_line(plan.mission, dsm))
    fly(ground, uncertain_of(budget, plan.certificate.home), range(1), seed=0)


if __name__ == "__main__":
    main()
