"""From samples to alert: the demo's first leg, looked at by a radar that is simulated from its samples on."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mapping.geometry.arrays import F64
from mapping.perceiving.alerts import AlertEvent
from mapping.perceiving.frame_result import Settings
from mapping.perceiving.radar_perception import RadarPerception
from planning.ground.demo_hillside import demo_dsm, demo_pois
from planning.missions.vehicle_profile import load_profile
from planning.planner.plan import Plan, plan_mission
from planning.planner.request import PlanRequest
from telemetry.perception.known_ground import ground_around
from telemetry.simulation.scenarios.stage.paper_fields import notice
from telemetry.simulation.simulator.demo_world import demo_world
from telemetry.simulation.simulator.neu_frame import NeuFrame
from telemetry.simulation.simulator.scene import World
from telemetry.simulation.simulator.sensors import radar_sensor
from telemetry.topics.obstacles import MapOrigin
from telemetry.topics.vehicle import SimTruth

SPEED_M_S, RADAR_S = 4.0, 0.1
FROM_M, TO_M = 4.0, 22.0
"""Along the mission from home; the building's face is 29 m away."""


@pytest.fixture(scope="module")
def plan() -> Plan:
    profile = replace(load_profile("generic-quad"), rtl_height_m=60.0)
    return plan_mission(demo_dsm(), PlanRequest(pois=demo_pois(), profile=profile))


@pytest.fixture(scope="module")
def scene(plan: Plan) -> World:
    """What stands still of the demo's."""
    home, whole = plan.mission.home, demo_world()
    still = [item for item in whole["objects"] if "path" not in item]  # type: ignore[union-attr]
    frame = NeuFrame(home.lat_deg, home.lon_deg, home.alt_dsm_m)
    return World.parse({**whole, "objects": still}, frame=frame, dsm=demo_dsm())


@pytest.fixture(scope="module")
def line(plan: Plan, scene: World) -> F64:
    """(N, 3) the first leg's planned path in the world's frame, a point every 0.1 m."""
    lat_lon = demo_dsm().lat_lon_from_xy(np.asarray(plan.path.xy_m))[:500]
    places = [scene.frame.neu_from_geodetic(lat, lon, float(alt))
              for (lat, lon), alt in zip(lat_lon.tolist(), plan.path.alt_dsm_m, strict=False)]  # fmt: skip
    return np.array(places)[:, [1, 0, 2]]


def truths(scene: World, line: F64) -> list[SimTruth]:
    """At a constant speed along the line."""
    along = np.hypot(*(line[:, :2] - line[0, :2]).T)
    out: list[SimTruth] = []
    for t_s in np.arange(0.0, (TO_M - FROM_M) / SPEED_M_S, RADAR_S):
        at = int(np.searchsorted(along, FROM_M + SPEED_M_S * t_s))
        step = line[at + 5] - line[at]
        velocity = SPEED_M_S * step / np.linalg.norm(step)
        frame = scene.frame
        out.append(
            SimTruth(
                t_mono_s=100.0 + float(t_s),
                t_utc_s=1e9 + float(t_s),
                t_sim_s=float(t_s),
                home_lat_deg=frame.lat_deg,
                home_lon_deg=frame.lon_deg,
                home_alt_amsl_m=frame.alt_amsl_m,
                position_enu_m=tuple(line[at].tolist()),
                velocity_enu_m_s=tuple(velocity.tolist()),
                roll_rad=0.0,
                pitch_rad=-0.05,
                heading_rad=math.atan2(velocity[0], velocity[1]),
                armed=True,
            )
        )
    return out


def test_the_new_building_is_alerted_in_time_and_nothing_else(scene: World, line: F64, tmp_path: Path) -> None:
    perception = RadarPerception(Settings())
    perception.set_ground(
        ground_around(
            notice(demo_dsm(), tmp_path),
            MapOrigin(scene.frame.lat_deg, scene.frame.lon_deg, scene.frame.alt_amsl_m),
        )
    )
    perception.set_line(line)
    radar = radar_sensor("iq", scene, seed=1)
    alerts: list[tuple[AlertEvent, SimTruth]] = []
    for truth in truths(scene, line):
        perception.feed_position(truth.t_mono_s, truth.position_enu_m, truth.velocity_enu_m_s)
        perception.feed_attitude(truth.t_mono_s, truth.roll_rad, truth.pitch_rad, truth.heading_rad)
        told = perception.on_frame(radar.frame(truth), truth.t_mono_s)
        alerts += [(alert, truth) for alert in told.alerts]
    first, then = next((alert, truth) for alert, truth in alerts if alert.obstacle is not None)
    assert first.phase == "begins"
    away_m = scene.distance_m(np.array([then.position_enu_m]))[0]
    assert 10.0 < away_m < 26.0
    believed = perception.map.occupied(explained=False)
    assert len(believed) >= 4
    assert np.all(scene.distance_m(believed) < 2.0)
