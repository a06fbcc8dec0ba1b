"""``python -m server.compile_kernels``: compiles the numba kernels into their cache, so that no operator waits."""

from __future__ import annotations

from typing import get_args

import numpy as np

from planning.evading.manoeuvres import Seen, around, over
from planning.evading.seen import conflicts
from planning.following.nearest import follow_track
from planning.following.reference import reference_line
from planning.following.surface import SurfaceDistance
from planning.ground.demo_hillside import small_hill
from planning.model import Poi, VehicleProfile
from planning.plan import plan_mission
from planning.request import PlanRequest
from planning.terrain.dsm import Dsm
from planning.terrain.raycast import raycast
from server.plan import file_tasks, tasks
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
    _see_and_avoid()
    dsm = small_hill()
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
    wall_m = np.array([(x, 20.0, z) for x in np.arange(-3.0, 4.0) for z in np.arange(0.0, 8.0)])
    line_m = np.array([here, (0.0, 60.0, 5.0)])
    for way in (over, around):
        way(line_m[0], line_m, [Seen(wall_m, 1.0)])
    conflicts(line_m, wall_m, resolution_m=1.0, radius_m=0.5)


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
